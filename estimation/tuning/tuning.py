"""Noise levels from the log: process and sensor covariances of maximum likelihood, compared with the published ones.

A filter's interval is only as good as its Q and R. Both are fitted here by the likelihood of the innovations (Mehra
1970 demands the same by their whiteness), each with a prior of a factor of twenty about the model's value, so that a
log without information on one of them leaves it unchanged.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from estimation.engine.contract import FilterProblem, Trace
from estimation.engine.layout import layout
from estimation.filters.ekf import EKF, ekf
from estimation.filters.run import filter_problem
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from estimation.models.published_noise import PRINTED_NOISE, PRINTED_R
from estimation.trust.whiteness import quantum
from estimation.tuning.scoring import Coordinate, Maximum, maximise
from estimation.tuning.sensitivity import Sensitivity, innovation_sensitivity
from plant.eha.model import EhaParameters
from plant.log.record import Record

NOISE_SPREAD = 3.0
"""Prior standard deviation of the logarithm of a noise level: a factor of twenty in either direction."""

LEAST_SHARE = 0.25
"""Least share of the noise of measured motor speed that is attributed to the sensor, and does not act on the plant."""

SCREENED_FACTORS = ((1e3, 1.0), (1.0, 1.0), (1e-1, 1.0), (1e-2, 1.0), (1e-3, 1.0), (1.0, 1e-2), (1e-3, 1e-2))
"""Factors on all process noise and on all sensor noise from which the search's start is chosen, in this order."""

SCREENED_SAMPLES = 20_000
"""Number of initial samples of a longer log on which the starts are compared."""

ROUNDS = 3
"""Largest number of times that the levels are tuned again, each time starting at the constants found."""

LARGEST_CONSTANT_MOVE = 1.0
"""Change of a constant from one round to the next above which another round follows [standard deviations]."""


@dataclass(frozen=True)
class NoiseSetting:
    """Noise levels, and their results on a log.

    Parameters
    ----------
    noise : Mapping[str, float]
        Process-noise densities by state name [SI squared per second]; for a logarithmic state, those of its logarithm.
    variances : Mapping[str, float]
        Sensor variances by channel [SI squared].
    log_likelihood : float
        Log-likelihood of the log [dimensionless].
    nis : Mapping[str, float]
        Mean normalised innovation squared by channel [dimensionless]; 1 if the filter is consistent with the log.
    """

    noise: Mapping[str, float]
    variances: Mapping[str, float]
    log_likelihood: float
    nis: Mapping[str, float]


@dataclass(frozen=True)
class Tuning:
    """Noise levels of maximum likelihood, with the given ones and those of the paper for comparison.

    Parameters
    ----------
    tuned : NoiseSetting
        Levels of maximum likelihood, in the form that `estimation.filters.run.run_filter` takes as ``noise`` and
        ``variances``.
    given : NoiseSetting
        The model's process noise, and the sensors' noise as estimated from the log.
    published : NoiseSetting
        Equations 7.6 and 7.7; levels that they do not give stay as given.
    spread : Mapping[str, float]
        Standard deviation of each tuned level's logarithm, by state name and by channel [dimensionless]. The prior has
        3, so the log contains no information on a level near 3.
    prior : Gaussian
        The belief before the first sample from which all three results were obtained [SI]: as wide as the given one,
        with constants at the values found.
    """

    tuned: NoiseSetting
    given: NoiseSetting
    published: NoiseSetting
    spread: Mapping[str, float]
    converged: bool
    prior: Gaussian


