"""Units of motor speed and of a length, judged by how far the piston goes for the volume pumped."""

from typing import NamedTuple

import numpy as np

from estimation.log_checks.channel_blocks import FOLLOWS, SURE, ChannelBlocks, path_agreement
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, has_both_motions, motion_channels
from estimation.log_checks.flow_balance import REFUTED, FlowBalance
from estimation.log_checks.measurement_noise import position_variance
from estimation.log_checks.unit_slips import (
    DEGREES,
    FARTHEST,
    IN_DEGREES,
    LENGTHS,
    NEAR,
    RPM,
    TURNS,
    matching_slip,
    unit_note,
)
from plant.eha.model import EhaParameters, piston_areas
from plant.log.record import Record
from plant.notes import Note

LEAST, MOST, LOST = 0.6, 1.3, 0.5
"""Range of a balance's factor over that of a slip, and what a piston with large losses leaves of it [fraction]."""

TINY = 1e-3
"""Factor of a length below which a piston seems to stand still, which cannot be leakage without pressure."""

KNOWN = 0.1
"""Relative deviation of a balance's factor up to which it counts [fraction]."""

FAST, SIX = 2.0, 6.0
"""Factor above the motor's limit that a speed in revolutions per minute cannot reach, judged; and that of deg/s read as
rpm [dimensionless]. Between the two the travel decides."""

HOLDING_FRICTION_SHARE = 0.7
"""Share of the rig's Coulomb friction up to which pressure moves no piston [fraction]; judged. With its seals a stuck
piston takes a tenth of the oil of a sliding one, which was reported as rpm read as rad/s."""

RESOLVED = 1e3
"""Travel of a position in a wrong unit, over its noise; a stuck piston has less [dimensionless]."""

LENGTH_ALONE = 100.0
"""Factor from which a slip is one of length, because no slip of motor speed is so large [dimensionless]."""

UNKNOWN_RIG = "another unit, or a rig file of another actuator"
LOSSY_UNIT = "another unit, such as mm read as m where much of the flow is lost, or a rig file of another actuator"
"""Words for a factor that no known slip makes, or that one makes if most of the flow is lost."""


class _Slips(NamedTuple):
    """Slips that are near how far a piston goes.

    Parameters
    ----------
    turn, length : float or None
        Factor of the slip of motor speed, and of a length [dimensionless].
    turn_believed, length_believed : bool
        Whether each counts.
    also_turns : frozenset of float
        Factors of other slips of motor speed that are as near [dimensionless].
    """

    turn: float | None = None
    length: float | None = None
    turn_believed: bool = False
    length_believed: bool = False
    also_turns: frozenset[float] = frozenset()

    @property
    def empty(self) -> bool:
        """Whether no slip is near."""
        return self.turn is None and self.length is None


def pump_unit_notes(
    record: Record, long: ChannelBlocks, p: EhaParameters, balance: FlowBalance | None
) -> tuple[Note, ...]:
    """Compare the piston's travel with the pumped volume, less leakage and compression if pressure is logged.

    Parameters
    ----------
    record : Record
        The log.
    long : ChannelBlocks
        Its channels over blocks so long that the piston follows the pump.
    p : EhaParameters
        The healthy actuator.
    balance : FlowBalance, optional
        Where the pumped flow goes; None without pressure, and if it explains too little of the flow.

    Returns
    -------
    tuple of Note
        One at most.
    """
    together, ratio = path_agreement(long.piston, long.pumped)
    swept = p.piston_area * ratio  # over the volume pumped
    least_swept = min(piston_areas(p)) * ratio  # if the areas differ, a piston goes farthest by the smaller one
    follows, far = together > FOLLOWS, swept > FARTHEST
    told = balance if balance is not None and 0.0 < balance.swept_std < KNOWN * balance.swept else None
    slips = _Slips()
    if told is not None and told.rig_contradiction > REFUTED and (far or _slides(record, p)):
        times = 1.0 / told.swept
        far = far and times > 1.0
        slips = _slips_by_balance(times, far=far)
    elif together > SURE and balance is None and not far:
        still = swept < TINY * NEAR and _exceeds_position_noise(record, long)
        slips = _Slips(None, matching_slip(swept, LENGTHS), length_believed=still)
    if slips.empty and far and follows:  # a balance may take motion for leakage
        slips = _slips_by_travel(swept, has_both_motions(record))
    fast = float(np.nanmax(np.abs(record[SPEED]))) / p.motor_speed_limit if SPEED in record else 0.0
    degrees = told is not None and 1.0 / MOST <= DEGREES / told.swept <= 1.0 / LEAST
    too_fast = fast > FARTHEST and least_swept < NEAR * min(TURNS)
    if too_fast and (follows or slips.length is not None or degrees):
        slips = slips._replace(turn=min(TURNS), turn_believed=True)
    degrees = degrees or (fast > FAST * RPM and least_swept * DEGREES < SIX**0.5)
    if named := _named_slips(slips, record, least_swept, degrees=degrees):
        channel, slip = " or ".join(one[0] for one in named), " or ".join(one[1] for one in named)
        return (_note_against_pump(record, channel, named[0][2], slip),)
    unlike = far and follows and (balance is None or balance.swept * FARTHEST < 1.0)
    return _unknown_unit_notes(record, swept) if unlike and _sweeps_more_than_pumped(long, p) else ()


