"""The paper's steady-state experiments on the circuit plant: Figures 3, 4, 8 and 9, as tables.

Every point is a run from rest at constant speed until it settles. The cylinder is given a stroke that is long enough
for that; on the rig the same test takes several strokes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from estimation.fits.steady_state_fit import SteadyFit, SteadyPoints, fit_friction, fit_leakage, steady_points
from experiments.page.frames import Frames, Rows, as_stacked_table, as_table, cell
from experiments.published import SCALARS, load
from faults.conditions import LEVELS, Level
from faults.eha.physical import VOLTS_A, VOLTS_B, with_throttles
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.simulate import CIRCUIT, simulate_each
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors

SAMPLE_TIME = 1e-3
"""Sample time of the steady-state runs [s]."""

HOLD = 8.0
"""Time at each constant speed [s]: ten times the slowest settling time, that of a stiff load without leakage."""

LONG_STROKE = 1.2
"""Stroke long enough for the piston to settle at 4 V [m]."""

FIGURE_8_VOLTS = (0.0, 2.0, 2.2, 2.3, 2.4)
FIGURE_9_VOLTS = (0.5, 0.7, 1.0, 1.3, 1.6, 1.9, 2.2, 2.5, 2.8, 3.1, 3.5)


def steady_runs(
    circuits: Sequence[CircuitParameters],
    speed: float,
    sensors: Sensors = IDEAL,
    rng: np.random.Generator | None = None,
) -> list[Record]:
    """Return runs from rest at constant speed until each has settled.

    Parameters
    ----------
    circuits : sequence of CircuitParameters
        The circuits; their strokes are made long enough.
    speed : float
        Motor speed [rad/s].
    rng : numpy.random.Generator, optional
        Source of sensor noise.

    Returns
    -------
    list of Record
        Runs of duration `HOLD`.
    """
    roomy = [replace(p, stroke=max(p.stroke, LONG_STROKE)) for p in circuits]
    drive = np.full(round(HOLD / SAMPLE_TIME), speed)
    rngs = None if rng is None else [rng] * len(roomy)
    return simulate_each(CIRCUIT, drive, SAMPLE_TIME, roomy, sensors=sensors, rngs=rngs)


@dataclass(frozen=True)
class Sweep:
    """A sweep of one throttle at 4 V motor voltage, with the other throttle unchanged.

    Parameters
    ----------
    volts : tuple of float
        The throttle's voltages [V].
    circuit : callable
        Function from the healthy circuit and a voltage [V] to the circuit.
    defined : Mapping[float, float]
        Published share of normal [%] at the voltages at which the paper defines a level (errata E6, E7).
    """

    axis: str
    quantity: str
    volts: tuple[float, ...]
    circuit: Callable[[CircuitParameters, float], CircuitParameters]
    defined: Mapping[float, float]


def _published_percents(volts: Sequence[float], scalars: Sequence[str]) -> Mapping[float, float]:
    shares = [1.0, *(SCALARS[name].si_value for name in scalars)]
    return {v: 100.0 * share for v, share in zip(volts, shares, strict=True)}


LEAKAGE_SWEEP = Sweep(
    "throttle_a_v",
    "velocity_m_s",
    (10.0, 6.0, 4.0, 3.0, 2.5, 2.2, 2.0, 1.9, 1.75, 1.6, 1.5),
    lambda rig, volts: with_throttles(rig, volts, 0.0),
    _published_percents(VOLTS_A, ("minor_leakage_velocity", "major_leakage_velocity")),
)
"""Figure 3: velocity against throttle A, throttle B open."""

FRICTION_SWEEP = Sweep(
    "throttle_b_v",
    "differential_pressure_pa",
    (0.0, 1.0, 1.5, 2.0, 2.2, 2.3, 2.4, 2.5, 2.6, 2.8, 3.0),
    lambda rig, volts: with_throttles(rig, 10.0, volts),
    _published_percents(VOLTS_B, ("minor_friction_pressure", "major_friction_pressure")),
)
"""Figure 4: differential pressure against throttle B, throttle A shut; it saturates at the relief setting."""


def throttle_curve(rig: CircuitParameters, sweep: Sweep) -> pd.DataFrame:
    """Return the steady values over a sweep of one throttle at 4 V of motor voltage: Figures 3 and 4.

    Returns
    -------
    pandas.DataFrame
        One row for each voltage, with the published share of normal if the paper defines a level there.
    """
    circuits = [rig, *(sweep.circuit(rig, volts) for volts in sweep.volts)]
    settled = round(1.0 / SAMPLE_TIME)
    runs = steady_runs(circuits, rig.rated_speed)
    normal, *values = (float(np.mean(run[sweep.quantity][-settled:])) for run in runs)
    return pd.DataFrame(
        {
            sweep.axis: sweep.volts,
            sweep.quantity: values,
            "percent_of_normal": [100.0 * value / normal for value in values],
            "published_percent": [sweep.defined.get(volts, float("nan")) for volts in sweep.volts],
        }
    )


def leakage_points(rig: CircuitParameters, level: Level, rng: np.random.Generator) -> SteadyPoints:
    """Return steady points at one leakage level, 4 V motor voltage and several loads set by throttle B: Figure 8.

    Loads stay below the relief setting, because flow through the relief valve is not leakage.

    Parameters
    ----------
    level : {"none", "minor", "major"}
        Leakage level, set by throttle A.
    """
    a_volts = VOLTS_A[LEVELS.index(level)]
    return steady_points(
        steady_runs([with_throttles(rig, a_volts, v) for v in FIGURE_8_VOLTS], rig.rated_speed, BENCH, rng)
    )


def friction_points(rig: CircuitParameters, level: Level, rng: np.random.Generator) -> SteadyPoints:
    """Return steady points at one friction level and several motor voltages, throttle A shut: Figure 9.

    Parameters
    ----------
    level : {"none", "minor", "major"}
        Friction level, set by throttle B.
    """
    p = with_throttles(rig, 10.0, VOLTS_B[LEVELS.index(level)])
    runs = (steady_runs([p], v * rig.motor_speed_per_volt, BENCH, rng) for v in FIGURE_9_VOLTS)
    return steady_points(run for found in runs for run in found)


@as_stacked_table
def points_table(
    rig: CircuitParameters,
    rng: np.random.Generator,
    points: Callable[[CircuitParameters, Level, np.random.Generator], SteadyPoints],
) -> Frames:
    """Return the steady points that a refit uses: Figures 8 and 9.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of sensor noise, the same as that of the refit.
    points : callable
        `leakage_points` or `friction_points`.

    Returns
    -------
    pandas.DataFrame
        One row for each point: level, velocity, differential pressure, lost flow and friction force.
    """
    for level in LEVELS:
        found = points(rig, level, rng)
        lost = rig.pump_displacement * found.speed - rig.piston_area * found.velocity
        yield {
            "level": level,
            "velocity_m_s": found.velocity,
            "differential_pressure_pa": found.pressure,
            "lost_flow_m3_s": lost,
            "friction_n": rig.piston_area * found.pressure,
        }


@as_table
def leakage_refit(rig: CircuitParameters, rng: np.random.Generator) -> Rows:
    """Return Table 3 refitted from steady points by equations 5.7 and 5.8, beside the plant's and the published values.

    The plant's value is the circuit's settled leakage: with make-up open, the drain counts in full (errata E17).
    """
    published = load("leakage").set_index("leakage")
    for level in LEVELS:
        p = with_throttles(rig, VOLTS_A[LEVELS.index(level)], 0.0)
        went_in = {"leakage_coefficient": p.settled_leakage, "flow_bias": p.flow_bias}
        printed = {
            "leakage_coefficient": cell(published, level, "leakage_coefficient_m3_per_s_pa"),
            "flow_bias": cell(published, level, "flow_bias_m3_per_s"),
        }
        yield from _refit_rows(level, fit_leakage(leakage_points(rig, level, rng), p), went_in, printed)


@as_table
def friction_refit(rig: CircuitParameters, rng: np.random.Generator) -> Rows:
    """Return Table 4 refitted from steady points by equation 5.11, beside the plant's and the published values."""
    published = load("friction").set_index("friction")
    names = ("friction_quadratic", "friction_linear", "friction_coulomb")
    columns = [column for column in published.columns if column.startswith("a")]
    for level in LEVELS:
        p = with_throttles(rig, 10.0, VOLTS_B[LEVELS.index(level)])
        went_in = {name: float(getattr(p, name)) for name in names}
        printed = {name: cell(published, level, column) for name, column in zip(names, columns, strict=True)}
        yield from _refit_rows(level, fit_friction(friction_points(rig, level, rng), p), went_in, printed)


def _refit_rows(
    level: Level, fit: SteadyFit, went_in: Mapping[str, float], published: Mapping[str, float]
) -> list[dict[str, object]]:
    return [
        {
            "level": level,
            "coefficient": name,
            "published": published[name],
            "went_in": went_in[name],
            "refitted": found.value,
            "low": found.low,
            "high": found.high,
            "covered": found.covers(went_in[name]),
            "points": fit.points,
        }
        for name, found in fit.coefficients.items()
    ]
