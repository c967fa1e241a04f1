"""The diaphragm motor's sections 7.1 to 7.3 repeated on its plant: flow, sensing, velocity, load, reversal, cycle.

Flow is that of the pump running freely to tank; velocity is that of the piston behind its valve (errata M22 and M26).
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import least_squares

from experiments.page.frames import Rows, as_table
from plant.diaphragm_motor.composite_plate import (
    PlateParameters,
    mode_shape,
    plate_coefficients,
    plate_deflection,
    plate_modes,
)
from plant.diaphragm_motor.flow import OperatingPoint, operate, pump_alone
from plant.diaphragm_motor.model import FLOWS, OPENINGS, PRESSURES
from plant.diaphragm_motor.parameters import DIAPHRAGMS, DiaphragmMotorParameters
from plant.diaphragm_motor.run import LONGEST_STEP, SAMPLE_TIME, motor_drive, run_motor, simulate_motor

PEAK, SWING = 480.0, 200.0
"""The published best frequency [Hz], and the peak-to-peak voltage at which the plant is calibrated [V]."""

PUBLISHED_FLOW = 110.11e-6 / 60.0
"""Peak flow of section 7.1 [m^3/s]."""

FREQUENCIES = (20.0, 60.0, *np.arange(100.0, 401.0, 25.0).tolist(), *np.arange(420.0, 541.0, 10.0).tolist(),
               *np.arange(560.0, 801.0, 30.0).tolist())  # fmt: skip
"""Frequencies of the sweep [Hz]."""

SWINGS = (100.0, 150.0, 200.0, 250.0, 300.0)
"""Voltages peak to peak [V]: the range of section 7.1."""

SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Loads as shares of the blocking force [dimensionless]."""

LOADS = (0.0, 12.5, 25.0, 37.5)
"""Loads at which the best frequency is sought [N]."""

PARTS = {
    "inertance": "liquid in the ports",
    "port_area": "area of the valves",
    "valve_lag": "lag of the valves",
    "diaphragm_compliance": "compliance of a diaphragm",
    "volume_a_volt": "volume a volt",
    "valve_resistance": "laminar resistance",
    "bulk_modulus": "bulk modulus",
}
"""Parts that may affect the peak, in words."""


def _point_row(point: OperatingPoint) -> dict[str, float]:
    sensed = {f"a{i + 1}_v": float(abs(point.tones[i])) for i in range(DIAPHRAGMS)}
    return {"flow_m3_s": point.outlet_flow, "velocity_m_s": point.velocity, **sensed}


