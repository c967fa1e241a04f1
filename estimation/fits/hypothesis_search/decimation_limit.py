"""`decimation_limit(log, values, every)`: how far a log may be decimated without a change of costs.

A long model step has errors where make-up and relief valves fill a chamber within it, and at corners of the pumped
flow. On the paper's rig that is 2 % of the cost at steps of 4 ms. With small chambers of stiff oil it was up to a
hundred times the noise, at 1 ms, and searches ended in false minima that the steps created. See decision 312.
"""

from collections.abc import Mapping

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.coarse_search import coarse_log
from estimation.fits.hypothesis_search.decimation import cost_over_noise
from estimation.fits.hypothesis_search.wide_log import usual_values
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem, parameters_at_end

MOVED, MOVED_LEAST = 0.15, 0.3
"""Change of the cost by decimation that is allowed: share of the cost, and at least so much over that of noise
[dimensionless]; judged. In 20 strange training logs of the paper's rig the change is at most 0.1 of the cost."""


def decimation_limit(
    log: GreyBoxLog,
    values: Mapping[str, float],
    every: int,
    together: tuple[Hypothesis, ...] = (),
    delays: Mapping[str, float] | None = None,
) -> int:
    """Return how many samples may be merged into one, at most ``every``.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    values : Mapping[str, float]
        Where a search has ended [SI].
    every : int
        How many samples are merged into one if nothing speaks against it, see `decimation.decimation_for` [count].
    together : tuple of Hypothesis
        The hypotheses that are fitted there.
    delays : Mapping[str, float], optional
        Delay of each late channel there [s]; none by default.

    Returns
    -------
    int
        ``every``, or half of it and so on, down to one [count].
    """

    def left(samples: int) -> float:
        problem = hypothesis_problem(
            coarse_log(log, delays or {}, together, samples), together, *parameters_at_end(together)
        )
        return cost_over_noise(log, problem.at(problem.model.theta({**usual_values(log), **values})).cost)

    if every == 1:
        return 1
    whole = left(1)
    while every > 1 and abs(left(every) - whole) > max(MOVED * whole, MOVED_LEAST):
        every //= 2
    return every
