"""`compatible_hypotheses(log, tried, asked)`: hypotheses that may explain a log together with the best one.

All of them together hold each pair. So where even all of them together leave far more than noise, no pair of those that
slopes lead to explains the log.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.greybox.descent import descend
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import HYPOTHESES, Hypothesis
from estimation.fits.hypothesis_search.coarse_search import FINEST_DELAY, NEAR, coarsened
from estimation.fits.hypothesis_search.decimation import FEW, SHORT_STEP, cost_over_noise, decimation_for
from estimation.fits.hypothesis_search.decimation_limit import decimation_limit
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import REACHED, UNFINISHED
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.fits.hypothesis_search.wide_problem import flow_bounds, freed, freed_at_end, own_starts
from estimation.models.wide_flow import LINEAR

TOGETHER = 40
"""Evaluations of the model with all hypotheses at most [count]."""

SMALL = 1e-3
"""Share of the cost that a further step with all hypotheses must promise [fraction]."""

MUCH = 0.2
"""Share of what the best set leaves beside noise that all hypotheses together must leave at least, to be out of reach
[fraction]; judged. Where they take up more, they may have ended in a valley on the way."""


def compatible_hypotheses(log: GreyBoxLog, tried: Trial, asked: Sequence[Hypothesis]) -> Sequence[Hypothesis]:
    """Return the hypotheses that may explain a log together with what was tried.

    Those of which slopes say nothing always may, and those whose search begins far from their absence. A delay is more
    than the lag that is fitted together with the rest, so a late channel may where its lag is long. All may where much
    is left, for a search with all hypotheses ends in a wrong valley then.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    tried : Trial
        The best set so far, from which all are led on.
    asked : sequence of Hypothesis
        What else is asked.

    Returns
    -------
    sequence of Hypothesis
        Some of them, or all; always all of a short log, whose search takes a second or two.
    """
    if not asked or len(log.drives) < FEW:
        return asked
    left = cost_over_noise(log, tried.cost)
    if not REACHED < left < UNFINISHED:
        return asked
    lowest, values = _all_together(log, tried, left)
    if lowest - 1.0 < max(REACHED - 1.0, MUCH * (left - 1.0)):
        return asked
    return [one for one in asked if _unseen(one) or (len(one.delays) > 1 and values[one.free[0]] > FINEST_DELAY)]


def _unseen(one: Hypothesis) -> bool:
    """Return whether slopes cannot predict the gain of a hypothesis, or its search starts orders of magnitude away."""
    return one.far or bool(one.beside) or any(name not in LINEAR for start in one.starts for name in start)


def _all_together(log: GreyBoxLog, tried: Trial, left: float) -> tuple[float, dict[str, float]]:
    """Return the least that all hypotheses together may leave over the noise, and their values [SI].

    A search that finds no step down says nothing: they may leave nothing then. Bubbles, whose slopes are slight where
    there are none, were not asked beside a lag of the pressure, and explain that log with it.
    """
    taken = {one.name for one in tried.together}
    more = [replace(one, instead=()) for one in HYPOTHESES if one.name not in taken]
    asked = max(decimation_for(log, left), round(SHORT_STEP / log.sample_time))
    every = decimation_limit(log, tried.coarse or tried.values, asked, tried.together, tried.delays)
    row = coarsened(log, tried.delays, tried.together, every)
    if not np.isfinite(row.measured).any():  # a pressure that comes slower, between the samples that are left
        row = coarsened(log, tried.delays, tried.together)
    together = (*tried.together, *more)
    problem = freed(row, together, *freed_at_end(together))
    stepped = {name: value for one in more if one.from_change for name, value in own_starts(log, one)[0].items()}
    stepped = {name: value for name, value in stepped.items() if name in ("step_at", "step_width")}
    start = problem.model.theta({**usual_values(log), **stepped, **(tried.coarse or tried.values)})
    bounds = flow_bounds(problem.model, [start], log)
    point = descend(problem.at, start, TOGETHER, bounds, radius=NEAR, least_share=SMALL)
    unmoved = np.array_equal(point.theta, np.clip(start, *bounds))
    return 0.0 if unmoved else cost_over_noise(log, point.cost), dict(problem.model.values(point.theta))
