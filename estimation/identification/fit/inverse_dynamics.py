"""Mass and friction of a moving body from position and force: the inverse dynamic model, linear in its parameters.

``force = mass x'' + viscous x' + coulomb sign(x') + offset`` (Gautier and Khalil 1990). Position is low-passed without
phase and differentiated by central differences; both sides of the regression then go through one
decimation filter, so the equation survives it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import butter, decimate, sosfiltfilt

from estimation.arrays import Array
from plant.errors import HydrostateError

FILTER_ORDER = 4
"""Of the low-pass on position, one pass."""

EDGE = 4
"""Decimated samples at either end that the filters spoil."""


@dataclass(frozen=True, eq=False)
class RigidBody:
    """A body's inverse dynamics, with standard deviations.

    Parameters
    ----------
    mass, viscous, coulomb, offset : float
        Mass [kg], viscous friction [N s/m], Coulomb friction [N], constant force [N].
    std : ndarray, shape (4,)
        Their standard deviations, in the same order and units.
    relative_force_error : float
        Norm of the residual over that of the force [dimensionless].
    """

    mass: float
    viscous: float
    coulomb: float
    offset: float
    std: Array
    relative_force_error: float

    @property
    def values(self) -> Array:
        """Mass, viscous, Coulomb and offset, shape (4,)."""
        return np.array([self.mass, self.viscous, self.coulomb, self.offset])


def fit_rigid_body(
    position: ArrayLike, force: ArrayLike, sample_time: float, *, cutoff_hz: float = 100.0, every: int = 25
) -> RigidBody:
    """Fit mass, viscous and Coulomb friction, and an offset.

    Parameters
    ----------
    position : array_like, shape (n,)
        Position [m].
    force : array_like, shape (n,)
        Driving force [N].
    sample_time : float
        Seconds between samples [s].
    cutoff_hz : float
        Low-pass of position before it is differentiated [Hz].
    every : int
        Samples from one row of the regression to the next, after a low-pass.

    Returns
    -------
    RigidBody
        With standard deviations for a residual that is white after decimation.

    Raises
    ------
    HydrostateError
        If the signals do not match, hold gaps, are too short, or do not move enough to tell the four apart.
    """
    rows, wanted = _regression(position, force, sample_time, cutoff_hz, every)
    scale = np.linalg.norm(rows, axis=0)
    if not (scale > 0.0).all() or np.linalg.cond(rows / scale) > 1e6:
        raise HydrostateError("position must accelerate and move both ways to tell mass from friction, got too little")
    values = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    residual = wanted - rows @ values
    variance = float(residual @ residual) / (wanted.size - values.size)
    std = np.sqrt(variance * np.diag(np.linalg.inv(rows.T @ rows)))
    error = float(np.linalg.norm(residual) / np.linalg.norm(wanted))
    return RigidBody(*(float(value) for value in values), std=std, relative_force_error=error)


def force_error(
    body: RigidBody,
    position: ArrayLike,
    force: ArrayLike,
    sample_time: float,
    *,
    cutoff_hz: float = 100.0,
    every: int = 25,
) -> float:
    """Return the relative force error of a body on another record.

    Parameters
    ----------
    position : array_like, shape (n,)
        Position [m].
    force : array_like, shape (n,)
        Driving force [N].
    sample_time : float
        Seconds between samples [s].
    cutoff_hz, every
        As `fit_rigid_body`.

    Returns
    -------
    float
        Norm of the residual over that of the force [dimensionless].
    """
    rows, wanted = _regression(position, force, sample_time, cutoff_hz, every)
    return float(np.linalg.norm(wanted - rows @ body.values) / np.linalg.norm(wanted))


def _regression(
    position: ArrayLike, force: ArrayLike, sample_time: float, cutoff_hz: float, every: int
) -> tuple[Array, Array]:
    x, drive = np.asarray(position, dtype=np.float64), np.asarray(force, dtype=np.float64)
    if x.ndim != 1 or x.shape != drive.shape or x.size < 20 * every:
        raise HydrostateError(
            f"position and force must be of one length, {20 * every} samples or more, got {x.shape} and {drive.shape}"
        )
    if not (np.isfinite(x).all() and np.isfinite(drive).all()):
        raise HydrostateError("position and force must have no gaps, got NaN or infinite values")
    if not 0.0 < cutoff_hz < 0.5 / sample_time:
        raise HydrostateError(f"cutoff_hz must lie between 0 and {0.5 / sample_time:g} Hz, got {cutoff_hz!r}")
    smooth = sosfiltfilt(butter(FILTER_ORDER, cutoff_hz, fs=1.0 / sample_time, output="sos"), x)
    velocity = np.gradient(smooth, sample_time)
    columns = [np.gradient(velocity, sample_time), velocity, np.sign(velocity), np.ones_like(x)]
    filtered = [np.asarray(decimate(column, every))[EDGE:-EDGE] for column in [*columns, drive]]
    return np.stack(filtered[:-1], axis=1), filtered[-1]
