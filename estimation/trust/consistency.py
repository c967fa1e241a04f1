"""Can an estimate be believed? NEES and NIS with their chi-square bounds, and the gate that every estimate passes.

Source of the tests: Bar-Shalom, Li and Kirubarajan (2001), section 5.4. The gate asks three questions: are innovations
as large as predicted (NIS), are they white where the drive has power (`estimation.trust.whiteness`), and does the
estimate move from stretch to stretch by no more than its own shrinking interval allows.
"""

import numpy as np

from estimation.arrays import Array
from estimation.filters.run import Estimate
from estimation.finding import Gate
from estimation.notes import EstimateCode
from estimation.trust.whiteness import SETTLING, Whiteness, whiteness
from plant.log.record import Record
from plant.notes import Note

LARGEST_NIS = 2.0
"""Mean NIS of a channel above which the filter is called overconfident; 1 is expected [dimensionless]."""

MISMATCH_NIS = 100.0
"""Mean NIS of a channel above which the model does not describe the log at all [dimensionless]."""

LARGEST_DRIFT = 0.03
"""Relative change of the estimate over the last fifths of a run above which it is called unsettled [fraction]."""

LARGEST_WANDER = 9.0
"""Mean square of the estimate's moves, relative to what its interval allows, above which they are too large: the
interval is three times too narrow [dimensionless]."""

STRETCHES = 20
"""Number of stretches of a log between which an estimate's moves are judged."""


def nees(errors: Array, covariances: Array) -> Array:
    """Return the normalised estimation error squared of each run.

    Parameters
    ----------
    errors : ndarray, shape (runs, n)
        Estimate minus truth, in the belief's units.
    covariances : ndarray, shape (runs, n, n)
        Covariances of the belief.

    Returns
    -------
    ndarray, shape (runs,)
        Chi-square with n degrees of freedom if the filter is consistent.

    Examples
    --------
    >>> nees(np.array([[2.0, 0.0]]), np.array([[[4.0, 0.0], [0.0, 1.0]]])).tolist()
    [1.0]
    """
    return np.einsum("ri,ri->r", errors, np.linalg.solve(covariances, errors[..., None])[..., 0])


def mean_chi_square_bounds(degrees: int, count: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval in which the mean of several chi-square statistics falls.

    Parameters
    ----------
    degrees : int
        Degrees of freedom of one statistic: states for NEES, channels for NIS.
    confidence : float
        Probability of the interval [probability].

    Returns
    -------
    tuple of float
        Lower and upper bound.

    Examples
    --------
    >>> low, high = mean_chi_square_bounds(2, 50)
    >>> round(low, 2), round(high, 2)
    (1.48, 2.59)
    """
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - confidence)
    # chi-square quantiles
    low, high = (2.0 * float(gammaincinv(0.5 * degrees * count, p)) / count for p in (tail, 1.0 - tail))
    return low, high


def consistency_gate(estimate: Estimate, state: str, record: Record | None = None) -> Gate:
    """Judge whether an estimate of a state can be believed.

    Parameters
    ----------
    estimate : Estimate
        The filtered log; if its innovations were kept, their whiteness is tested too.
    state : str
        The state in question, constant in time.
    record : Record, optional
        The log that was filtered; without it innovations are judged only by their size.
    """
    channels = () if record is None else whiteness(estimate, record)
    moves = wander(estimate, state)
    reasons = [_overconfidence_note(channel, nis) for channel, nis in estimate.nis.items() if nis > LARGEST_NIS]
    reasons += [_structure_note(channel) for channel in channels if channel.exceeded]
    if moves > LARGEST_WANDER:
        reasons.append(EstimateCode.ESTIMATE_WANDERS.note(state=state, ratio=moves**0.5))
    reasons += _unsettled_notes(estimate, state)
    reasons += _at_bound_notes(estimate, state)
    structure = sum(channel.excess for channel in channels if channel.exceeded)
    return Gate(not reasons, tuple(reasons), max(1.0, moves + structure) ** 0.5, channels)


def wander(estimate: Estimate, state: str) -> float:
    """Return the squared moves of a constant state between stretches of a log, relative to what its variance allows.

    The estimate of a constant is a martingale under its own model: each stretch moves it with the variance by which the
    stretch reduces its own. Only stretches after settling count.

    Returns
    -------
    float
        Sum of the squared moves over the reduction of the variance [dimensionless]: 1 on average if the filter is
        consistent, 0 if the variance was not reduced.
    """
    mean, std = estimate.track(state)
    marks = np.linspace(SETTLING * (len(mean) - 1), len(mean) - 1, STRETCHES + 1).astype(int)
    reduced = float(std[marks[0]] ** 2 - std[marks[-1]] ** 2)
    if not reduced > 1e-9 * float(std[marks[0]]) ** 2:
        return 0.0
    return float(np.sum(np.diff(mean[marks]) ** 2)) / reduced


def describes_log(estimate: Estimate, state: str) -> bool:
    """Return whether the model describes the log at least roughly.

    Returns
    -------
    bool
        False if a channel's residuals are ten times larger than expected, or the state is at a physical bound.
    """
    return not _at_bound_notes(estimate, state) and all(nis < MISMATCH_NIS for nis in estimate.nis.values())


def _overconfidence_note(channel: str, nis: float) -> Note:
    return EstimateCode.INNOVATIONS_LARGE.note(channel=channel, ratio=nis**0.5, nis=nis)


def _structure_note(found: Whiteness) -> Note:
    code = EstimateCode.INNOVATIONS_FOLLOW_DRIVE if found.driven else EstimateCode.INNOVATIONS_BESIDE_DRIVE
    return code.note(
        channel=found.channel,
        excess=found.excess,
        frequency_hz=found.frequency,
        least_hz=max(found.frequency - found.resolution, 0.0),
        most_hz=found.frequency + found.resolution,
        narrow=found.excess**0.5,
    )


def _unsettled_notes(estimate: Estimate, state: str) -> list[Note]:
    mean, std = estimate.track(state)
    fifth = max(1, len(mean) // 5)
    last, before = float(np.mean(mean[-fifth:])), float(np.mean(mean[-2 * fifth : -fifth]))
    allowed = 3.0 * float(std[-1]) + LARGEST_DRIFT * abs(last)
    if abs(last - before) <= allowed:
        return []
    unit = estimate.model.states[estimate.model.index(state)].unit
    return [EstimateCode.NOT_SETTLED.note(state=state, moved=last - before, unit=unit)]


def _at_bound_notes(estimate: Estimate, state: str) -> list[Note]:
    value, _ = estimate.settled(state)
    variable = estimate.model.states[estimate.model.index(state)]
    inside = variable.lower + variable.scale * 1e-3 < value < variable.upper * 0.999
    return [] if inside else [EstimateCode.AT_PHYSICAL_BOUND.note(state=state, value=value, unit=variable.unit)]
