"""Differential pressure of a log whose sensors sit in the two chambers. No other module computes it."""

from collections.abc import Collection, Mapping

from plant.arrays import Array

PRESSURE, CHAMBERS = "differential_pressure_pa", ("pressure_a_pa", "pressure_b_pa")
"""The channel of the difference, and those of the two chambers."""


def has_pressure_difference(channels: Collection[str]) -> bool:
    """Return whether a log has differential pressure: as a channel of its own, or as both chambers' pressures.

    Examples
    --------
    >>> has_pressure_difference(["pressure_a_pa", "pressure_b_pa"]), has_pressure_difference(["pressure_a_pa"])
    (True, False)
    """
    return PRESSURE in channels or all(one in channels for one in CHAMBERS)


def with_pressure_difference(channels: Mapping[str, Array]) -> Mapping[str, Array]:
    """Return channels with differential pressure, computed from both chamber pressures if it is not logged.

    Parameters
    ----------
    channels : Mapping[str, ndarray, shape (n,)]
        Channels in SI.

    Returns
    -------
    Mapping[str, ndarray, shape (n,)]
        They, and the difference [Pa] as the last; the same object where there is nothing to add.
    """
    if PRESSURE in channels or not has_pressure_difference(channels):
        return channels
    a, b = CHAMBERS
    return {**channels, PRESSURE: channels[a] - channels[b]}
