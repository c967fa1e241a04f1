"""Inputs and all outputs of one or more logs together, in their scale."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_problem import undetermined_outputs
from plant.errors import HydrostateError


@dataclass(frozen=True, eq=False)
class Joint:
    """Inputs and outputs of one or more logs on one sample time.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].
    u : tuple of ndarray, shape (n, m)
        Inputs of each log, no gaps.
    y : tuple of ndarray, shape (n, p)
        Outputs of each log; NaN where missing.
    begins : tuple of int
        From which of its samples on each log is run; from its first unless told [samples].
    """

    sample_time: float
    u: tuple[Array, ...]
    y: tuple[Array, ...]
    begins: tuple[int, ...] = ()

    @property
    def slices(self) -> list[slice]:
        """Where each log is run."""
        ends = np.cumsum([0, *(len(one) for one in self.u)])
        begins = self.begins or (0,) * len(self.u)
        return [slice(int(a) + begin, int(b)) for (a, b), begin in zip(pairwise(ends), begins, strict=True)]

    @property
    def n_samples(self) -> int:
        """Samples of all logs."""
        return sum(len(one) for one in self.u)

    def without(self, masks: Sequence[BoolArray]) -> "Joint":
        """Return the same with samples of all outputs held back.

        Parameters
        ----------
        masks : sequence of ndarray of bool, shape (n,)
            Where, in each log.
        """
        return replace(self, y=tuple(np.where(mask[:, None], np.nan, y) for y, mask in zip(self.y, masks, strict=True)))

    def delayed(self, delays: Sequence[int]) -> "Joint":
        """Return the same with inputs that arrive some samples later; before the log they had their first values.

        Outputs that respond only to inputs from before the log, because of a long dead time, are held back, and the run
        starts after them: an initial state at the first sample could not be fitted to parts that have decayed by then.

        Parameters
        ----------
        delays : sequence of int
            Of each input [samples].
        """
        late = replace(self, u=tuple(delayed_inputs(u, delays) for u in self.u))
        begins = tuple(undetermined_outputs(max(delays), len(u)) for u in self.u)
        if not any(begins):
            return late
        held = [np.arange(len(u)) < begin for u, begin in zip(self.u, begins, strict=True)]
        return replace(late, begins=begins).without(held)


def delayed_inputs(u: Array, delays: Sequence[int]) -> Array:
    """Return inputs some samples later, their first values in front of them.

    Parameters
    ----------
    u : ndarray, shape (n, m)
        Inputs.
    delays : sequence of int
        Of each input [samples].

    Returns
    -------
    ndarray, shape (n, m)
        Inputs.
    """
    rows = np.arange(len(u))[:, None] - np.asarray(delays)[None, :]
    return np.take_along_axis(u, np.maximum(rows, 0), axis=0)


def joined_outputs(data: Sequence[Channels]) -> Joint:
    """Return the outputs of the same logs together.

    Parameters
    ----------
    data : sequence of Channels
        One an output, inputs alike.

    Raises
    ------
    HydrostateError
        If the inputs differ.
    """
    first = data[0]
    for one in data[1:]:
        same = len(one.u) == len(first.u) and all(np.array_equal(a, b) for a, b in zip(one.u, first.u, strict=True))
        if one.inputs != first.inputs or not same:
            raise HydrostateError(
                f"outputs of one state space must have the same inputs, {first.output!r} and {one.output!r} have not"
            )
    together = tuple(np.column_stack(parts) for parts in zip(*(one.y for one in data), strict=True))
    return Joint(first.sample_time, first.u, together)
