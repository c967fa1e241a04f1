"""`run_filter(method, model, prior, record, parameters) -> Estimate`: one function for all methods and models."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem, Method, Trace
from estimation.log_checks.bridging import with_gap_uncertainty
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.compiled.expression import symbol
from plant.errors import LogError, require_known
from plant.log.record import Record
from plant.solvers.steps import Parameters, parameter_row, parameter_symbols

ROBUST = ("none", "huber", "student-t")
"""Ways in which gross outliers may count."""

TRACK_ROWS = 20_000
"""Approximate number of points of the states' history that are kept."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """A filtered log, in SI.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times of the track [s].
    mean, variance : ndarray, shape (rows, n)
        Mean and variance of every state along the track.
    belief : Gaussian or None
        Belief after the last sample; None if the filter diverged.
    nis : Mapping[str, float]
        Mean normalised innovation squared of each channel [dimensionless]; 1 if the filter is consistent with the log,
        NaN if the channel was never present.
    log_likelihood : float
        Log-likelihood of the log [dimensionless].
    residuals, residual_variances : ndarray, shape (samples or 0, channels)
        Innovations and their variances, if kept.
    """

    model: ProcessModel
    channels: tuple[str, ...]
    time: Array
    mean: Array
    variance: Array
    belief: Gaussian | None
    nis: Mapping[str, float]
    log_likelihood: float
    residuals: Array
    residual_variances: Array

    def track(self, state: str) -> tuple[Array, Array]:
        """Return a state's history.

        Returns
        -------
        tuple of ndarray, each shape (rows,)
            Mean and standard deviation along `time`.
        """
        i = self.model.index(state)
        return self.mean[:, i], np.sqrt(self.variance[:, i])

    def settled(self, state: str, fraction: float = 0.2) -> tuple[float, float]:
        """Return a state's value over the end of the run.

        Parameters
        ----------
        fraction : float
            Share of the run that counts as its end [fraction].

        Returns
        -------
        tuple of float
            Mean over that share, and the standard deviation of the final belief.
        """
        mean, std = self.track(state)
        first = int(np.floor(len(mean) * (1.0 - fraction)))
        return float(np.mean(mean[first:])), float(std[-1])


def run_filter(
    method: Method,
    model: ProcessModel,
    prior: Gaussian,
    record: Record,
    parameters: Parameters,
    *,
    channels: tuple[str, ...] | None = None,
    variances: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
    keep_innovations: bool = False,
    robust: str = "none",
    settings: Mapping[str, float] | None = None,
) -> Estimate:
    """Filter a record.

    Parameters
    ----------
    method : callable
        A filter of `estimation.filters.methods.METHODS`.
    prior : Gaussian
        Belief before the first sample, in SI.
    record : Record
        The log; it holds the channels that drive the model.
    parameters : dataclass
        The plant's known parameters, with the fields of the model's.
    channels : tuple of str, optional
        Channels to use; by default all that the model predicts and the record has.
    variances : Mapping[str, float], optional
        Measurement variances [SI squared]; by default estimated from the log (`measurement_variances`).
    noise : Mapping[str, float], optional
        Process-noise densities [SI squared per second] that replace the model's, by state name.
    robust : str
        How gross outliers count: one of `ROBUST`.
    settings : Mapping[str, float], optional
        The user's settings of the method [each in its own unit].

    Raises
    ------
    LogError
        If no channel that the model predicts is in the record.
    """
    problem = filter_problem(model, prior, record, parameters, channels=channels, variances=variances, noise=noise)
    require_known("robust", robust, ROBUST)
    problem = replace(problem, keep_innovations=keep_innovations, robust=robust, settings=dict(settings or {}))
    return in_si(problem, method(problem), record.start_time)


def filter_problem(
    model: ProcessModel,
    prior: Gaussian,
    record: Record,
    parameters: Parameters,
    *,
    channels: tuple[str, ...] | None = None,
    variances: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
) -> FilterProblem:
    """Convert a record to the form that a method takes.

    Parameters
    ----------
    prior : Gaussian
        Belief before the first sample, in SI.
    parameters : dataclass
        The plant's known parameters, with the fields of the model's.
    channels : tuple of str, optional
        Channels to use, as in `run_filter`.
    variances : Mapping[str, float], optional
        Measurement variances [SI squared].
    noise : Mapping[str, float], optional
        Process-noise densities [SI squared per second]; for a logarithmic state, those of the logarithm [1/s].

    Raises
    ------
    LogError
        If the record lacks a drive, or has no channel that the model predicts.
    """
    model.require_drives(record)
    used = channels if channels is not None else available_channels(model, record)
    if not used:
        wanted = " or ".join(predicted_channels(model))
        raise LogError(f"the {model.name} form needs {wanted}, the record has {', '.join(record)}")
    spread = variances if variances is not None else measurement_variances(record, used)
    scaled = model.to_filter(prior)
    model, drives, comparable = with_gap_uncertainty(model, record, parameters)
    return FilterProblem(
        model=model,
        channels=used,
        mean=scaled.mean,
        covariance=scaled.covariance,
        drives=drives,
        measured=np.where(comparable[:, None], np.column_stack([record[channel] for channel in used]), np.nan),
        parameters=parameter_row(parameters, model.parameters),
        noise=model.noise_densities(noise),
        variances=np.array([spread[channel] for channel in used]),
        sample_time=record.sample_time,
        substeps=model.substeps(record.sample_time),
        every=max(1, len(record) // TRACK_ROWS),
        keep_innovations=False,
    )


def predicted_channels(model: ProcessModel) -> tuple[str, ...]:
    """Return the channels that a model predicts."""
    state = tuple(symbol(f"z{i}") for i in range(model.width))
    return tuple(model.observe(state, parameter_symbols(model.parameters)))


def available_channels(model: ProcessModel, record: Record) -> tuple[str, ...]:
    """Return the channels that the model predicts and the record has."""
    return tuple(channel for channel in predicted_channels(model) if channel in record)


def in_si(problem: FilterProblem, trace: Trace, start_time: float) -> Estimate:
    """Return the result of a method in SI.

    Parameters
    ----------
    trace : Trace
        The method's result, in the filter's units.
    start_time : float
        Time of the first sample [s].
    """
    rows = np.arange(len(trace.track), dtype=np.float64)
    means = {
        channel: float(total / count) if count else float("nan")
        for channel, total, count in zip(problem.channels, trace.nis, trace.count, strict=True)
    }
    mean, slope = problem.model.to_si(trace.track)
    return Estimate(
        model=problem.model,
        channels=problem.channels,
        time=start_time + problem.sample_time * problem.every * rows,
        mean=mean,
        variance=np.maximum(trace.track_variance, 0.0) * slope**2,
        belief=_final_belief(problem.model, trace),
        nis=MappingProxyType(means),
        log_likelihood=trace.log_likelihood,
        residuals=trace.residuals,
        residual_variances=trace.residual_variances,
    )


def _final_belief(model: ProcessModel, trace: Trace) -> Gaussian | None:
    mean, slope = model.to_si(trace.mean)
    covariance = trace.covariance * np.outer(slope, slope)
    impossible = trace.log_likelihood == -np.inf  # an innovation's variance overflowed, so its sample was not used
    if impossible or not (np.all(np.isfinite(mean)) and np.all(np.isfinite(covariance))):
        return None
    rounding = np.maximum(np.diag(covariance), 0.0) - np.diag(covariance)
    return Gaussian(mean, covariance + np.diag(rounding))
