"""Filters side by side: cases wait until the lanes of a kernel are full, and the results are written to their rows."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from estimation.engine.contract import FilterProblem, Trace
from estimation.engine.kernels import LANES
from estimation.filters.batch import FEWEST_IN_LANES, filter_batch
from estimation.models.eha_forms import BULK_MODULUS
from experiments.batch.rows import NIS, Rows, error_percent

SETTLED_SHARE = 0.2
"""Share of a run that counts as its end [fraction], as in `estimation.filters.run.Estimate.settled`."""


class WaitingFilter(NamedTuple):
    """A filter to be run.

    Parameters
    ----------
    truth : float or None
        The true bulk modulus, if known [Pa].
    """

    place: int
    problem: FilterProblem
    truth: float | None


class Lanes:
    """Filters that wait for others of the same kind, until the lanes of a kernel are full."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        self._waiting: dict[tuple[object, ...], list[WaitingFilter]] = {}

    def add(self, one: WaitingFilter) -> None:
        """Add a filter to those that wait; run them when they fill the lanes of a kernel."""
        problem = one.problem
        alike = (id(problem.model), problem.channels, problem.sample_time, problem.measured.shape)
        waiting = self._waiting.setdefault(alike, [])
        waiting.append(one)
        if len(waiting) == LANES:
            self._run(self._waiting.pop(alike))

    def finish(self) -> None:
        """Run all waiting filters, even if their lanes are not full."""
        for waiting in self._waiting.values():
            self._run(waiting)
        self._waiting.clear()

    def _run(self, waiting: list[WaitingFilter]) -> None:
        problems = [one.problem for one in waiting]
        padded = problems + problems[-1:] * max(0, FEWEST_IN_LANES - len(problems))
        try:
            write_filtered(self._rows, waiting, list(filter_batch(padded))[: len(waiting)])
        except Exception as error:  # an error in one block must not lose the results of the others
            self._rows.fail([one.place for one in waiting], error)


def write_filtered(rows: Rows, ran: Sequence[WaitingFilter], traces: Sequence[Trace]) -> None:
    """Write the results of filters that share one model and length.

    Parameters
    ----------
    traces : sequence of Trace
        The result of each filter.
    """
    problem = ran[0].problem
    model, state = problem.model, problem.model.index(BULK_MODULUS)
    first = int(np.floor(len(traces[0].track) * (1.0 - SETTLED_SHARE)))
    with np.errstate(all="ignore"):  # the row of a diverged filter says so
        ends, _ = model.to_si(np.array([trace.track[first:] for trace in traces]))
        values = ends[..., state].mean(axis=1)
        _, slopes = model.to_si(np.array([trace.mean for trace in traces]))
        stds = np.sqrt([trace.covariance[state, state] for trace in traces]) * slopes[:, state]
        nis = np.array([trace.nis for trace in traces]) / np.array([trace.count for trace in traces])
        # NaN if an innovation's variance became negative, minus infinity if it overflowed
        finite = np.isfinite(values + stds + [trace.log_likelihood for trace in traces])
    columns = {
        "outcome": ["ok"] * len(ran),
        "bulk_modulus_pa": values.tolist(),
        "bulk_modulus_std_pa": stds.tolist(),
        "error_percent": [error_percent(value, one.truth) for value, one in zip(values.tolist(), ran, strict=True)],
        **{NIS[channel]: ratios.tolist() for channel, ratios in zip(problem.channels, nis.T, strict=True)},
        "log_likelihood": [trace.log_likelihood for trace in traces],
    }
    places = [one.place for one in ran]
    rows.put(places, columns)
    for lane in np.flatnonzero(~finite).tolist():
        said = {"outcome": ["diverged"], "reason": ["the estimate stopped being finite"]}
        rows.put(places[lane : lane + 1], {**{name: [None] for name in columns}, **said})
