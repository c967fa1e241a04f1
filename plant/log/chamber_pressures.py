"""Differential pressure of a log whose sensors sit in the two chambers. No other module computes it."""

from collections.abc import Collection, Mapping

from plant.arrays import Array
from plant.errors import LogError
from plant.unit_text import pressure_reference

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


def require_one_reference(units: Mapping[str, str], names: Mapping[str, str], source: str) -> None:
    """Refuse pressures of two chambers of which one alone is absolute: their difference would miss an atmosphere.

    Parameters
    ----------
    units, names : Mapping[str, str]
        Unit and column of each channel.
    source : str
        What messages call the log.

    Raises
    ------
    LogError
        If one is; it says how to take the atmosphere off.
    """
    if PRESSURE in units or not has_pressure_difference(units):
        return
    told = {one: pressure_reference(units[one]) for one in CHAMBERS}
    absolute = [one for one in CHAMBERS if told[one][1] == "absolute"]
    if len(absolute) == 1:
        one = absolute[0]
        name = names[one][:80]
        raise LogError(
            f"pressures of both chambers must count from one zero, but of the two only {name!r} says that it is "
            f"absolute; take the atmosphere off it, --columns '{one}={name}:1 {told[one][0]} - 1.013 bar'",
            source,
        )
