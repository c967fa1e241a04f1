"""Input of the loops over a trajectory, and the log linearised along it."""

from typing import NamedTuple

from estimation.arrays import Array


class Lines(NamedTuple):
    """The log linearised along a trajectory, sample by sample [dimensionless; of residual and variance, SI].

    Parameters
    ----------
    F : ndarray, shape (samples, n, n)
        Jacobian of the step before each sample.
    gain, slope : ndarray, shape (samples, channels, n)
        The filter's gain, and the derivative of each channel.
    residual, variance : ndarray, shape (samples, channels)
        Innovations and their variances, NaN if nothing is measured.
    kept : ndarray, shape (rows, n, n)
        Covariance at regular intervals of samples.
    """

    F: Array
    gain: Array
    slope: Array
    residual: Array
    variance: Array
    kept: Array


class Log(NamedTuple):
    """A log and a model's constants; the loops change only the spread, to weight outliers.

    Parameters
    ----------
    rows : ndarray, shape (constants,)
        Constants of the model.
    drives, measured : ndarray, shapes (samples, drives) and (samples, channels)
        The log [SI].
    spread : ndarray, shape (samples, channels)
        Variances of the samples [SI squared].
    substeps : int
        Steps for each sample.
    """

    rows: Array
    drives: Array
    measured: Array
    spread: Array
    substeps: int
