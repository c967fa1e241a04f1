"""Limits of a drive signal: the motor's speed, the piston's stroke."""

import numpy as np
from numpy.typing import NDArray

from plant.eha.model import JUDGED_STROKE, EhaParameters
from plant.errors import DriveError
from plant.runs import require_positive

LIMIT_SLACK = 1e-9
"""Fraction by which a limit may be exceeded, for rounding."""


def check_drive(speed: NDArray[np.float64], sample_time: float, parameters: EhaParameters) -> None:
    """Refuse a drive that exceeds the motor's limit or the stroke.

    The required stroke is the range of the ideal displacement, ``pump_displacement / piston_area`` times the integral
    of speed; losses only shorten it.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed [rad/s].
    sample_time : float
        Time between samples [s].
    parameters : EhaParameters
        The actuator, for its limits.

    Raises
    ------
    DriveError
        If the speed is not a finite one-dimensional array, or exceeds the motor's limit or the stroke.

    Examples
    --------
    >>> check_drive(np.full(100_000, 125.66), 1e-4, EhaParameters())
    Traceback (most recent call last):
        ...
    plant.errors.DriveError: the drive needs 0.4605 m of stroke, the actuator has 0.25 m: shorten or reverse it
    """
    require_positive("sample_time", sample_time, "s")
    if speed.ndim != 1 or len(speed) == 0:
        raise DriveError(f"motor speed must be a one-dimensional array of samples, got shape {speed.shape}")
    finite = np.isfinite(speed)
    if not finite.all():
        where = int(np.argmin(finite))
        raise DriveError(f"motor speed must be finite, got {speed[where]} at sample {where}")
    fastest, limit = float(np.max(np.abs(speed))), parameters.motor_speed_limit
    if fastest > limit * (1.0 + LIMIT_SLACK):
        raise DriveError(f"motor speed must stay within {limit:g} rad/s, got {fastest:.4g} rad/s")
    swept = parameters.pump_displacement / parameters.piston_area * sample_time
    position = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])))) * swept
    needed = float(np.ptp(position))
    stroke = parameters.stroke or JUDGED_STROKE
    if needed > stroke * (1.0 + LIMIT_SLACK):
        raise DriveError(
            f"the drive needs {needed:.4g} m of stroke, the actuator has {stroke:g} m: shorten or reverse it"
        )
