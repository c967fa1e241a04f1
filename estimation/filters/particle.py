"""A bootstrap particle filter: a slow reference for beliefs that are not Gaussian.

Source: Gordon, Salmond and Smith (1993), with the systematic resampling of Kitagawa (1996), at every sample in which
something is measured. Weights are logarithms. It converges to the exact posterior as particles are added, and this is
its only purpose. A state without process noise keeps only the values that were drawn at first, so give it noise. If a
sensor is much sharper than the belief, at least as many particles are needed as the belief is wider.

As a method of `estimation.filters.methods.METHODS` it draws from a seed that is one of its settings, so that its
results are repeatable, and it lets constants walk: bulk modulus is then found to a few percent if pressure is logged.
Position and velocity alone are so sharp that a thousand particles all miss them, and the consistency gate reports it.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Samples, Trace, empty_trace
from estimation.engine.kalman import belief_symbols, bounded_mean, next_state, predicted_outputs, process_noise
from estimation.engine.layout import layout
from estimation.engine.parts import data_places, function_source
from estimation.engine.rule import Setting, chosen_settings
from estimation.engine.runner import constant_row
from estimation.filters.ekf import EKF
from estimation.models.model import ProcessModel
from plant.compiled.expression import unary
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.errors import HydrostateError

Move: TypeAlias = Callable[[Array, Array, Array, Array, float], None]
"""``move(state, rows, before, after, j)``: take sub-step j of the model between samples of the drives."""

Observe: TypeAlias = Callable[[Array, Array, Array], None]
"""``observe(state, rows, seen)``: the model's prediction of each channel."""

Spread: TypeAlias = Callable[[Array, Array, Array], None]
"""``spread(rows, after, deviations)``: standard deviation that the noise of a sub-step gives each state."""


MOST_DRAWN = 1_000_000
"""Largest number of random numbers drawn at a time, or those of one sample if they are more [count]."""