def _slips_by_balance(times: float, *, far: bool) -> _Slips:
    """Return the slips near how many ``times`` as far as the balance of flows allows a piston goes."""
    least, most = 1.0 / MOST, 1.0 / (LOST if far else LEAST)
    turn, length = (matching_slip(times, slips, least, most) for slips in (TURNS, LENGTHS))
    believed = far or times < 1.0
    return _Slips(turn, length, believed, believed)


def _slips_by_travel(swept: float, two_motions: bool) -> _Slips:
    """Return the slips near the swept volume, over that pumped, of a piston that goes too far."""
    turn, length = (matching_slip(swept, slips, LOST) for slips in (TURNS, LENGTHS))
    if length is not None and length < LENGTH_ALONE and two_motions:
        length = None  # two channels agree: a piston that drifts while stuck makes a slip of speed look as large
    return _Slips(turn, length, True, True, frozenset(one for one in TURNS if LOST <= swept / one <= NEAR))


def _named_slips(slips: _Slips, record: Record, least_swept: float, *, degrees: bool) -> list[tuple[str, str, float]]:
    """Return channel, slip and factor of the slips that remain, given the least that the piston sweeps."""
    moved, named = motion_channels(record), list[tuple[str, str, float]]()
    turn, length = slips.turn, slips.length
    if turn is not None and slips.turn_believed and least_swept < NEAR * turn:
        said = " or ".join(TURNS[one] for one in TURNS if one == turn or one in slips.also_turns)
        named.append((SPEED, IN_DEGREES, DEGREES) if degrees and turn == min(TURNS) else (SPEED, said, 1.0 / turn))
    right = bool(named) and has_both_motions(record)  # position and velocity that agree are right
    if length is not None and slips.length_believed and least_swept < NEAR * length and not right:
        named.append((moved, LENGTHS[length], length))
    return named


def _unknown_unit_notes(record: Record, swept: float) -> tuple[Note, ...]:
    """Return the note on a piston that goes too far by a factor of no known slip."""
    lossy = 100.0 * NEAR < swept < 1e3  # too far for cm read as m, and for any unit of speed
    by_speed = has_both_motions(record) and not lossy
    channel = SPEED if by_speed else f"{motion_channels(record)} or {SPEED}"
    factor = 1.0 / swept if by_speed else swept
    return (_note_against_pump(record, channel, factor, LOSSY_UNIT if lossy else UNKNOWN_RIG),)


def _note_against_pump(record: Record, channel: str, factor: float, slip: str) -> Note:
    return unit_note(channel, motion_channels(record) if channel == SPEED else SPEED, factor, slip)


def _sweeps_more_than_pumped(long: ChannelBlocks, p: EhaParameters) -> bool:
    """Return whether a piston swept more than was pumped in all; at one speed nothing else shows how far it moved."""
    if long.piston is None or long.pumped is None:
        return False
    return bool(p.piston_area * np.abs(long.piston).sum() > np.abs(long.pumped).sum())


def _slides(record: Record, p: EhaParameters) -> bool:
    """Return whether pressure is ever high enough to move the piston; a stuck one only yields on its seals."""
    highest = float(np.nanmax(np.abs(record[PRESSURE]))) if PRESSURE in record else np.inf
    return highest * p.piston_area > HOLDING_FRICTION_SHARE * p.friction_coulomb


def _exceeds_position_noise(record: Record, long: ChannelBlocks) -> bool:
    """Return whether the motion of a piston that hardly moves is well above the noise of its position."""
    if long.position is None:
        return False
    noise = position_variance(record[POSITION]) ** 0.5
    return float(np.ptp(long.position)) > RESOLVED * noise > 0.0
