"""Inputs and outputs of one or more logs for free-run fits: scaled, with blocks that may be held back."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from estimation.arrays import Array, BoolArray, IntArray
from estimation.identification.search.experiments import SAMPLES_PER_PARAMETER
from estimation.identification.signals.period import common_period
from plant.errors import HydrostateError

FEWEST = 20
"""Least number of output samples for a fit."""

SHORTEST = 20
"""Least number of samples of a held-back block in every period; a shorter period has too little information."""

MOST_ORDER = 20
"""Highest order that may be requested: time grows with its square [count]."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Inputs and one output of one or more logs on one sample time.

    Parameters
    ----------
    inputs, output : tuple of str, str
        Names of the channels.
    sample_time : float
        Seconds between samples [s].
    u : tuple of ndarray, shape (n, m)
        Inputs of each log, without gaps.
    y : tuple of ndarray, shape (n,)
        Output of each log; NaN where missing.
    own_offsets : bool
        Whether linear models have an offset for each log.
    """

    inputs: tuple[str, ...]
    output: str
    sample_time: float
    u: tuple[Array, ...]
    y: tuple[Array, ...]
    own_offsets: bool = False

    @property
    def n_samples(self) -> int:
        """Number of valid outputs."""
        return sum(int(np.isfinite(y).sum()) for y in self.y)

    @property
    def longest(self) -> int:
        """Samples of the longest log."""
        return max(y.size for y in self.y)

    @cached_property
    def periods(self) -> tuple[int | None, ...]:
        """Period of each log's inputs in samples; None if they are not periodic."""
        return tuple(common_period(u) for u in self.u)

    @property
    def informative_samples(self) -> int:
        """Samples of the longest log with new information: one period, if its inputs are periodic."""
        return max(informative_lengths(self))

    @property
    def duration(self) -> float:
        """Length of the longest log [s]."""
        return self.longest * self.sample_time

    def without(self, masks: Sequence[BoolArray]) -> "Channels":
        """Return the same channels with outputs held back.

        Parameters
        ----------
        masks : sequence of ndarray of bool, shape (n,)
            Where outputs of each log become NaN.
        """
        return replace(self, y=tuple(np.where(mask, np.nan, y) for y, mask in zip(self.y, masks, strict=True)))


def channels_from(
    u: Sequence[Array], y: Sequence[Array], sample_time: float, inputs: Sequence[str], output: str
) -> Channels:
    """Return channels after checks.

    Parameters
    ----------
    u : sequence of ndarray, shape (n, m)
        Inputs of each log.
    y : sequence of ndarray, shape (n,)
        Output of each log; NaN where missing.
    sample_time : float
        Seconds between samples [s].
    inputs, output : sequence of str, str
        Their names.

    Raises
    ------
    HydrostateError
        If shapes disagree, an input is not finite, or input or output does not vary.
    """
    kept = Channels(
        tuple(inputs),
        output,
        float(sample_time),
        tuple(np.asarray(one, dtype=np.float64).reshape(len(one), -1) for one in u),
        tuple(np.asarray(one, dtype=np.float64) for one in y),
    )
    if not (np.isfinite(sample_time) and sample_time > 0.0):
        raise HydrostateError(f"sample_time must be positive and finite, got {sample_time!r}")
    if not kept.u or len(kept.u) != len(kept.y):
        raise HydrostateError(f"as many inputs as outputs are needed, got {len(kept.u)} and {len(kept.y)}")
    for one_u, one_y in zip(kept.u, kept.y, strict=True):
        if one_u.shape != (one_y.size, len(kept.inputs)):
            raise HydrostateError(
                f"inputs {', '.join(inputs)} of shape {(one_y.size, len(kept.inputs))} are needed beside "
                f"{output!r}, got {one_u.shape}"
            )
        if not np.isfinite(one_u).all():
            raise HydrostateError(f"inputs {', '.join(inputs)} must be finite at every sample")
        if np.isinf(one_y).any():
            raise HydrostateError(f"output {output!r} must be finite or missing (NaN), got infinite values")
    if kept.n_samples < FEWEST:
        raise HydrostateError(f"output {output!r} needs {FEWEST} samples or more, got {kept.n_samples}")
    _require_variation(np.concatenate(kept.y), output)
    for index, name in enumerate(inputs):
        _require_variation(np.concatenate([one[:, index] for one in kept.u]), name)
    return kept


def _require_variation(values: Array, name: str) -> None:
    if np.nanmin(values) == np.nanmax(values):
        raise HydrostateError(f"channel {name!r} must vary, got {np.nanmin(values):g} throughout")


def require_size(order: int | None, delay: int | None, n_numerator: int | None) -> None:
    """Refuse a size that no model has, or whose search would take minutes.

    Parameters
    ----------
    order, delay, n_numerator : int, optional
        For every input.

    Raises
    ------
    HydrostateError
        If an entry is too small or too large.
    """
    for name, given, least, most in (
        ("order", order, 1, MOST_ORDER),
        ("n_numerator", n_numerator, 1, None),
        ("delay", delay, 0, None),
    ):
        if given is not None and not (least <= given and (most is None or given <= most)):
            wanted = f"{least} or more" if most is None else f"from {least} to {most}"
            raise HydrostateError(f"{name} must be {wanted}, got {given}")


