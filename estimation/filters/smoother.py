"""The Rauch-Tung-Striebel smoother over the extended Kalman filter: the belief at every sample given the whole log.

Source: Rauch, Tung and Striebel (1965), in the form that Bierman (1973) calls modified Bryson-Frazier: same means and
covariances, no matrix inverted. An adjoint ``u`` and its information ``U`` run backwards; at a channel with the row H,
the gain K, the innovation e and its variance S, and across a step of the model with the Jacobian F::

u <- (I - K H)' u + H' e / S U <- (I - K H)' U (I - K H) + H' H / S u <- F' u U <- F' U F x_smoothed = x + P u
P_smoothed = P - P U P

U is a sum of squares, and so the smoothed covariance is never above the filter's. Derivatives are those that the filter
used; sub-steps are smoothed one by one. If the filter's update was held at a physical bound, u gains ``P^-1 (held -
found)``, as in the usual form, which starts from the filter's result.

Memory: the filter runs over the log once and keeps its belief at the beginning of each chunk; a chunk is as long as the
square root of the log. Then each chunk, the last one first, is run again and smoothed. A million samples need a few
hundred kilobytes besides the track.
"""

from collections.abc import Iterator
from math import isqrt

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Trace
from estimation.engine.kalman import belief_names
from estimation.engine.rule import chosen_settings
from estimation.engine.runner import constant_row
from estimation.filters.ekf import ekf
from estimation.filters.smoother_loops import Beliefs, Log, compile_smoother


def smoother(problem: FilterProblem) -> Trace:
    """Run the extended Kalman filter forwards and the smoother backwards.

    Returns
    -------
    Trace
        The filter's final belief, innovations and likelihood, with the track and its variance smoothed.

    Raises
    ------
    HydrostateError
        If the user set something.
    """
    chosen_settings(problem, "smoother")
    trace, n = ekf(problem), problem.model.width
    diagonal = [belief_names(n).index(f"P{i}_{i}") for i in range(n)]
    for first, _, smoothed in _chunks(problem):
        kept = np.arange(-first % problem.every, len(smoothed), problem.every)
        at = (first + kept) // problem.every
        trace.track[at], trace.track_variance[at] = smoothed[kept, :n], smoothed[kept][:, diagonal]
    return trace


def _chunks(problem: FilterProblem) -> Iterator[tuple[int, Array, Array]]:
    """Yield first sample, filtered and smoothed beliefs of each chunk, last chunk first; the arrays are reused."""
    n, samples = problem.model.width, len(problem.measured)
    kernel = compile_smoother(problem.model, problem.channels, problem.robust)
    log = Log(constant_row(problem, {}), problem.drives, problem.measured, problem.substeps)
    state = np.concatenate([problem.mean, problem.covariance[np.triu_indices(n)]])
    length = isqrt(samples - 1) + 1
    firsts = range(0, samples, length)
    checkpoints = np.empty((len(firsts), len(state)))
    nothing, blank = np.empty((0, 0, n)), np.empty((0, len(state)))
    for i, first in enumerate(firsts):
        checkpoints[i] = state
        kernel.forward(state, log, first, min(first + length, samples), Beliefs(nothing, blank, blank))
    starts = np.empty((length, problem.substeps, n))
    priors, posteriors, smoothed = (np.empty((length, len(state))) for _ in range(3))
    beliefs = Beliefs(starts, priors, posteriors)
    adjoint = np.zeros(len(state))
    for i, first in reversed(list(enumerate(firsts))):
        stop = min(first + length, samples)
        kernel.forward(checkpoints[i], log, first, stop, beliefs)
        kernel.backward(adjoint, log, first, stop, beliefs, smoothed)
        yield first, posteriors[: stop - first], smoothed[: stop - first]
