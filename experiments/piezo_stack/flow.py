"""The piezo-stack actuator's flow: Figures 10 to 14 repeated, design maps, and what limits the flow.

Only the numbers that the paper's text quotes are published (errata P17).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby, product

import numpy as np
import pandas as pd

from experiments.page.frames import Frames, Rows, as_stacked_table, as_table
from experiments.running.executors import map_in_parallel
from plant.errors import HydrostateError
from plant.piezo_stack.flow import FLOW_TIME, STAGES, line_reynolds_numbers, mean_flow, stages
from plant.piezo_stack.free import loop_width, stack_loop
from plant.piezo_stack.model import GRAVITY, stack_pressures
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import FINE_TIME, sine_drive
from plant.piezo_stack.trajectory import LANES, run_stack, run_stacks

LOOP_FREQUENCIES = (1.0, 50.0, 100.0, 200.0, 300.0, 400.0)
"""Frequencies of Figure 10's loops [Hz]."""

LOOP_VOLTAGE = 100.0
"""Peak-to-peak voltage of Figure 10 [V]."""

FREQUENCIES = tuple(np.arange(25.0, 451.0, 25.0).tolist())
"""Frequencies of Figures 11 to 13 [Hz]."""

LOADS = (0.0, 2.5, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0)
"""Loads of Figure 14 [kg]."""

LOAD_FREQUENCIES = (225.0, 275.0, 325.0)
"""Frequencies of Figure 14 [Hz]."""

HIGH_BIAS, LOW_BIAS = 1.0e6, 0.6e6
"""The two bias pressures [Pa]."""

HIGH_VOLTAGE, LOW_VOLTAGE = 140.0, 100.0
"""The two peak-to-peak voltages [V]."""


@dataclass(frozen=True)
class OperatingPoint:
    """One setting of the actuator.

    Parameters
    ----------
    frequency_hz, voltage_v : float
        Frequency and peak-to-peak voltage of the drive.
    bias_pressure_pa : float
        Bias pressure.
    load_kg : float
        Load lifted.
    """

    frequency_hz: float
    voltage_v: float
    bias_pressure_pa: float
    load_kg: float


@dataclass(frozen=True)
class DesignGrid:
    """The settings of a design map.

    Parameters
    ----------
    frequencies_hz, voltages_v, biases_pa, loads_kg : tuple of float
        The values on each axis.
    """

    frequencies_hz: tuple[float, ...] = tuple(np.linspace(25.0, 450.0, 19).round(2).tolist())
    voltages_v: tuple[float, ...] = (80.0, 100.0, 120.0, 140.0)
    biases_pa: tuple[float, ...] = (LOW_BIAS, HIGH_BIAS)
    loads_kg: tuple[float, ...] = (0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0)

    def points(self) -> list[OperatingPoint]:
        """Return every setting of the grid."""
        axes = product(self.biases_pa, self.voltages_v, self.loads_kg, self.frequencies_hz)
        return [OperatingPoint(f, u, b, m) for b, u, m, f in axes]


DESIGN_GRID = DesignGrid()
"""The full map: 19 frequencies, 4 voltages, 2 bias pressures, 7 loads."""

QUICK_GRID = DesignGrid((150.0, 275.0, 400.0), (100.0, 140.0), (LOW_BIAS, HIGH_BIAS), (0.0, 20.0))


def sweep(p: PiezoStackParameters, points: Sequence[OperatingPoint]) -> Iterator[dict[str, float]]:
    """Run many operating points, several side by side, and return the results of each: flow, and power in and out.

    Yields
    ------
    dict[str, float]
        In the points' order: the setting, ``flow_m3_s``, ``stack_power_w`` that the stack gives to its head, and
        ``output_power_w`` that lifts rod, carriage and load.
    """
    yield from rows_of([(p, point) for point in points])


def rows_of(cases: Sequence[tuple[PiezoStackParameters, OperatingPoint]]) -> Iterator[dict[str, float]]:
    """Return the outputs of actuators at operating points, as `sweep` does; runs of one length share a kernel.

    Parameters
    ----------
    cases : sequence of tuple
        Actuator and setting of each case.

    Yields
    ------
    dict[str, float]
        As `sweep`.
    """
    groups = [list(group) for _, group in groupby(cases, key=lambda case: _run_time(case[1].frequency_hz))]
    parts = [group[first : first + LANES] for group in groups for first in range(0, len(group), LANES)]
    for rows in map_in_parallel(_rows_together, parts):
        yield from rows


