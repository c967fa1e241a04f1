"""Flow lost between pump and piston, piece by piece, and when it most likely changes: a first guess for searches.

What the pump delivers and the piston does not sweep leaks, or compresses the oil as pressure rises. That loss is
regressed on a leakage with a step, or on oil with bubbles from some time on, for many times at once.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.log_checks.channel_names import POSITION, SPEED
from estimation.models.wide_flow import WIDE_FLOW_FORM

PIECES = 200
"""Pieces of the log in which flows and pressure are averaged [count]: times are then known to half a percent of the
log."""

EDGE = 0.05
"""Share of the log at each end in which no change is searched for [fraction]."""


TINY = float(np.finfo(float).tiny)
"""What replaces zero in a divisor [in the divisor's unit]."""


class LostFlow(NamedTuple):
    """Flow that the pump delivers and the piston does not sweep, with its possible regressors.

    Parameters
    ----------
    lost : ndarray, shape (pieces,)
        Mean lost flow [m^3/s].
    pressure, sign : ndarray, shape (pieces,)
        Mean differential pressure [Pa] and mean sign of the speed [dimensionless].
    time : ndarray, shape (pieces,)
        Length of a piece [s].
    ends : ndarray, shape (pieces + 1,)
        Differential pressure at the ends of pieces [Pa].
    positions : ndarray, shape (pieces + 1,)
        Position there [m].
    rig : Mapping[str, float]
        The rig's parameters [SI].
    """

    lost: Array
    pressure: Array
    sign: Array
    time: Array
    ends: Array
    positions: Array
    rig: Mapping[str, float]


def lost_flow(log: GreyBoxLog) -> LostFlow:
    """Return the lost flow of a log; missing where pressure is missing.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    LostFlow
        In at most `PIECES` pieces.
    """
    named = {name: log.drives[:, at] for at, name in enumerate(WIDE_FLOW_FORM.drives)}
    rig = usual_values(log)
    speed, position, pressure = named[SPEED], named[POSITION], log.measured[:, 0]
    ends = np.unique(np.linspace(0, len(speed) - 1, PIECES + 1).astype(np.intp))
    count, time = np.diff(ends), log.sample_time * np.diff(ends)
    means = np.add.reduceat(np.stack([speed, pressure, np.sign(speed)])[:, : ends[-1]], ends[:-1], axis=1) / count
    lost = rig["pump_displacement"] * means[0] - rig["piston_area"] * np.diff(position[ends]) / time
    return LostFlow(lost, means[1], means[2], time, pressure[ends], position[ends], rig)


class Change(NamedTuple):
    """A change of the lost flow within a log.

    Parameters
    ----------
    at : float
        When [fraction of the log].
    share : float
        Share of the lost flow's unexplained variance that the change explains [fraction].
    before, after : float
        Leakage before and after it [m^3/(s Pa)].
    """

    at: float
    share: float
    before: float = 0.0
    after: float = 0.0


NO_CHANGE = Change(0.5, 0.0)


class _Split(NamedTuple):
    """The piece from which a further column is likeliest, and how much of the unexplained sum of squares it explains.

    With both coefficients, and the sum of squares without it, which is at least the smallest number.
    """

    left: float
    piece: int | None = None
    share: float = 0.0
    first: float = 0.0
    more: float = 0.0


def _time(split: _Split, begins: Array) -> float:
    """Return when a piece begins, counting pieces without missing values [fraction of the log]."""
    return NO_CHANGE.at if split.piece is None else float(begins[split.piece])


def likeliest_step(log: GreyBoxLog) -> Change:
    """Return the most likely step of leakage.

    The seal may be so tight before the step that noise makes its leakage negative: it is then zero.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    Change
        `NO_CHANGE` if pressure is missing or constant.
    """
    lost, always, _, begins = _regressors(log)
    pressure = always[:, 0]
    steps = _likeliest(lost, always, pressure, lambda before, more: (before > 0.0) & (before + more > 0.0))
    leaky = Change(_time(steps, begins), steps.share, steps.first, steps.first + steps.more)
    tight = _likeliest(lost, always[:, 1:], pressure, lambda _, more: more > 0.0)
    if not tight.share:
        return leaky
    share = 1.0 - (1.0 - tight.share) * tight.left / steps.left
    return leaky if leaky.share >= share else Change(_time(tight, begins), share, 0.0, tight.more)


def likeliest_entry(log: GreyBoxLog) -> Change:
    """Return the most likely time at which air enters the oil.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    Change
        `NO_CHANGE` if pressure is missing or constant, or the oil does not become softer.
    """
    lost, always, bubbles, begins = _regressors(log)
    entry = _likeliest(lost, always, bubbles, lambda _, more: more > 0.0)
    return Change(_time(entry, begins), entry.share)


def _likeliest(lost: Array, always: Array, then: Array, may_be: Callable[[Array, Array], BoolArray]) -> _Split:
    """Return the piece from which a loss most likely has a further column.

    Only pieces count for which ``may_be(first, more)`` holds, with the coefficients of the first permanent column and
    of the further one.
    """
    pieces = len(lost)
    if pieces < PIECES // 2:
        return _Split(TINY)
    splits = np.arange(round(EDGE * pieces), pieces - round(EDGE * pieces) + 1)
    sizes, size = _largest(always), _largest(then)
    (basis, upper), then = np.linalg.qr(always / sizes), then / size
    known = basis.T @ lost
    left = lost - basis @ known
    # sums over all pieces after each time: products of `then` with the residual, with the basis, and with itself
    columns = np.column_stack([left, basis, then]) * then[:, None]
    after = np.cumsum(columns[::-1], axis=0)[::-1][splits]
    across, along, power = after[:, 0], after[:, 1:-1], after[:, -1]
    own = power - np.sum(along * along, axis=1)
    told = own > EDGE * EDGE * power
    more = across / np.where(told, own, 1.0)
    before = (np.linalg.pinv(upper)[0] @ (known[:, None] - more * along.T)) / sizes[0]
    explained = np.where(told & may_be(before, more / size), across * more, 0.0)
    best = int(np.argmax(explained))
    unexplained = max(float(left @ left), TINY)
    share = float(explained[best]) / unexplained
    if not share > 0.0:
        return _Split(unexplained)
    return _Split(unexplained, int(splits[best]), share, float(before[best]), float(more[best] / size))


def _regressors(log: GreyBoxLog) -> tuple[Array, Array, Array, Array]:
    """Return the lost flow, its permanent regressors and those of bubbles, and when each piece begins.

    The permanent ones are pressure, the sign of speed and the rise of pressure. Bubbles shrink in proportion to the
    decrease of the inverse pressure of the loaded chamber.
    """
    flow = lost_flow(log)
    rig, at_ends = flow.rig, flow.ends
    middle = 0.5 * (flow.positions[1:] + flow.positions[:-1])
    volume = 1.0 + np.sign(flow.pressure) * rig["piston_area"] * middle / rig["chamber_volume"]
    bubbles = np.sign(at_ends) * np.abs(at_ends) / (rig["accumulator_pressure"] + np.abs(at_ends))
    rise, squeezed = volume * np.diff(at_ends) / flow.time, volume * np.diff(bubbles) / flow.time
    there = np.isfinite(flow.pressure) & np.isfinite(rise)
    always = np.column_stack([flow.pressure, flow.sign, rise])
    return flow.lost[there], always[there], squeezed[there], np.flatnonzero(there) / len(there)


def _largest(columns: Array) -> Array:
    return np.maximum(np.max(np.abs(columns), axis=0, initial=0.0), TINY)
