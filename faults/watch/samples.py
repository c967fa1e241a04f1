"""A log, or a piece of a stream, as the samples that a watch takes."""

from collections.abc import Mapping, Sequence

import numpy as np

from plant.arrays import Array
from plant.errors import LogError
from plant.log.chamber_pressures import PRESSURE, with_pressure_difference


def watched_samples(channels: Mapping[str, Array], sample_time: float, travelled: float = 0.0) -> tuple[Array, bool]:
    """Return a log, or a piece of one, as samples for `Watch.take`.

    Parameters
    ----------
    channels : Mapping[str, ndarray, shape (n,)]
        Channels in SI: motor speed, and position or velocity; differential pressure, or both pressures, if logged.
    sample_time : float
        Time between samples [s].
    travelled : float
        Position before the first sample of a piece that has only velocity [m].

    Returns
    -------
    samples : ndarray, shape (n, 3)
        Motor speed [rad/s], position [m], differential pressure [Pa].
    pressure : bool
        Whether differential pressure is logged.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    missing = missing_channels(list(channels))
    if missing:
        raise LogError(missing)
    speed = channels["motor_speed_rad_s"]
    difference = with_pressure_difference(channels).get(PRESSURE)
    if "position_m" in channels:
        position = channels["position_m"]
    else:
        velocity = channels["velocity_m_s"]
        position = travelled + np.cumsum(np.nan_to_num(velocity)) * sample_time
        position[np.isnan(velocity)] = np.nan
    told = difference is not None
    return np.column_stack([speed, position, difference if told else np.zeros(len(speed))]), told


def missing_channels(channels: Sequence[str]) -> str:
    """Return a sentence that names the channels a watch lacks; empty if none is missing."""
    motion = any(name in channels for name in ("position_m", "velocity_m_s"))
    if "motor_speed_rad_s" in channels and motion:
        return ""
    return f"a watch needs motor_speed_rad_s, and position_m or velocity_m_s, the log has {', '.join(channels)}"