def run(
    first: int,
    normal: Array,
    places: Array,
    particles: Array,
    rows: Array,
    limits: Array,
    variances: Array,
    samples: Samples,
    trace: Trace,
    *,
    WIDTH: int,
    move: Move,
    observe: Observe,
    spread: Spread,
) -> float:
    """Run the filter over some samples; return their log-likelihood.

    Parameters
    ----------
    first : int
        Index of the first sample.
    normal : ndarray, shape (taken, particles, substeps, n)
        Standard normal numbers [dimensionless].
    places : ndarray, shape (taken,)
        Numbers from 0 to 1 [dimensionless].
    particles : ndarray, shape (particles, n)
        States [scaled].
    rows : ndarray, shape (constants,)
        The filter's constants.
    limits : ndarray, shape (2, n)
        Bounds of the states [scaled].
    variances : ndarray, shape (channels,)
        Variances of the sensors [SI squared].

    Returns
    -------
    float
        Log-likelihood [dimensionless].
    """
    drives, measured, substeps, every = samples
    channels = measured.shape[1]
    size = particles.shape[0]
    others, weights, seen = np.empty_like(particles), np.empty(size), np.empty((size, channels))
    deviations = np.empty(WIDTH)
    log_likelihood = 0.0
    for k in range(first, first + places.shape[0]):
        if k > 0:
            spread(rows, drives[k], deviations)
            for i in range(size):
                for j in range(substeps):
                    move(particles[i], rows, drives[k - 1], drives[k], float(j))
                    for a in range(WIDTH):
                        if deviations[a] > 0.0:
                            value = particles[i, a] + deviations[a] * normal[k - first, i, j, a]
                            particles[i, a] = min(max(value, limits[0, a]), limits[1, a])
        weights[:] = 1.0 / size
        for i in range(size):
            observe(particles[i], rows, seen[i])
        for c in range(channels):
            e = s = np.nan
            if measured[k, c] == measured[k, c]:
                middle, s = predicted(weights, seen[:, c], variances[c])
                e = measured[k, c] - middle
                trace.nis[c] += e * e / s
                trace.count[c] += 1.0
                log_likelihood += weigh(weights, seen[:, c], measured[k, c], variances[c])
            if trace.residuals.shape[0] > 0:
                trace.residuals[k, c], trace.residual_variances[k, c] = e, s
        gather(particles, weights, trace.mean, trace.covariance, WIDTH=WIDTH)
        if k % every == 0:
            for a in range(WIDTH):
                trace.track[k // every, a] = trace.mean[a]
                trace.track_variance[k // every, a] = trace.covariance[a, a]
        if is_logged(measured[k]):
            resample(places[k - first], particles, weights, others)
    return log_likelihood


def is_logged(sample: Array) -> bool:
    """Return whether any channel of a sample was measured."""
    logged = False
    for c in range(sample.shape[0]):
        logged = logged or sample[c] == sample[c]
    return logged


def predicted(weights: Array, seen: Array, r: float) -> tuple[float, float]:
    """Return the mean and variance of a channel predicted by the particles, including the sensor's variance."""
    middle, s = 0.0, r
    for i in range(weights.shape[0]):
        middle += weights[i] * seen[i]
    for i in range(weights.shape[0]):
        s += weights[i] * (seen[i] - middle) ** 2
    return middle, s


def weigh(weights: Array, seen: Array, y: float, r: float) -> float:
    """Weight each particle by the likelihood of a sample under it; return the sample's log-likelihood."""
    largest, total = -np.inf, 0.0
    for i in range(weights.shape[0]):
        weights[i] = math.log(weights[i]) - 0.5 * ((y - seen[i]) ** 2 / r + math.log(2.0 * math.pi * r))
        largest = max(largest, weights[i])
    for i in range(weights.shape[0]):
        weights[i] = math.exp(weights[i] - largest)
        total += weights[i]
    for i in range(weights.shape[0]):
        weights[i] /= total
    return largest + math.log(total)


def gather(particles: Array, weights: Array, mean: Array, covariance: Array, *, WIDTH: int) -> None:
    """Set the particles' mean and covariance."""
    for a in range(WIDTH):
        mean[a] = 0.0
        for i in range(weights.shape[0]):
            mean[a] += weights[i] * particles[i, a]
    for a in range(WIDTH):
        for b in range(a, WIDTH):
            covariance[a, b] = 0.0
            for i in range(weights.shape[0]):
                covariance[a, b] += weights[i] * (particles[i, a] - mean[a]) * (particles[i, b] - mean[b])
            covariance[b, a] = covariance[a, b]


def resample(place: float, particles: Array, weights: Array, others: Array) -> None:
    """Draw new particles by their weights, at even distances from one random place (Kitagawa 1996)."""
    size = weights.shape[0]
    place /= size
    reached, i = weights[0], 0
    for m in range(size):
        while place > reached and i < size - 1:
            i += 1
            reached += weights[i]
        for a in range(particles.shape[1]):
            others[m, a] = particles[i, a]
        place += 1.0 / size
    for m in range(size):
        for a in range(particles.shape[1]):
            particles[m, a] = others[m, a]


PARTICLE_SETTINGS = (
    Setting("particles", 1000.0, "a whole number, 2 or more", lambda value, _: value >= 2.0 and value.is_integer()),
    Setting("seed", 0.0, "a whole number, 0 or more", lambda value, _: value >= 0.0 and value.is_integer()),
    Setting("walk", 0.1, "0 or more", lambda value, _: value >= 0.0),
)
"""Number of particles, and the seed of the random numbers [dimensionless]; the random walk of quantities that the model
takes as constant, in first standard deviations [1/s^(1/2)], without which all particles soon are copies of one."""


@cache
def compile_particles(model: ProcessModel, channels: tuple[str, ...]) -> Callable[..., float]:
    """Generate and load the particle filter's kernel.

    Returns
    -------
    callable
        The kernel's ``run``.
    """
    mean, _ = belief_symbols(model)
    state = {f"z{i}": f"state[{i}]" for i in range(model.width)}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(EKF, model, channels).rows)}
    reads = {**state, **rows, **data_places(model, channels)}
    stepped = {f"z{i}": z for i, z in enumerate(bounded_mean(model, next_state(model, mean)))}
    shown = {f"p{c}": value for c, value in enumerate(predicted_outputs(model, mean, channels))}
    noise = {f"d{i}": unary("sqrt", process_noise(model, i)) for i in range(model.width)}
    parts = (
        function_source("move", "state, rows, before, after, j", reads, stepped, state),
        function_source("observe", "state, rows, seen", reads, shown, {n: f"seen[{n[1:]}]" for n in shown}),
        function_source("spread", "rows, after, deviations", reads, noise, {n: f"deviations[{n[1:]}]" for n in noise}),
        functions_text(is_logged, predicted, weigh, gather, resample, inlined=True),
        functions_text(run, constants={"WIDTH": model.width}),
    )
    text = kernel_text(f"particles on the {model.name} form", *parts)
    return load_native(f"particles_{model.name}", text, {"run": signature_of(run)}).run


def particle(problem: FilterProblem) -> Trace:
    """Run a bootstrap particle filter in which constants walk.

    Parameters
    ----------
    problem : FilterProblem
        The task; it may set ``particles`` and ``seed`` [dimensionless], and ``walk`` [1/s^(1/2)].

    Returns
    -------
    Trace
        As from `particle_filter`.

    Raises
    ------
    HydrostateError
        If a setting is not known or not what it must be, or a robust update is asked for.
    """
    settings = chosen_settings(problem, "particle", PARTICLE_SETTINGS)
    walked = settings["walk"] ** 2 * np.diag(problem.covariance)
    walking = replace(problem, noise=np.where(problem.noise > 0.0, problem.noise, walked))
    return particle_filter(walking, int(settings["particles"]), np.random.default_rng(int(settings["seed"])))


def particle_filter(problem: FilterProblem, particles: int, rng: np.random.Generator) -> Trace:
    """Run a bootstrap particle filter.

    Returns
    -------
    Trace
        Mean and covariance of the weighted particles; innovations and their variances are those of the particles.

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
    run_kernel = compile_particles(problem.model, problem.channels)
    cloud = np.clip(cloud, *limits)
    rows, log_likelihood = constant_row(problem, {}), 0.0
    each = (particles, problem.substeps, problem.model.width)
    taken = max(1, MOST_DRAWN // math.prod(each))
    for first in range(0, len(problem.measured), taken):
        count = min(taken, len(problem.measured) - first)
        drawn = rng.standard_normal((count, *each)), rng.random(count)
        log_likelihood += run_kernel(first, *drawn, cloud, rows, limits, problem.variances, problem.samples, trace)
    return trace._replace(log_likelihood=log_likelihood)