def tune(
    record: Record,
    model: ProcessModel,
    prior: Gaussian,
    parameters: EhaParameters,
    *,
    channels: tuple[str, ...] | None = None,
    variances: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
    received: Record | None = None,
) -> Tuning:
    """Tune a filter's noise levels on a log.

    A state without process noise, such as a constant bulk modulus, stays without. A filter that is certain of its
    motion and far from the solution locks onto a wrong one and finds it likely. So certainty is increased in steps, and
    each filter begins at the constants of the most likely one before it.

    Parameters
    ----------
    prior : Gaussian
        Belief before the first sample [SI].
    channels : tuple of str, optional
        Channels to use, as in `estimation.filters.run.run_filter`.
    variances : Mapping[str, float], optional
        Initial sensor variances, and that of motor speed [SI squared]; by default estimated from the log.
    noise : Mapping[str, float], optional
        Initial process-noise densities that replace the model's [SI squared per second].
    received : Record, optional
        The part of the log that the filter receives, as in `estimation.log_checks.told_once`; by default all of it. The
        sensors' resolution is estimated from the log itself.

    Raises
    ------
    LogError
        If the record lacks a drive, or has no channel that the model predicts.
    """
    how: dict[str, Any] = {"channels": channels, "variances": variances, "noise": noise}
    problem = filter_problem(model, prior, record if received is None else received, parameters, **how)
    coordinates = noise_coordinates(problem, record, parameters, (variances or {}).get("motor_speed_rad_s"))
    problem, guesses = _likeliest_start(problem, coordinates)
    found = maximise(problem, guesses)
    for _ in range(ROUNDS):
        again, moved = _task_with_found_constants(problem, ekf(_task_with_levels(problem, found)))
        if moved <= LARGEST_CONSTANT_MOVE:
            break
        problem, found = again, maximise(again, found.coordinates)
    tuned = _task_with_levels(problem, found)
    paper = _task_with_published_noise(problem)
    deviations = np.sqrt(np.diag(np.linalg.inv(found.information)))
    shown = {f"q{i}": state.name for i, state in enumerate(model.states)}
    shown |= {f"r{c}": f"sensor {channel}" for c, channel in enumerate(problem.channels)}
    physical, slope = model.to_si(problem.mean)
    return Tuning(
        tuned=_noise_setting(tuned, found.sensitivity),
        given=_noise_setting(problem, _innovations(problem)),
        published=_noise_setting(paper, _innovations(paper)),
        spread=MappingProxyType({shown[c.name]: float(std) for c, std in zip(coordinates, deviations, strict=True)}),
        converged=found.converged,
        prior=Gaussian(physical, problem.covariance * np.outer(slope, slope)),
    )


def noise_coordinates(
    problem: FilterProblem, record: Record, parameters: EhaParameters, speed_variance: float | None = None
) -> list[Coordinate]:
    """Return the logarithms of process and sensor noise as coordinates, with a prior of a factor about the given.

    Parameters
    ----------
    problem : FilterProblem
        The task; a process noise of 0 stays 0.
    record : Record
        The log; a sensor's variance stays above that of its quantum, and the noise of differential pressure above a
        quarter of the value that the noise of measured motor speed causes.
    speed_variance : float, optional
        Measurement variance of motor speed [rad^2/s^2]; estimated from the log if not given.
    """
    names = layout(EKF, problem.model, problem.channels).rows
    unseen = speed_noise(record, parameters, speed_variance)
    noise: list[tuple[str, float, float]] = []
    for i, (state, value) in enumerate(zip(problem.model.states, problem.noise, strict=True)):
        if value > 0.0:
            least = LEAST_SHARE * unseen / state.scale**2 if state.name == "differential_pressure_pa" else 0.0
            noise.append((f"q{i}", float(value), min(least, 0.99 * float(value))))
    sensors: list[tuple[str, float, float]] = []
    for c, channel in enumerate(problem.channels):
        resolved = quantum(record[channel])
        floor = min(resolved**2 / 12.0, 0.99 * float(problem.variances[c]))
        sensors.append((f"r{c}", float(problem.variances[c]), floor))
    return [
        Coordinate(name, names.index(name), value, floor=floor, spread=NOISE_SPREAD)
        for name, value, floor in (*noise, *sensors)
    ]