def sweep_frequency(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return flow of the pump alone and amplitudes of its electrodes over frequency, as in section 7.1.

    Returns
    -------
    pandas.DataFrame
        Columns frequency_hz, flow_m3_s, velocity_m_s, a1_v to a7_v.
    """
    pump = pump_alone(p)
    return pd.DataFrame([{"frequency_hz": f, **_point_row(operate(pump, f, SWING))} for f in FREQUENCIES])


def sweep_voltage(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return flow and sensing over voltage at the best frequency, as in section 7.1.

    Returns
    -------
    pandas.DataFrame
        Columns voltage_v, flow_m3_s, velocity_m_s, a1_v to a7_v.
    """
    pump = pump_alone(p)
    return pd.DataFrame([{"voltage_v": swing, **_point_row(operate(pump, PEAK, swing))} for swing in SWINGS])


def blocking_force(p: DiaphragmMotorParameters, frequency: float, swing: float) -> float:
    """Return the load at which the piston stops, by regula falsi on its mean velocity (equation 18).

    Parameters
    ----------
    frequency : float
        Frequency of the drive [Hz].
    swing : float
        Peak-to-peak voltage [V].

    Returns
    -------
    float
        Force [N], without the friction force.
    """
    low, high = 0.0, 20.0
    while operate(replace(p, load_force=high), frequency, swing).velocity > 1e-5:
        low, high = high, high + 10.0
    for _ in range(8):
        middle = 0.5 * (low + high)
        moving = operate(replace(p, load_force=middle), frequency, swing).velocity > 1e-5
        low, high = (middle, high) if moving else (low, middle)
    return 0.5 * (low + high)


@as_table
def sweep_load(p: DiaphragmMotorParameters) -> Rows:
    """Return velocity and A4's amplitude over load at the best frequency (equation 18).

    Returns
    -------
    pandas.DataFrame
        Columns voltage_v, blocking_n, load_n, flow_m3_s, velocity_m_s, a1_v to a7_v.
    """
    for swing in (100.0, 200.0, 300.0):
        blocked = blocking_force(p, PEAK, swing)
        for load in blocked * np.array(SHARES):
            point = operate(replace(p, load_force=float(load)), PEAK, swing)
            yield {"voltage_v": swing, "blocking_n": blocked, "load_n": float(load), **_point_row(point)}


@as_table
def best_frequencies(p: DiaphragmMotorParameters) -> Rows:
    """Return velocity over frequency under several loads; by section 7.2 the best frequency rises (errata M31)."""
    for load in LOADS:
        loaded = replace(p, load_force=load)
        for frequency in np.arange(320.0, 561.0, 10.0).tolist():
            speed = operate(loaded, frequency, 300.0).velocity
            yield {"load_n": load, "frequency_hz": frequency, "velocity_m_s": speed}


def pump_cycle(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return two cycles of the settled pump: voltage, pressures, openings and flows (section 2, Figure 3).

    Returns
    -------
    pandas.DataFrame
        Columns time_s, drive_voltage_v, chamber_3_pa to chamber_5_pa, valve_4 and valve_5 (openings), flow_1_m3_s,
        flow_4_m3_s, flow_5_m3_s and flow_8_m3_s.
    """
    drive = motor_drive(PEAK, SWING, 0.1, LONGEST_STEP)
    states = run_motor(pump_alone(p), drive, LONGEST_STEP)
    last = round(2.0 / PEAK / LONGEST_STEP)
    shown = states[-last:]
    pressures, openings, flows = shown[:, PRESSURES], shown[:, OPENINGS], shown[:, FLOWS]
    columns = {"time_s": LONGEST_STEP * np.arange(last), "drive_voltage_v": drive[-last:]}
    columns |= {f"chamber_{i}_pa": pressures[:, i - 1] for i in (3, 4, 5)}
    columns |= {f"valve_{j}": openings[:, j - 1] for j in (4, 5)}
    columns |= {f"flow_{j}_m3_s": flows[:, j - 1] for j in (1, 4, 5, 8)}
    return pd.DataFrame(columns)


def reversal(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return a run on which the 4/3 valve extends, holds and retracts (section 5.1).

    Returns
    -------
    pandas.DataFrame
        Columns time_s, position_m, spool, every tenth sample.
    """
    changes = ((0.0, 1.0), (0.2, 0.0), (0.3, -1.0), (0.55, 0.0))
    drive = motor_drive(PEAK, SWING, 0.65, SAMPLE_TIME)
    record = simulate_motor([(time, replace(p, spool=spool)) for time, spool in changes], drive, SAMPLE_TIME)
    time = SAMPLE_TIME * np.arange(len(record))
    spool = np.array([spool for _, spool in changes])[np.searchsorted([t for t, _ in changes], time, side="right") - 1]
    return pd.DataFrame({"time_s": time, "position_m": record["position_m"], "spool": spool}).iloc[::10]


@as_table
def sensitivities(p: DiaphragmMotorParameters) -> Rows:
    """Return the sensitivity of peak flow and its frequency to each part, and to gas (errata M22).

    Returns
    -------
    pandas.DataFrame
        Columns part, change, frequency_hz (its shift), flow_percent.
    """
    best, most = _peak(p)
    changed = [(words, "10 % more", replace(p, **{name: 1.1 * getattr(p, name)})) for name, words in PARTS.items()]
    changed.append(("bulk modulus", "halved", replace(p, bulk_modulus=0.5 * p.bulk_modulus)))
    changed.append(("gas in the chambers", "0.1 to 2 %", replace(p, gas_fraction=(2e-2,) * DIAPHRAGMS)))
    for words, change, other in changed:
        frequency, flow = _peak(other)
        moved = {"frequency_hz": frequency - best, "flow_percent": 100.0 * (flow / most - 1.0)}
        yield {"part": words, "change": change, **moved}


def _peak(p: DiaphragmMotorParameters) -> tuple[float, float]:
    """Return the frequency of the pump's peak flow [Hz], by a parabola, and that flow [m^3/s]; searched uphill."""
    frequencies = np.arange(380.0, 581.0, 20.0)

    @cache
    def flow(k: int) -> float:
        return operate(pump_alone(p), float(frequencies[k]), SWING).outlet_flow

    last = len(frequencies) - 1
    k, before = last // 2, -1
    while k != before:
        before, k = k, max((one for one in (k, k - 1, k + 1) if 0 <= one <= last), key=flow)
    k = min(max(k, 1), last - 1)
    flows = np.array([flow(one) for one in (k - 1, k, k + 1)])
    a, b, _ = np.polyfit(frequencies[k - 1 : k + 2] - frequencies[k], flows, 2)
    shift = -0.5 * b / a
    return float(frequencies[k] + shift), float(flows[1] + 0.5 * b * shift)


@as_table
def other_sets(p: DiaphragmMotorParameters) -> Rows:
    """Return three sets of parameters that give the published peak, each with a different plate (errata M22).

    Returns
    -------
    pandas.DataFrame
        Columns set, inertance_kg_m4, port_area_m2, frequency_hz, flow_m3_s, blocking_n.
    """
    soft = PlateParameters()
    hard = replace(soft, charge_constant=171e-12, ceramic_compliance=16.4e-12)
    sets = {
        "PZT-5H, clamped at 14.0 mm": p,
        "PZT-5A, clamped at 14.4 mm": _calibrated(p, replace(hard, clamp_radius=14.4e-3), 6.6e-4),
        "PZT-5H, clamped at 17.5 mm": _calibrated(p, replace(soft, clamp_radius=17.5e-3), 1.06e-3),
    }
    for name, motor in sets.items():
        frequency, flow = _peak(motor)
        yield {
            "set": name,
            "inertance_kg_m4": motor.inertance,
            "port_area_m2": motor.port_area,
            "frequency_hz": frequency,
            "flow_m3_s": flow,
            "blocking_n": blocking_force(motor, PEAK, SWING),
        }


def _calibrated(p: DiaphragmMotorParameters, plate: PlateParameters, lag: float) -> DiaphragmMotorParameters:
    """Return the motor with another plate, with ports and valves chosen for the published peak."""
    found = plate_coefficients(plate)
    motor = replace(
        p,
        diaphragm_compliance=found.compliance,
        volume_a_volt=found.volume_a_volt,
        deflection_a_pascal=found.deflection_a_pascal,
        deflection_a_volt=found.deflection_a_volt,
        valve_lag=lag,
    )

    def with_ports(logs: NDArray[np.float64]) -> DiaphragmMotorParameters:
        stiffer = p.diaphragm_compliance / found.compliance
        inertance, area = float(np.exp(logs[0])), float(np.exp(logs[1]))
        return replace(motor, inertance=inertance * p.inertance * stiffer, port_area=area * p.port_area)

    def off(logs: NDArray[np.float64]) -> list[float]:
        frequency, flow = _peak(with_ports(logs))
        return [frequency / PEAK - 1.0, flow / PUBLISHED_FLOW - 1.0]

    fit = least_squares(off, [0.0, 0.5], diff_step=[0.02, 0.02], xtol=1e-3, ftol=1e-3, max_nfev=12)
    return with_ports(fit.x)


def dry_modes() -> pd.DataFrame:
    """Return the diaphragm's first six modes without liquid, in place of Figures 43 and 44 (Table 1).

    Returns
    -------
    pandas.DataFrame
        Columns diameters, circles, root, frequency_hz.
    """
    rows = [(mode.diameters, mode.circles, mode.root, mode.frequency) for mode in plate_modes(PlateParameters())]
    return pd.DataFrame(rows, columns=["diameters", "circles", "root", "frequency_hz"])


def bent_plate() -> pd.DataFrame:
    """Return the deflection of the dry diaphragm along a radius, in place of Figure 42 (Table 1).

    Returns
    -------
    pandas.DataFrame
        Columns radius_m, at_100_v_m (without pressure) and at_10_kpa_m (without voltage).
    """
    plate = PlateParameters()
    radii = np.linspace(0.0, plate.clamp_radius, 57)
    volts, pressure = (plate_deflection(plate, *load, radii) for load in ((0.0, 100.0), (1e4, 0.0)))
    return pd.DataFrame({"radius_m": radii, "at_100_v_m": volts, "at_10_kpa_m": pressure})


@as_table
def mode_shapes() -> Rows:
    """Return the shapes of the dry diaphragm's first six modes, in place of Figure 43.

    Returns
    -------
    pandas.DataFrame
        Columns mode, diameters, circles, frequency_hz, share_of_radius, angle_rad, shape.
    """
    radii, angles = (found.ravel() for found in np.meshgrid(np.linspace(0.0, 1.0, 21), np.linspace(0.0, 2 * np.pi, 49)))
    for number, mode in enumerate(plate_modes(PlateParameters()), start=1):
        named = {"mode": number, "diameters": mode.diameters, "circles": mode.circles, "frequency_hz": mode.frequency}
        for radius, angle, shape in zip(radii, angles, mode_shape(mode, radii, angles), strict=True):
            yield {**named, "share_of_radius": radius, "angle_rad": angle, "shape": shape}
