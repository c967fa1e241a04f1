"""`run_filter(method, model, prior, record, parameters) -> Estimate`: one verb over methods and models."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from estimation.ekf import ekf
from estimation.filter import FilterProblem, Method, Trace
from estimation.filterpy_bridge import filterpy_ekf
from estimation.gaussian import Gaussian
from estimation.identification.preprocess import bridged
from estimation.measurement_noise import measurement_variances
from estimation.model import ProcessModel
from plant.eha import EhaParameters
from plant.errors import LogError
from plant.integrate import parameter_row
from plant.record import Record

Array = NDArray[np.float64]

METHODS: Mapping[str, Method] = MappingProxyType({"ekf": ekf, "filterpy-ekf": filterpy_ekf})
"""The filters, by name."""

TRACK_ROWS = 20_000
"""About how many points of the state's history are kept."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """A filtered log, in SI.

    Parameters
    ----------
    model : ProcessModel
        The model that was believed.
    channels : tuple of str
        The channels that were measured.
    time : ndarray, shape (rows,)
        Times of the track [s].
    mean, variance : ndarray, shape (rows, n)
        Mean and variance of every state along the track.
    belief : Gaussian
        Belief after the last sample.
    nis : Mapping[str, float]
        Mean normalised innovation squared of each channel [dimensionless]; 1 where the filter believes what the log
        shows, NaN where the channel was never present.
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
    belief: Gaussian
    nis: Mapping[str, float]
    log_likelihood: float
    residuals: Array
    residual_variances: Array

    def track(self, state: str) -> tuple[Array, Array]:
        """Return a state's history.

        Parameters
        ----------
        state : str
            State name.

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
        state : str
            State name.
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
    parameters: EhaParameters,
    *,
    channels: tuple[str, ...] | None = None,
    variances: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
    keep_innovations: bool = False,
) -> Estimate:
    """Filter a record.

    Parameters
    ----------
    method : callable
        A filter of `METHODS`.
    model : ProcessModel
        The process model.
    prior : Gaussian
        Belief before the first sample, in SI.
    record : Record
        The log; ``motor_speed_rad_s`` drives the model.
    parameters : EhaParameters
        The actuator's known parameters.
    channels : tuple of str, optional
        Channels to use; by default all that the model predicts and the record has.
    variances : Mapping[str, float], optional
        Measurement variances [SI squared]; by default read off the log (`measurement_variances`).
    noise : Mapping[str, float], optional
        Process-noise densities [SI squared a second] that replace the model's, by state name.
    keep_innovations : bool
        Whether every innovation is kept.

    Returns
    -------
    Estimate
        The filtered log.

    Raises
    ------
    LogError
        If no channel that the model predicts is in the record.
    """
    used = channels if channels is not None else available_channels(model, record)
    if not used:
        raise LogError(f"the {model.name} form needs position_m or velocity_m_s, the record has {', '.join(record)}")
    spread = variances if variances is not None else measurement_variances(record, used)
    scale = np.array([state.scale for state in model.states])
    density = np.array([(noise or {}).get(state.name, state.noise_density) for state in model.states])
    problem = FilterProblem(
        model=model,
        channels=used,
        mean=prior.mean / scale,
        covariance=prior.covariance / np.outer(scale, scale),
        speed=bridged(record["motor_speed_rad_s"]),
        measured=np.column_stack([record[channel] for channel in used]),
        parameters=parameter_row(parameters),
        noise=density / scale**2,
        variances=np.array([spread[channel] for channel in used]),
        sample_time=record.sample_time,
        substeps=model.substeps(record.sample_time),
        every=max(1, len(record) // TRACK_ROWS),
        keep_innovations=keep_innovations,
    )
    return _in_si(problem, method(problem), record.start_time)


def available_channels(model: ProcessModel, record: Record) -> tuple[str, ...]:
    """Return the channels that the model predicts and the record has.

    Parameters
    ----------
    model : ProcessModel
        The process model.
    record : Record
        The log.

    Returns
    -------
    tuple of str
        Channel names, in the model's order.
    """
    predicted = model.observe(tuple(0.0 for _ in model.states), None)
    return tuple(channel for channel in predicted if channel in record)


def _in_si(problem: FilterProblem, trace: Trace, start_time: float) -> Estimate:
    scale = np.array([state.scale for state in problem.model.states])
    rows = np.arange(len(trace.track), dtype=np.float64)
    means = {
        channel: float(total / count) if count else float("nan")
        for channel, total, count in zip(problem.channels, trace.nis, trace.count, strict=True)
    }
    finite = bool(np.all(np.isfinite(trace.mean)) and np.all(np.isfinite(trace.covariance)))
    final = np.maximum(np.diag(trace.covariance), 0.0)
    covariance = trace.covariance + np.diag(final - np.diag(trace.covariance))
    belief = (
        Gaussian(trace.mean * scale, covariance * np.outer(scale, scale))
        if finite
        else Gaussian(problem.mean * scale, problem.covariance * np.outer(scale, scale))
    )
    return Estimate(
        model=problem.model,
        channels=problem.channels,
        time=start_time + problem.sample_time * problem.every * rows,
        mean=trace.track * scale,
        variance=np.maximum(trace.track_variance, 0.0) * scale**2,
        belief=belief,
        nis=MappingProxyType(means),
        log_likelihood=trace.log_likelihood,
        residuals=trace.residuals,
        residual_variances=trace.residual_variances,
    )