def _rows_together(cases: Sequence[tuple[PiezoStackParameters, OperatingPoint]]) -> list[dict[str, float]]:
    """Run cases of one length in one kernel."""
    time = _run_time(cases[0][1].frequency_hz)
    actuators = [replace(p, bias_pressure=at.bias_pressure_pa, load_mass=at.load_kg) for p, at in cases]
    drives = [sine_drive(at.frequency_hz, at.voltage_v, time, FINE_TIME) for _, at in cases]
    runs = run_stacks(actuators, np.column_stack(drives), FINE_TIME)
    return [_row(q, at, states) for q, (_, at), states in zip(actuators, cases, runs, strict=True)]


def _row(q: PiezoStackParameters, point: OperatingPoint, states: np.ndarray) -> dict[str, float]:
    if not np.all(np.isfinite(states[-1])):
        raise HydrostateError(f"the run at {point.frequency_hz:g} Hz stopped being finite: check its parameters")
    flow = mean_flow(states[:, 12], FINE_TIME, point.frequency_hz, q.cylinder_area)
    half = states[len(states) // 2 :]
    _, v, driven, h = half.T[:4]
    power = float(np.mean((driven - q.stack_stiffness * h) * v))
    lifted = q.moving_mass * GRAVITY * flow / q.cylinder_area
    return {**asdict(point), "flow_m3_s": flow, "stack_power_w": power, "output_power_w": lifted}


def _run_time(frequency: float) -> float:
    """Return the duration of a run: the bench's, or longer if its second half would not hold a cycle [s]."""
    return max(FLOW_TIME, 4.0 / frequency)


def pump_cycle(p: PiezoStackParameters, point: OperatingPoint) -> pd.DataFrame:
    """Return the last two pump cycles of a run, each sample with its stage and Reynolds number (Figure 2).

    Returns
    -------
    pandas.DataFrame
        Columns time_s, voltage_v, displacement_m, chamber_pa, delivery_pa, intake_pa, outlet_reed_m, inlet_reed_m,
        delivery_flow_m3_s, reynolds_number, stage.
    """
    q = replace(p, bias_pressure=point.bias_pressure_pa, load_mass=point.load_kg)
    voltage = sine_drive(point.frequency_hz, point.voltage_v, _run_time(point.frequency_hz), FINE_TIME)
    states = run_stack(q, voltage, FINE_TIME)
    count = round(2.0 / (point.frequency_hz * FINE_TIME)) + 1
    pressure = stack_pressures(tuple(states.T), q)
    frame = pd.DataFrame(
        {
            "time_s": FINE_TIME * np.arange(len(states)),
            "voltage_v": voltage,
            "displacement_m": states[:, 0],
            "chamber_pa": pressure.chamber,
            "delivery_pa": pressure.delivery,
            "intake_pa": pressure.intake,
            "outlet_reed_m": states[:, 5],
            "inlet_reed_m": states[:, 7],
            "delivery_flow_m3_s": states[:, 10],
            "reynolds_number": line_reynolds_numbers(states, q),
            "stage": [STAGES[stage] for stage in stages(states, q)],
        }
    )
    last = frame.iloc[-count:].reset_index(drop=True)
    return last.assign(time_s=last["time_s"] - last["time_s"].iloc[0])


@as_stacked_table
def stack_loops(p: PiezoStackParameters) -> Frames:
    """Return loops of voltage and displacement of the free stack: Figure 10."""
    for frequency in LOOP_FREQUENCIES:
        voltage, displacement = stack_loop(p, frequency, LOOP_VOLTAGE)
        yield {"frequency_hz": frequency, "voltage_v": voltage, "displacement_m": displacement}


@as_table
def loop_widths(loops: pd.DataFrame) -> Rows:
    """Return stroke and width of each loop of `stack_loops`."""
    for frequency, loop in loops.groupby("frequency_hz"):
        yield {
            "frequency_hz": frequency,
            "stroke_m": float(np.ptp(loop["displacement_m"])),
            "width_percent": 100.0 * loop_width(loop["voltage_v"].to_numpy(), loop["displacement_m"].to_numpy()),
        }


def figure_points() -> dict[str, list[OperatingPoint]]:
    """Return the operating points of Figures 11 to 14, by the name of their table."""
    no_load = [OperatingPoint(f, HIGH_VOLTAGE, b, 0.0) for b in (LOW_BIAS, HIGH_BIAS) for f in FREQUENCIES]
    voltages = [OperatingPoint(f, u, HIGH_BIAS, 0.0) for u in (LOW_VOLTAGE, HIGH_VOLTAGE) for f in FREQUENCIES]
    fixed = [OperatingPoint(f, HIGH_VOLTAGE, HIGH_BIAS, m) for m in (0.0, 10.0, 20.0) for f in FREQUENCIES]
    loads = [OperatingPoint(f, HIGH_VOLTAGE, HIGH_BIAS, m) for f in LOAD_FREQUENCIES for m in LOADS]
    return {
        "figure 11 flow over bias pressure": no_load,
        "figure 12 flow over voltage": voltages,
        "figure 13 flow with fixed weight": fixed,
        "figure 14 flow over load": loads,
    }


LIMITS: Mapping[str, tuple[str, ...]] = {
    "reed stiffness": ("outlet_reed_stiffness", "inlet_reed_stiffness"),
    "reed mass": ("reed_mass",),
    "reed perimeter": ("reed_perimeter",),
    "reed lift": ("reed_lift",),
    "line length (inertance)": ("delivery_length", "return_length", "intake_length"),
    "line area": ("line_area",),
    "entrained air": ("air_fraction",),
    "oil bulk modulus": ("bulk_modulus",),
    "oil viscosity": ("viscosity",),
    "chamber volume": ("chamber_height", "dead_volume"),
    "stack stroke per volt": ("free_stroke_a_volt",),
    "stack stiffness": ("stack_stiffness",),
    "hysteresis": ("hysteresis",),
    "piston area": ("piston_area",),
    "cylinder friction": ("viscous_friction", "coulomb_friction"),
}
"""Parts that may limit the flow, with their parameters."""

STEP = 0.05
"""Relative change of each parameter [fraction]."""


def sensitivities(p: PiezoStackParameters, load: float = 10.0) -> pd.DataFrame:
    """Return the sensitivity of the flow at 275 Hz to each part, up and down.

    Parameters
    ----------
    load : float
        Load lifted [kg].

    Returns
    -------
    pandas.DataFrame
        Columns part, percent_up and percent_down: change of flow for 5 % more and 5 % less.
    """
    point = OperatingPoint(275.0, HIGH_VOLTAGE, HIGH_BIAS, load)
    changed = [p] + [
        replace(p, **{name: factor * getattr(p, name) for name in names})
        for names in LIMITS.values()
        for factor in (1.0 + STEP, 1.0 - STEP)
    ]
    base, *flows = (row["flow_m3_s"] for row in rows_of([(q, point) for q in changed]))
    percent = [100.0 * (flow / base - 1.0) for flow in flows]
    return pd.DataFrame({"part": list(LIMITS), "percent_up": percent[::2], "percent_down": percent[1::2]})


def best_points(design: pd.DataFrame, voltage_limit: float, power_limit: float) -> pd.DataFrame:
    """Return the setting with the largest flow within limits, for each load and bias pressure.

    Parameters
    ----------
    design : pandas.DataFrame
        Rows from `sweep`.
    voltage_limit : float
        Largest peak-to-peak voltage [V].
    power_limit : float
        Largest power of the stack [W].

    Returns
    -------
    pandas.DataFrame
        The rows with the largest flow, one for each load and bias pressure; none if no setting within the limits lifts
        the load.
    """
    within = (design["voltage_v"] <= voltage_limit) & (design["stack_power_w"] <= power_limit)
    allowed = design[within & (design["flow_m3_s"] > 0.0)]
    best = allowed.groupby(["bias_pressure_pa", "load_kg"])["flow_m3_s"].idxmax()
    return allowed.loc[best].reset_index(drop=True)
