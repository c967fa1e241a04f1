"""Input and output of a filter: the contract of every method in `METHODS`.

A method is a function ``method(problem) -> Trace``. To add one, write such a function in a file of its own and add it
to `estimation.filters.methods.METHODS`; nothing else changes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.models.model import OPENING, ProcessModel


class Samples(NamedTuple):
    """A log in the form that a loop reads.

    Parameters
    ----------
    drives, measured : ndarray, shapes (samples, drives) and (samples, channels)
        As in `FilterProblem` [SI].
    substeps, every : int
        Steps of the model for each sample, and samples for each row of the track.
    """

    drives: Array
    measured: Array
    substeps: int
    every: int


@dataclass(frozen=True, eq=False)
class FilterProblem:
    """One filtering task in the model's scaled units, ready for a kernel.

    Parameters
    ----------
    channels : tuple of str
        Measured channels, in the order of their columns.
    mean : ndarray, shape (n,)
        Prior mean, scaled.
    covariance : ndarray, shape (n, n)
        Prior covariance, scaled.
    drives : ndarray, shape (samples, drives)
        Channels that drive the model, in SI, no sample missing; and the variances that gaps in them add
        (`estimation.log_checks.bridging`).
    measured : ndarray, shape (samples, channels)
        Measurements in SI; NaN is missing.
    parameters : ndarray, shape (parameters,)
        Row of parameters in SI.
    noise : ndarray, shape (n,)
        Process-noise density, scaled units squared per second.
    variances : ndarray, shape (channels,)
        Measurement variances in SI.
    sample_time : float
        Seconds between samples [s].
    every : int
        Number of samples for each row of the track.
    robust : str
        How innovations too large for noise count, see `estimation.engine.robust.inflation`.
    settings : Mapping[str, float]
        The user's settings of the method, by name; the method's defaults apply to all others [each in its own unit].
    """

    model: ProcessModel
    channels: tuple[str, ...]
    mean: Array
    covariance: Array
    drives: Array
    measured: Array
    parameters: Array
    noise: Array
    variances: Array
    sample_time: float
    substeps: int
    every: int
    keep_innovations: bool
    robust: str = "none"
    settings: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def samples(self) -> Samples:
        """The log, in the form that loops take."""
        return Samples(self.drives, self.measured, self.substeps, self.every)

    @property
    def added_variance(self) -> Array:
        """Variance that each sample adds to each state besides the process noise, shape (samples, n), scaled."""
        added = np.zeros((len(self.drives), self.model.width))
        for i, state in enumerate(self.model.states):
            if OPENING + state.name in self.model.drives:
                added[:, i] = self.drives[:, self.model.drives.index(OPENING + state.name)]
        return added


class Trace(NamedTuple):
    """The result of a method, in the model's scaled units.

    Parameters
    ----------
    mean, covariance : ndarray, shapes (n,) and (n, n)
        Final belief.
    track, track_variance : ndarray, shape (rows, n)
        Mean and variance at regular intervals of samples.
    nis : ndarray, shape (channels,)
        Sum of squared normalised innovations.
    count : ndarray, shape (channels,)
        Number of samples present.
    log_likelihood : float
        Sum of the innovations' Gaussian log densities [dimensionless].
    residuals, residual_variances : ndarray, shape (samples or 0, channels)
        Every innovation and its variance in SI, if kept.
    """

    mean: Array
    covariance: Array
    track: Array
    track_variance: Array
    nis: Array
    count: Array  # pyright: ignore[reportIncompatibleMethodOverride] - a trace is no list
    log_likelihood: float
    residuals: Array
    residual_variances: Array


Method: TypeAlias = Callable[[FilterProblem], Trace]
"""A filter: maps a problem to its trace."""


def empty_trace(problem: FilterProblem) -> Trace:
    """Return a trace with its arrays allocated, the belief set to the prior."""
    samples, channels = problem.measured.shape
    rows = (samples - 1) // problem.every + 1
    kept = samples if problem.keep_innovations else 0
    width = problem.model.width
    return Trace(
        mean=problem.mean.copy(),
        covariance=problem.covariance.copy(),
        track=np.empty((rows, width)),
        track_variance=np.empty((rows, width)),
        nis=np.zeros(channels),
        count=np.zeros(channels),
        log_likelihood=0.0,
        residuals=np.empty((kept, channels)),
        residual_variances=np.empty((kept, channels)),
    )
