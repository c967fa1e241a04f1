"""Slips in how a log's channels were read, one or two at a time, and a log with them corrected."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from estimation.fits.flow.plain import Logged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.unit_slips import DEGREES, IN_DEGREES, LENGTHS, RPM, TURNS

PSI = 6894.757
"""A pound-force per square inch [Pa]."""

PRESSURES: Mapping[float, str] = {
    1e3: "kPa read as Pa or MPa read as kPa",
    PSI: "psi read as Pa",
    1e5: "bar read as Pa",
    1e6: "MPa read as Pa",
    PSI / 1e3: "psi read as kPa",
    1e2: "bar read as kPa",
    1e5 / PSI: "bar read as psi",
    1e6 / PSI: "MPa read as psi",
    10.0: "MPa read as bar",
    1e-3: "Pa read as kPa or kPa read as MPa",
    1.0 / PSI: "Pa read as psi",
    1e-5: "Pa read as bar",
    1e-6: "Pa read as MPa",
    1e3 / PSI: "kPa read as psi",
    1e-2: "kPa read as bar",
    PSI / 1e5: "psi read as bar",
    PSI / 1e6: "psi read as MPa",
    0.1: "bar read as MPa",
}
"""Slips of a pressure's unit, by the factor that corrects the values."""

SPEEDS: Mapping[float, str] = {
    **TURNS,
    1e3 / RPM: "krpm read as rad/s",
    1.0 / DEGREES: IN_DEGREES,
    1.0 / 6.0: "deg/s read as rpm",
    60.0: "rev/s read as rpm",
}
"""Slips of a speed's unit, likewise."""

POSITIONS: Mapping[float, str] = {1e-3: LENGTHS[1e3], 1e3: LENGTHS[1e-3]}
"""Slips of a position's unit, likewise."""


class Slip(NamedTuple):
    """A mistake in how a channel was read.

    Parameters
    ----------
    channel : str
        The channel.
    said : str
        What it looks like.
    factor : float
        The factor that corrects it [dimensionless]; 0 if the channel was taken for `other`.
    other : str
        Channel under whose heading it was read; empty if under its own.
    """

    channel: str
    said: str
    factor: float
    other: str = ""


def _sign_slip(channel: str) -> Slip:
    return Slip(channel, f"a wrong sign of {channel} (-UNIT)", -1.0)


def _unit_slips(channel: str, units: Mapping[float, str]) -> list[Slip]:
    return [Slip(channel, said, times) for times, said in units.items()]


SLIPS: Sequence[Slip] = (
    _sign_slip(SPEED),
    *_unit_slips(SPEED, SPEEDS),
    _sign_slip(PRESSURE),
    *_unit_slips(PRESSURE, PRESSURES),
    _sign_slip(POSITION),
    *_unit_slips(POSITION, POSITIONS),
    Slip(POSITION, f"{VELOCITY} in the place of {POSITION}", 0.0, VELOCITY),
)
"""Slips that are tried."""

USUAL_SPEEDS = (-1.0, 1.0 / RPM, RPM)
"""Slips of a speed, by their factor, that are tried together with one of another channel [dimensionless]."""

PAIRS: Sequence[tuple[Slip, Slip]] = tuple(
    (one, two)
    for one, two in combinations([slip for slip in SLIPS if slip.channel != SPEED or slip.factor in USUAL_SPEEDS], 2)
    if one.channel != two.channel and not (one.factor < 0.0 and two.factor < 0.0) and not (one.other or two.other)
)
"""Pairs of slips that are tried. Two wrong signs equal one wrong sign of the third channel."""


def with_slips_corrected(slips: Sequence[Slip], logged: Logged) -> Logged | None:
    """Return a log with slips corrected.

    Parameters
    ----------
    slips : sequence of Slip
        The slips, of different channels.

    Returns
    -------
    Logged or None
        None if the log has no channel to put in the place of another.
    """
    record, variances = logged.record, dict(logged.variances)
    for slip in slips:
        if slip.other and slip.other not in record:
            return None
        source, times = (slip.other, 1.0) if slip.other else (slip.channel, slip.factor)
        noise = times**2 * variances.get(source, np.nan)
        if not np.isfinite(noise):
            return None
        variances[slip.channel] = noise
        record = record.replace(**{slip.channel: times * logged.record[source]})
    return replace(logged, record=record, variances=variances)
