"""A bootstrap particle filter: slow truth for beliefs that are not Gaussian.

Source: Gordon, Salmond and Smith (1993), with the systematic resampling of Kitagawa (1996), at every sample in which
something is measured. Weights are logarithms. It converges to the exact posterior as particles are added, and that is
all that it is for: a state without process noise keeps only the values that were drawn at first, so give it noise, and
a sensor much sharper than the belief needs as many particles as the belief is wider, at least.

It draws at random, so it is no entry of `estimation.run.METHODS`, whose filters repeat themselves.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import EKF, belief_symbols, bounded, moved, observed, process_noise
from estimation.compiled import constant_row
from estimation.filter import FilterProblem, Trace, empty_trace
from estimation.layout import layout
from estimation.model import ProcessModel
from estimation.parts import HEADER, data_places, function_source
from plant.compiled.expression import unary
from plant.compiled.kernel_file import load_kernel
from plant.errors import HydrostateError

Array = NDArray[np.float64]

_LOOP = """

@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(
    rng, particles, rows, limits, drives, measured, variances, substeps, every,
    track, track_variance, mean, covariance, nis, count, residuals, residual_variances,
):
    n, channels = measured.shape
    size = particles.shape[0]
    keep = residuals.shape[0] == n
    others = np.empty_like(particles)
    logs, weights, seen = np.empty(size), np.empty(size), np.empty((size, channels))
    deviations = np.empty({width})
    log_likelihood = 0.0
    for k in range(n):
        if k > 0:
            spread(rows, drives[k], deviations)
            for i in range(size):
                for j in range(substeps):
                    move(particles[i], rows, drives[k - 1], drives[k], float(j))
                    for a in range({width}):
                        if deviations[a] > 0.0:
                            value = particles[i, a] + deviations[a] * rng.standard_normal()
                            particles[i, a] = min(max(value, limits[0, a]), limits[1, a])
        logs[:] = 0.0
        weights[:] = 1.0 / size
        for i in range(size):
            observe(particles[i], rows, seen[i])
        for c in range(channels):
            y, r = measured[k, c], variances[c]
            e = np.nan
            s = np.nan
            if y == y:
                middle = 0.0
                for i in range(size):
                    middle += weights[i] * seen[i, c]
                s = r
                for i in range(size):
                    s += weights[i] * (seen[i, c] - middle) ** 2
                e = y - middle
                nis[c] += e * e / s
                count[c] += 1.0
                largest = -np.inf
                for i in range(size):
                    logs[i] = math.log(weights[i]) - 0.5 * ((y - seen[i, c]) ** 2 / r + math.log(2.0 * math.pi * r))
                    largest = max(largest, logs[i])
                total = 0.0
                for i in range(size):
                    weights[i] = math.exp(logs[i] - largest)
                    total += weights[i]
                for i in range(size):
                    weights[i] /= total
                log_likelihood += largest + math.log(total)
            if keep:
                residuals[k, c], residual_variances[k, c] = e, s
        for a in range({width}):
            mean[a] = 0.0
            for i in range(size):
                mean[a] += weights[i] * particles[i, a]
        for a in range({width}):
            for b in range(a, {width}):
                covariance[a, b] = 0.0
                for i in range(size):
                    covariance[a, b] += weights[i] * (particles[i, a] - mean[a]) * (particles[i, b] - mean[b])
                covariance[b, a] = covariance[a, b]
        if k % every == 0:
            for a in range({width}):
                track[k // every, a], track_variance[k // every, a] = mean[a], covariance[a, a]
        if np.any(measured[k] == measured[k]):
            place = rng.random() / size
            reached = weights[0]
            i = 0
            for m in range(size):
                while place > reached and i < size - 1:
                    i += 1
                    reached += weights[i]
                others[m] = particles[i]
                place += 1.0 / size
            particles[:] = others
    return log_likelihood
"""


@cache
def compile_particles(model: ProcessModel, channels: tuple[str, ...]) -> Callable[..., float]:
    """Generate and load the particle filter's kernel.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    callable
        Its ``run``.
    """
    mean, _ = belief_symbols(model)
    state = {f"z{i}": f"state[{i}]" for i in range(model.width)}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(EKF, model, channels).rows)}
    reads = {**state, **rows, **data_places(model, channels)}
    stepped = {f"z{i}": z for i, z in enumerate(bounded(model, moved(model, mean)))}
    predicted = {f"p{c}": value for c, value in enumerate(observed(model, mean, channels))}
    noise = {f"d{i}": unary("sqrt", process_noise(model, i)) for i in range(model.width)}
    source = HEADER.format(title=f"particles on the {model.name} form")
    source += function_source("move", "state, rows, before, after, j", reads, stepped, state)
    source += function_source(
        "observe", "state, rows, seen", reads, predicted, {n: f"seen[{n[1:]}]" for n in predicted}
    )
    source += function_source(
        "spread", "rows, after, deviations", reads, noise, {n: f"deviations[{n[1:]}]" for n in noise}
    )
    return load_kernel(f"particles_{model.name}", source + _LOOP.format(width=model.width)).run


def particle_filter(problem: FilterProblem, particles: int, rng: np.random.Generator) -> Trace:
    """Run a bootstrap particle filter.

    Parameters
    ----------
    problem : FilterProblem
        The task.
    particles : int
        How many are carried.
    rng : Generator
        Where they are drawn from.

    Returns
    -------
    Trace
        Mean and covariance of the weighted particles; innovations and their variances are those of the cloud.

    Raises
    ------
    HydrostateError
        If there are fewer than two particles, or a robust update is asked for.
    """
    if particles < 2:
        raise HydrostateError(f"a particle filter needs at least 2 particles, got {particles}")
    if problem.robust != "none":
        raise HydrostateError(f"the particle filter has no robust update, got robust {problem.robust!r}")
    trace = empty_trace(problem)
    limits = np.array([state.scaled_bounds for state in problem.model.states]).T.copy()
    cloud = rng.multivariate_normal(problem.mean, problem.covariance, size=particles, method="eigh")
    log_likelihood = compile_particles(problem.model, problem.channels)(
        rng,
        np.clip(cloud, *limits),
        constant_row(problem, {}),
        limits,
        problem.drives,
        problem.measured,
        problem.variances,
        problem.substeps,
        problem.every,
        trace.track,
        trace.track_variance,
        trace.mean,
        trace.covariance,
        trace.nis,
        trace.count,
        trace.residuals,
        trace.residual_variances,
    )
    return replace(trace, log_likelihood=log_likelihood)