def require_room(data: Channels, order: int | None, delay: int | None, n_numerator: int | None) -> None:
    """Refuse a model size for which the logs are too short.

    Parameters
    ----------
    order, delay, n_numerator : int, optional
        For every input.

    Raises
    ------
    HydrostateError
        If there are fewer than five samples a value or two a sample of dead time.
    """
    poles = order or 1
    values = poles + len(data.inputs) * (n_numerator or poles + 1)
    wanted = SAMPLES_PER_PARAMETER * values + 2 * (delay or 0)
    if data.longest < wanted:
        raise HydrostateError(
            f"a model of this size and dead time needs a log of at least {wanted} samples of {data.output!r}, the "
            f"longest has {data.longest}"
        )


@dataclass(frozen=True, eq=False)
class Scaling:
    """Means and standard deviations by which channels are brought to order one.

    Parameters
    ----------
    u_mean, u_std : ndarray, shape (m,)
        Of the inputs.
    y_mean, y_std : float
        Of the output [output unit].
    """

    u_mean: Array
    u_std: Array
    y_mean: float
    y_std: float


def scaled(data: Channels) -> tuple[Channels, Scaling]:
    """Return channels with zero mean and unit deviation, and the scaling."""
    together, outputs = np.concatenate(data.u), np.concatenate(data.y)
    by = Scaling(together.mean(axis=0), together.std(axis=0), float(np.nanmean(outputs)), float(np.nanstd(outputs)))
    return in_scale(data, by), by


def in_scale(data: Channels, by: Scaling) -> Channels:
    """Return channels in a given scaling."""
    return replace(
        data,
        u=tuple((one - by.u_mean) / by.u_std for one in data.u),
        y=tuple((one - by.y_mean) / by.y_std for one in data.y),
    )


def informative_lengths(data: Channels, shortest: int = SHORTEST) -> list[int]:
    """Return the period of each log's inputs, or its length if they are not periodic.

    Parameters
    ----------
    shortest : int
        Shorter periods do not count: they have too little information [samples].
    """
    return [
        period if period is not None and period >= shortest else len(u)
        for period, u in zip(data.periods, data.u, strict=True)
    ]


def blocks(data: Channels, count: int) -> list[list[BoolArray]]:
    """Return masks that hold back one block of every log after the other, except the first.

    The first block is never held back: it determines the initial state. If the inputs are periodic, a block is the same
    part of every period: otherwise the other periods would contain what is held back.

    Parameters
    ----------
    count : int
        Number of blocks that are held back.

    Returns
    -------
    list of list of ndarray of bool, shape (n,)
        One mask per log, for each block.
    """
    places: list[IntArray] = []
    for told, y in zip(informative_lengths(data, SHORTEST * (count + 1)), data.y, strict=True):
        period = max(told, 1)
        places.append(np.arange(y.size) % period * (count + 1) // period)
    return [[place == 1 + index for place in places] for index in range(count)]


def halves(data: Channels) -> tuple[Channels, Channels]:
    """Return the first and the second half of every log; for periodic inputs, of the last period.

    Returns
    -------
    tuple of Channels
        With the same number of logs each.
    """
    begins = [y.size - told for told, y in zip(informative_lengths(data), data.y, strict=True)]
    cuts = [(begin + y.size) // 2 for begin, y in zip(begins, data.y, strict=True)]

    def part(*, late: bool) -> Channels:
        kept = [slice(cut, None) if late else slice(begin, cut) for begin, cut in zip(begins, cuts, strict=True)]
        return replace(
            data,
            u=tuple(u[one] for u, one in zip(data.u, kept, strict=True)),
            y=tuple(y[one] for y, one in zip(data.y, kept, strict=True)),
        )

    return part(late=False), part(late=True)


def liveliest_sections(data: Channels, most: int) -> Channels:
    """Return the part of each log in which the first input varies most, with a limited number of samples.

    Parameters
    ----------
    data : Channels
        Scaled.
    """
    total = sum(y.size for y in data.y)
    if total <= most:
        return data
    parts: list[slice] = []
    for u in data.u:
        length = max(u.shape[0] * most // total, 1)
        begins = np.linspace(0, u.shape[0] - length, 11).astype(int)
        liveliest = max(begins, key=lambda k: float(np.var(u[k : k + length], axis=0).sum()))
        parts.append(slice(int(liveliest), int(liveliest) + length))
    return replace(
        data,
        u=tuple(np.ascontiguousarray(u[part]) for u, part in zip(data.u, parts, strict=True)),
        y=tuple(y[part] for y, part in zip(data.y, parts, strict=True)),
    )
