"""Largest sample time: models take steps of 0.1 ms, so a fit to a slower log would hardly end."""

from plant.errors import LogError

SLOWEST = 0.1
"""Longest sample time from which a hydrostatic actuator is estimated [s]; judged. Its pressure settles in milliseconds,
its motion within tenths of a second."""

ROUNDING = 1e-6
"""Relative tolerance of a limit on the sample time [dimensionless]: stamps are rounded."""


def too_far_apart(sample_time: float, slowest: float) -> str:
    """Return the message about samples that are too far apart.

    Parameters
    ----------
    sample_time, slowest : float
        Seconds between samples, and the limit [s].
    """
    return (
        f"samples are {sample_time:.3g} s apart, but must be at most {slowest:.3g} s: slower ones do not show how the "
        "actuator moves; if the time stamps are milliseconds, name their unit (time_s=NAME:ms), else log faster"
    )


def require_fast_enough(sample_time: float) -> None:
    """Refuse samples that are too far apart for a hydrostatic actuator.

    Parameters
    ----------
    sample_time : float
        Seconds between samples [s].

    Raises
    ------
    LogError
        If it is longer than `SLOWEST`.

    Examples
    --------
    >>> require_fast_enough(0.1)
    """
    if sample_time > SLOWEST * (1.0 + ROUNDING):
        raise LogError(too_far_apart(sample_time, SLOWEST))
