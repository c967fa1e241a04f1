"""Logs of one plant with different offsets: sensors that were zeroed in between.

With one offset, a fit follows the steps between logs with slow poles, whose initial states replace an offset, and its
gain is arbitrary. So linear models are also compared with an offset for each log, if these explain more than chance.
They are used if they leave clearly less on held-back blocks, or as little with poles that settle within a block. Each
log is brought to the mean offset before, and keeps an offset among its values for its covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.choose_linear import Candidate, criteria
from estimation.identification.free_run.data import Channels, scaled
from estimation.identification.free_run.dead_times import ORDER, estimate_delays
from estimation.identification.free_run.held_back import is_better_beyond_chance
from estimation.identification.free_run.linear_comparison import LinearComparison
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

CLEAR_RATIO, NEAR_RATIO = 0.85, 1.02
"""Largest ratio of held-back errors with and without offsets of logs, as for a nonlinear structure; and the same if the
model with one offset has a pole slower than a block, as for a simpler model."""


@dataclass(frozen=True, eq=False)
class LevelledLogs:
    """Logs brought to one offset.

    Parameters
    ----------
    data : Channels
        The logs, each less its offset relative to the mean.
    above : ndarray, shape (logs,)
        These offsets [output unit].
    """

    data: Channels
    above: Array

    @property
    def note(self) -> Note:
        """That offsets differ, and by how much."""
        shown = ", ".join(f"{one:+.4g}" for one in self.above)
        return IdentificationCode.OFFSETS_DIFFER.note(output=self.data.output, above=shown)


def logs_at_one_offset(
    data: Channels, orders: Sequence[int], delays: tuple[int, ...] | None = None
) -> LevelledLogs | None:
    """Return logs brought to one offset; None for a single log, or if their offsets differ by chance.

    Parameters
    ----------
    data : Channels
        In units of the channels.
    orders : sequence of int
        Orders of the models that are compared; the first few determine offsets.
    delays : tuple of int, optional
        Dead time of each input; estimated by default [samples].
    """
    if len(data.y) < 2 or not all(np.isfinite(y).any() for y in data.y):
        return None
    means = np.array([np.nanmean(y) for y in data.y])
    centred = replace(data, y=tuple(y - mean for y, mean in zip(data.y, means, strict=True)), own_offsets=True)
    if all(np.nanmin(y) == np.nanmax(y) for y in centred.y):
        return None
    apart, by = scaled(centred)
    together = replace(apart, y=tuple(y / by.y_std for y in data.y), own_offsets=False)
    late = estimate_delays(apart) if delays is None else delays
    best, levels = np.inf, None
    for order in orders[:ORDER]:
        form = Form(order, (order + 1,) * len(late), late)
        fit, more, n = fit_linear(form, apart, least_gain=COARSE), len(means) - 1, data.n_samples
        bic = criteria(fit.cost, fit.theta.size, n)[0]
        # compared at the same poles, since others may follow the steps from log to log
        if bic < criteria(Problem(form, together).profiled(fit.f)[0], fit.theta.size - more, n)[0] and bic < best:
            best, levels = bic, means + by.y_std * np.concatenate([[0.0], fit.theta[-more:]])
    if levels is None:
        return None
    above = levels - np.average(levels, weights=[np.isfinite(y).sum() for y in data.y])
    flat = replace(data, y=tuple(y - one for y, one in zip(data.y, above, strict=True)), own_offsets=True)
    return LevelledLogs(flat, above)


def are_offsets_believed(own: LinearComparison, one: LinearComparison) -> bool:
    """Return whether offsets of logs are believed.

    Parameters
    ----------
    own, one : LinearComparison
        Models with an offset for each log, and with one.
    """
    lasting = [has_slow_pole(each.best, each) for each in (own, one)]
    spread = own.task.by.y_std / one.task.by.y_std
    errors, least = [spread * error for error in own.best.block_errors], spread * own.best.held_back
    if lasting == [False, True]:
        return least <= NEAR_RATIO * one.best.held_back
    return least < CLEAR_RATIO * one.best.held_back and is_better_beyond_chance(errors, one.best.block_errors)


def has_slow_pole(best: Candidate, of: LinearComparison) -> bool:
    """Return whether a pole is slower than a held-back block."""
    return bool(best.doubt) or best.fit.integrates or best.outlasts_block(of.task.part)
