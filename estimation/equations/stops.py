"""Channels that stay at an end of their range: end stops, saturation, clipped sensors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.stretches import in_long_stretches

SHORTEST_STAY = 3
"""Consecutive samples from which a channel counts as staying."""

LEAST_SHARE = 0.01
"""Share of the samples above which staying counts [fraction]."""

END_DEVIATIONS = 3.0
"""Distance from the end that counts as at the end, in standard deviations of the noise."""

CROWDING_RATIO = 5.0
"""Samples at the end over those the same distance before it [dimensionless]; a sine has 2.4."""

LARGEST_END_WIDTH = 0.1
"""Width of the end region over the channel's range, above which noise hides the end [fraction]."""

TWICE, LONG = 2, 0.1
"""Number of visits to the end, or else share of the samples [fraction], above which it counts."""

FEWEST_LEVELS = 20
"""A channel with fewer distinct values is one of levels, and has no ends."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A channel that stays at an end of its range.

    Parameters
    ----------
    end : str
        ``"least"`` or ``"largest"``.
    value : float
        Value at which it stays [its unit].
    share : float
        Share of the samples [fraction].
    where : sequence of ndarray of bool, shape (n,)
        Which samples these are, one array for each log.
    """

    end: str
    value: float
    share: float
    where: Sequence[BoolArray]


def standing_ends(channels: Sequence[Array], noise: float) -> Iterator[Standing]:
    """Yield the ends of its range at which a channel stays.

    A channel at a stop stays there for several samples, repeatedly or for long, and much more often than a smooth
    signal lingers at its turning points. A channel with few levels, such as a square wave, only jumps between them and
    is left out.

    Parameters
    ----------
    channels : sequence of ndarray, shape (n,)
        The channel in each log [its unit]; NaN is missing.
    noise : float
        Standard deviation of its noise [its unit].

    Examples
    --------
    >>> wave = np.clip(np.sin(np.arange(2000) / 50.0), -1.0, 0.8)
    >>> [(one.end, float(one.value)) for one in standing_ends([wave], 0.0)]
    [('largest', 0.8)]
    """
    every = np.concatenate(channels)
    seen = every[np.isfinite(every)]
    if len(np.unique(seen)) < FEWEST_LEVELS:
        return
    reach = END_DEVIATIONS * noise + 1e-9 * float(np.ptp(seen))
    if reach > LARGEST_END_WIDTH * float(np.ptp(seen)):
        return
    for end, sign in (("least", -1.0), ("largest", 1.0)):
        extreme = float((sign * seen).max())
        level = sign * (extreme - reach)  # noise lifts the extreme sample above the level at which the channel stays
        near = [np.abs(one - level) <= 1.001 * reach for one in channels]
        where = [in_long_stretches(one, SHORTEST_STAY) for one in near]
        share = float(np.mean(np.concatenate(where)))
        visits = sum(int(np.count_nonzero(np.diff(one.astype(np.int8)) == 1)) for one in where)
        if share < LEAST_SHARE or not _is_standing(seen, level, sign, reach, visits, share):
            continue
        flat = [one[held] for one, held in zip(channels, where, strict=True)]
        yield Standing(end, float(np.median(np.concatenate(flat))), share, where)


def _is_standing(seen: Array, level: float, sign: float, reach: float, visits: int, share: float) -> bool:
    """Return whether a channel is at its end much more often than just before it, and came there twice or for long."""
    before = np.count_nonzero(np.abs(seen - (level - 2.0 * sign * reach)) < reach)
    there = np.count_nonzero(np.abs(seen - level) <= 1.001 * reach)
    return bool(there > CROWDING_RATIO * before and (visits >= TWICE or share > LONG))
