"""The paper's steady-state experiments on the circuit plant: Figures 3, 4, 8 and 9, as tables.

Every point is a run from rest at constant speed until it settles. The cylinder is given a stroke that is long enough
for that; on the rig the same takes several strokes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pandas as pd

from estimation.steady_state_fit import SteadyFit, SteadyPoints, fit_friction, fit_leakage, steady_points
from experiments.frames import cell
from experiments.published import SCALARS, load
from faults.conditions import LEVELS, Level
from faults.physical import VOLTS_A, VOLTS_B, throttled
from plant.circuit_parameters import CircuitParameters
from plant.record import Record
from plant.sensors import BENCH, IDEAL, Sensors
from plant.simulate import CIRCUIT, simulate

SAMPLE_TIME = 1e-3
"""Sample time of the steady-state runs [s]."""

HOLD = 8.0
"""Time at each constant speed [s]: ten times the slowest settling, of a stiff load without leakage."""

LONG_STROKE = 1.2
"""Stroke in which the piston settles at 4 V [m]."""

FIGURE_3_VOLTS = (10.0, 6.0, 4.0, 3.0, 2.5, 2.2, 2.0, 1.9, 1.75, 1.6, 1.5)
FIGURE_4_VOLTS = (0.0, 1.0, 1.5, 2.0, 2.2, 2.3, 2.4, 2.5, 2.6, 2.8, 3.0)
FIGURE_8_VOLTS = (0.0, 2.0, 2.2, 2.3, 2.4)
FIGURE_9_VOLTS = (0.5, 0.7, 1.0, 1.3, 1.6, 1.9, 2.2, 2.5, 2.8, 3.1, 3.5)


def steady_run(
    p: CircuitParameters, speed: float, sensors: Sensors = IDEAL, rng: np.random.Generator | None = None
) -> Record:
    """Return a run from rest at constant speed until it has settled.

    Parameters
    ----------
    p : CircuitParameters
        The circuit; its stroke is made long enough.
    speed : float
        Motor speed [rad/s].
    sensors : Sensors
        What the bench sees.
    rng : numpy.random.Generator, optional
        Source of sensor noise.

    Returns
    -------
    Record
        `HOLD` seconds.
    """
    roomy = replace(p, stroke=max(p.stroke, LONG_STROKE))
    drive = np.full(round(HOLD / SAMPLE_TIME), speed)
    return simulate(CIRCUIT, drive, SAMPLE_TIME, roomy, sensors=sensors, rng=rng)


def leakage_curve(rig: CircuitParameters, volts: Iterable[float] = FIGURE_3_VOLTS) -> pd.DataFrame:
    """Return settled velocity against throttle A's voltage at 4 V of motor, throttle B open: Figure 3.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    volts : iterable of float
        Throttle A's voltages [V].

    Returns
    -------
    pandas.DataFrame
        One row a voltage; the published share of normal where the paper defines a level there (errata E6, E7).
    """
    defined = _defined(VOLTS_A, ("minor_leakage_velocity", "major_leakage_velocity"))
    return _curve([(v, throttled(rig, v, 0.0)) for v in volts], rig, "throttle_a_v", "velocity_m_s", defined)


def friction_curve(rig: CircuitParameters, volts: Iterable[float] = FIGURE_4_VOLTS) -> pd.DataFrame:
    """Return settled differential pressure against throttle B's voltage at 4 V of motor, throttle A shut: Figure 4.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    volts : iterable of float
        Throttle B's voltages [V].

    Returns
    -------
    pandas.DataFrame
        One row a voltage, saturating at the relief setting; the published share of normal where the paper defines a
        level there (errata E7).
    """
    defined = _defined(VOLTS_B, ("minor_friction_pressure", "major_friction_pressure"))
    pressure = "differential_pressure_pa"
    return _curve([(v, throttled(rig, 10.0, v)) for v in volts], rig, "throttle_b_v", pressure, defined)


def leakage_points(
    rig: CircuitParameters, level: Level, rng: np.random.Generator, volts: Iterable[float] = FIGURE_8_VOLTS
) -> SteadyPoints:
    """Return steady points at one leakage level, 4 V of motor and several loads by throttle B: Figure 8.

    Loads stay below the relief setting: what the relief valve passes is no leakage.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    level : {"none", "minor", "major"}
        Leakage level, by throttle A.
    rng : numpy.random.Generator
        Source of sensor noise.
    volts : iterable of float
        Throttle B's voltages [V].

    Returns
    -------
    SteadyPoints
        The points.
    """
    a_volts = VOLTS_A[LEVELS.index(level)]
    return steady_points(steady_run(throttled(rig, a_volts, v), rig.rated_speed, BENCH, rng) for v in volts)


def friction_points(
    rig: CircuitParameters, level: Level, rng: np.random.Generator, volts: Iterable[float] = FIGURE_9_VOLTS
) -> SteadyPoints:
    """Return steady points at one friction level and several motor voltages, throttle A shut: Figure 9.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    level : {"none", "minor", "major"}
        Friction level, by throttle B.
    rng : numpy.random.Generator
        Source of sensor noise.
    volts : iterable of float
        Motor voltages [V]; those of the paper are random from 0.5 V to 3.5 V.

    Returns
    -------
    SteadyPoints
        The points.
    """
    p = throttled(rig, 10.0, VOLTS_B[LEVELS.index(level)])
    return steady_points(steady_run(p, v * rig.motor_speed_per_volt, BENCH, rng) for v in volts)


def leakage_refit(rig: CircuitParameters, rng: np.random.Generator) -> pd.DataFrame:
    """Return Table 3 refitted from steady points by equations 5.7 and 5.8, beside what went in and what is published.

    What went in is the circuit's settled leakage: with make-up open the drain counts whole (errata E17).

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    rng : numpy.random.Generator
        Source of sensor noise.

    Returns
    -------
    pandas.DataFrame
        One row a level and coefficient.
    """
    published = load("leakage").set_index("leakage")
    rows: list[dict[str, object]] = []
    for level in LEVELS:
        p = throttled(rig, VOLTS_A[LEVELS.index(level)], 0.0)
        went_in = {"leakage_coefficient": p.settled_leakage, "flow_bias": p.flow_bias}
        printed = {
            "leakage_coefficient": cell(published, level, "leakage_coefficient_m3_per_s_pa"),
            "flow_bias": cell(published, level, "flow_bias_m3_per_s"),
        }
        rows += _refit_rows(level, fit_leakage(leakage_points(rig, level, rng), p), went_in, printed)
    return pd.DataFrame(rows)


def friction_refit(rig: CircuitParameters, rng: np.random.Generator) -> pd.DataFrame:
    """Return Table 4 refitted from steady points by equation 5.11, beside what went in and what is published.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    rng : numpy.random.Generator
        Source of sensor noise.

    Returns
    -------
    pandas.DataFrame
        One row a level and coefficient.
    """
    published = load("friction").set_index("friction")
    names = ("friction_quadratic", "friction_linear", "friction_coulomb")
    columns = [column for column in published.columns if column.startswith("a")]
    rows: list[dict[str, object]] = []
    for level in LEVELS:
        p = throttled(rig, 10.0, VOLTS_B[LEVELS.index(level)])
        went_in = {name: float(getattr(p, name)) for name in names}
        printed = {name: cell(published, level, column) for name, column in zip(names, columns, strict=True)}
        rows += _refit_rows(level, fit_friction(friction_points(rig, level, rng), p), went_in, printed)
    return pd.DataFrame(rows)


def _defined(volts: Sequence[float], scalars: Sequence[str]) -> Mapping[float, float]:
    shares = [1.0, *(SCALARS[name].si_value for name in scalars)]
    return MappingProxyType({v: 100.0 * share for v, share in zip(volts, shares, strict=True)})


def _curve(
    circuits: Sequence[tuple[float, CircuitParameters]],
    rig: CircuitParameters,
    axis: str,
    quantity: str,
    published: Mapping[float, float],
) -> pd.DataFrame:
    settled = round(1.0 / SAMPLE_TIME)

    def last_second(p: CircuitParameters) -> float:
        return float(np.mean(steady_run(p, rig.rated_speed)[quantity][-settled:]))

    normal = last_second(rig)
    values = [last_second(p) for _, p in circuits]
    return pd.DataFrame(
        {
            axis: [volts for volts, _ in circuits],
            quantity: values,
            "percent_of_normal": [100.0 * value / normal for value in values],
            "published_percent": [published.get(volts, float("nan")) for volts, _ in circuits],
        }
    )


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