def speed_noise(record: Record, p: EhaParameters, variance: float | None = None) -> float:
    """Return the noise density of differential pressure that the noise of measured speed causes.

    Parameters
    ----------
    variance : float, optional
        Variance of measured speed [rad^2/s^2]; estimated from the log if not given.

    Returns
    -------
    float
        Noise density [Pa^2/s].
    """
    if variance is None:
        variance = measurement_variances(record, ["motor_speed_rad_s"])["motor_speed_rad_s"]
    return variance * record.sample_time * (p.pump_displacement * p.bulk_modulus / p.chamber_volume) ** 2


def _task_with_levels(problem: FilterProblem, found: Maximum) -> FilterProblem:
    values = {coordinate.name: coordinate.guess for coordinate in found.coordinates}
    levels = np.array([values.get(f"q{i}", 0.0) for i in range(problem.model.width)])
    return replace(problem, noise=levels, variances=np.array([values[f"r{c}"] for c in range(len(problem.channels))]))


def _task_with_found_constants(problem: FilterProblem, trace: Trace) -> tuple[FilterProblem, float]:
    """Return the task with its constants moved to those that a filter found, and the largest move in deviations."""
    constant = problem.noise == 0.0
    if not constant.any() or not np.all(np.isfinite(trace.mean)):
        return problem, 0.0
    std = np.sqrt(np.diag(trace.covariance)[constant])
    moved = np.abs(trace.mean[constant] - problem.mean[constant]) / np.maximum(std, np.finfo(float).tiny)
    return replace(problem, mean=np.where(constant, trace.mean, problem.mean)), float(np.max(moved))


def _likeliest_start(
    problem: FilterProblem, coordinates: Sequence[Coordinate]
) -> tuple[FilterProblem, list[Coordinate]]:
    """Return the task and the coordinates whose guesses, among a few, explain the beginning of the log best."""
    short = replace(problem, measured=problem.measured[:SCREENED_SAMPLES], drives=problem.drives[:SCREENED_SAMPLES])
    best, process, sensor = -np.inf, 1.0, 1.0
    for on_process, on_sensor in SCREENED_FACTORS:
        trace = ekf(replace(short, noise=on_process * problem.noise, variances=on_sensor * problem.variances))
        if trace.log_likelihood > best:
            best, process, sensor = trace.log_likelihood, on_process, on_sensor
            short, _ = _task_with_found_constants(short, trace)
    return replace(problem, mean=short.mean), [
        replace(c, guess=max(c.guess * (process if c.name[0] == "q" else sensor), 1.01 * c.floor)) for c in coordinates
    ]


def _innovations(problem: FilterProblem) -> Sensitivity:
    rows = layout(EKF, problem.model, problem.channels).rows
    return innovation_sensitivity(problem, np.zeros((len(rows), 0)))


def _task_with_published_noise(problem: FilterProblem) -> FilterProblem:
    noise = problem.noise.copy()
    for i, state in enumerate(problem.model.states):
        if state.name in PRINTED_NOISE and not state.logarithmic:
            noise[i] = PRINTED_NOISE[state.name] / state.scale**2
    sensors = [PRINTED_R.get(name, problem.variances[c]) for c, name in enumerate(problem.channels)]
    return replace(problem, noise=noise, variances=np.array(sensors))


def _noise_setting(problem: FilterProblem, found: Sensitivity) -> NoiseSetting:
    names = [state.name for state in problem.model.states]
    return NoiseSetting(
        noise=MappingProxyType(dict(zip(names, (problem.noise * problem.model.noise_units).tolist(), strict=True))),
        variances=MappingProxyType(dict(zip(problem.channels, problem.variances.tolist(), strict=True))),
        log_likelihood=found.log_likelihood,
        nis=MappingProxyType(dict(zip(problem.channels, found.nis.tolist(), strict=True))),
    )
