"""Figure 12 left out: parameters calibrated to only Figures 11 and 13, and their prediction at 100 V.

No calibration here uses a run at 100 V. Each starts from parameters drawn about those that ship, since the shipped ones
were fitted with Figure 12 (decision 25), and is regularised towards its starting point.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.page.frames import Rows, as_table
from experiments.piezo_stack.flow import (
    FREQUENCIES,
    HIGH_BIAS,
    HIGH_VOLTAGE,
    LOW_BIAS,
    LOW_VOLTAGE,
    OperatingPoint,
    rows_of,
)
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from plant.arrays import Array
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.units import LITRE_PER_MINUTE

FREED: tuple[tuple[str, ...], ...] = (
    ("piston_area",),
    ("head_stiffness",),
    ("reed_mass",),
    ("outlet_reed_stiffness", "inlet_reed_stiffness"),
    ("reed_lift",),
    ("delivery_length", "return_length", "intake_length"),
    ("line_area",),
    ("viscous_friction",),
    ("air_fraction",),
)
"""Parameters that are searched; those in one group change by the same factor."""

APART, START_SPREAD = 0.1, 0.2
"""Spread of the starting points, and standard deviation of the prior about its own starting point [logarithm]."""

PEAK_FREQUENCIES = (225.0, 250.0, 275.0, 300.0, 325.0)
"""Frequencies at which the maximum flow is sought [Hz]."""

PEAK = 275.0
"""Frequency of the maxima in Figure 11 [Hz]."""

QUOTED_VALUES, ALLOWED_ERRORS = np.array([1.6, 1.0, PEAK, PEAK]), np.array([0.05, 0.05, 12.5, 12.5])
"""Values that the text quotes from Figures 11 and 13, with half a unit of the last digit or half the sweep's step:
largest flow at 1.0 MPa and flow with 20 kg [L/min], best frequencies at 1.0 and 0.6 MPa [Hz]."""

LIFTED_MASS = 20.0
"""The load of the quoted point of Figure 13 [kg]."""

STEP, TURNS = 0.02, 8
"""Step of the finite differences [logarithm], and maximum number of search steps."""


def with_factors(p: PiezoStackParameters, logs: Array) -> PiezoStackParameters:
    """Return parameters whose freed values are multiplied by the exponentials of `logs`.

    Parameters
    ----------
    logs : ndarray, shape (len(FREED),)
        Logarithms of the factors.
    """
    factors = np.exp(logs)
    names = [(name, float(factor)) for some, factor in zip(FREED, factors, strict=True) for name in some]
    return replace(p, **{name: factor * getattr(p, name) for name, factor in names})


def _points() -> list[OperatingPoint]:
    no_load = [OperatingPoint(f, HIGH_VOLTAGE, bias, 0.0) for bias in (HIGH_BIAS, LOW_BIAS) for f in PEAK_FREQUENCIES]
    return [*no_load, OperatingPoint(PEAK, HIGH_VOLTAGE, HIGH_BIAS, LIFTED_MASS)]


def _quoted_values(actuators: Sequence[PiezoStackParameters]) -> Array:
    """Return largest flow, flow with 20 kg [L/min] and both best frequencies [Hz]: shape (actuators, 4)."""
    points = _points()
    rows = rows_of([(p, point) for p in actuators for point in points])
    flows = np.array([row["flow_m3_s"] for row in rows]).reshape(len(actuators), -1) / LITRE_PER_MINUTE
    count = len(PEAK_FREQUENCIES)
    high, low, lifting = flows[:, :count], flows[:, count : 2 * count], flows[:, -1]
    return np.column_stack([high.max(axis=1), lifting, _peak_frequencies(high), _peak_frequencies(low)])


def _misfits(actuators: Sequence[PiezoStackParameters]) -> Array:
    """Return the error of each actuator against Figures 11 and 13, over the error allowed, shape (actuators, 4)."""
    return (_quoted_values(actuators) - QUOTED_VALUES) / ALLOWED_ERRORS


def _peak_frequencies(curves: Array) -> Array:
    """Return the frequency at the top of a parabola through the flows, within the sweep [Hz]."""
    frequencies = np.array(PEAK_FREQUENCIES)
    square, slope, _ = np.polyfit(frequencies - PEAK, curves.T, 2)
    reach = frequencies[-1] - PEAK
    top = np.where(square < 0.0, -0.5 * slope / np.where(square < 0.0, square, -1.0), reach * np.sign(slope))
    return PEAK + np.clip(top, -reach, reach)


def calibrate(start: PiezoStackParameters, turns: int = TURNS) -> PiezoStackParameters:
    """Return the parameters that best match the values that the text quotes from Figures 11 and 13.

    The search uses Levenberg-Marquardt steps on the logarithms of the freed values.

    Parameters
    ----------
    start : PiezoStackParameters
        The starting point, from which the freed values deviate by about `START_SPREAD`.
    turns : int
        Maximum number of search steps.
    """
    size = len(FREED)
    logs, damping, misfit = np.zeros(size), 1.0, _misfits([start])[0]
    cost = float(misfit @ misfit)
    for _ in range(turns):
        if float(np.abs(misfit).max()) <= 1.0:
            break
        beside = _misfits([with_factors(start, logs + STEP * side) for side in np.eye(size)])
        slopes = (beside - misfit).T / STEP
        matrix = slopes.T @ slopes + np.eye(size) / START_SPREAD**2
        downhill = slopes.T @ misfit + logs / START_SPREAD**2
        dampings = damping * np.array([0.1, 1.0, 10.0])
        tried = [logs - np.linalg.solve(matrix + one * np.diag(np.diag(matrix)), downhill) for one in dampings]
        found = _misfits([with_factors(start, one) for one in tried])
        costs = np.sum(found**2, axis=1) + np.sum(np.array(tried) ** 2, axis=1) / START_SPREAD**2
        best = int(np.argmin(costs))
        if costs[best] < cost:
            logs, misfit, cost, damping = tried[best], found[best], float(costs[best]), dampings[best]
        else:
            damping *= 100.0
    return with_factors(start, logs)


@as_table
def figure_12_left_out(
    rig: PiezoStackParameters, seed: int, starts: int, turns: int = TURNS, track: Track = without_progress
) -> Rows:
    """Return the prediction of Figure 12 by parameters that were calibrated without it.

    Parameters
    ----------
    rig : PiezoStackParameters
        The parameters about which the starting points are drawn.
    starts : int
        Number of calibrations, each from its own starting point.
    turns : int
        Maximum number of steps in each.

    Returns
    -------
    pandas.DataFrame
        Columns calibration; flow_max_l_min, flow_20kg_l_min, best_high_hz and best_low_hz, used for the calibration;
        and ratio (flow at 100 V over that at 140 V, both at 275 Hz) and best_weak_hz at 100 V, not used for it.
    """
    rng = stream(seed, "figure 12 left out")
    beginnings = [with_factors(rig, APART * rng.standard_normal(len(FREED))) for _ in range(starts)]
    for number, begun in enumerate(track(beginnings, description="calibrating without Figure 12"), start=1):
        p = calibrate(begun, turns)
        strong = OperatingPoint(PEAK, HIGH_VOLTAGE, HIGH_BIAS, 0.0)
        weak = [OperatingPoint(f, LOW_VOLTAGE, HIGH_BIAS, 0.0) for f in FREQUENCIES]
        most, *curve = (row["flow_m3_s"] for row in rows_of([(p, one) for one in (strong, *weak)]))
        flows = pd.Series(curve, index=list(FREQUENCIES))
        names = ("flow_max_l_min", "flow_20kg_l_min", "best_high_hz", "best_low_hz")
        yield {
            "calibration": number,
            **dict(zip(names, _quoted_values([p])[0].tolist(), strict=True)),
            "ratio": float(flows.loc[PEAK]) / most,
            "best_weak_hz": float(str(flows.idxmax())),
        }
