"""Channels with a wrong sign, unit or name, found by physics before anything is fitted.

Velocity is the slope of position. The piston moves with the pump, and no farther than the pumped oil moves it, while
leakage and friction may take any share. Pumped oil moves the piston, and compresses oil as pressure rises. A factor
counts only if it is near that of a slip of units, and far from what a wrong rig file can explain.
"""

from collections.abc import Mapping

import numpy as np

from estimation.log_checks.channel_blocks import (
    FOLLOWS,
    OPPOSED,
    SURE,
    ChannelBlocks,
    channel_blocks,
    correlation_and_ratio,
    path_agreement,
    pressure_flow_correlation,
)
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY, motion_channels
from estimation.log_checks.flow_balance import REFUTED, FlowBalance, flow_balance
from estimation.log_checks.pump_units import pump_unit_notes
from estimation.log_checks.unit_slips import FARTHEST, LENGTHS, NEAR, matching_slip, unit_note
from estimation.notes import ChannelCode
from plant.eha.model import EhaParameters
from plant.log.columns import TIME
from plant.log.plausibility import LIMITS, SAMPLE_TIME_RANGE
from plant.log.record import Record
from plant.notes import Note

MEASURED = (SPEED, POSITION, VELOCITY, PRESSURE)
"""Channels of which at least one must change in a log with any information."""

SHORT, MIDDLE, LONG = 0.01, 0.02, 0.05
"""Blocks over which velocity is compared with position, flows are balanced, and the piston follows the pump [s]."""

LEAST_DISAGREEMENT = 5.0
"""Ratio of two sensors of one motion from which one has an unknown unit; judged: errors of gain are smaller
[dimensionless]."""

LEAST_RETURN = 0.6
"""Least ratio between a piston's two directions from which speed lacks its sign: of its travel, its mean velocities,
and the pumped volume meanwhile [fraction]; judged."""

LEAST_PERSISTENCE = 0.5
"""Least correlation of a moving piston's speed from block to block [dimensionless]: it is 0.81 to 0.99 in the nine
conditions under steps and binary signals. An encoder's noise has -0.5, a velocity sensor's 0."""

UNKNOWN_UNIT = "another unit"
"""Words for a factor that no known slip makes."""

INCHES = {1.0 / 0.0254: "inches read as m", 25.4: "inches read as mm, or mm read as inches"}
"""Slips of a length in inches, by how far one sensor of a motion then goes beyond the other [dimensionless]."""

EXPLAINED, TOLD = 0.9, 4.0
"""Share of the flow that a balance must explain, and deviations from zero from which its sign counts [fraction,
dimensionless]."""

PRESSURE_UNIT_RATIO = 50.0
"""Ratio to the rig's compressibility, or its inverse, that means a unit of pressure and no oil [dimensionless]."""


def channel_mistakes(record: Record, p: EhaParameters) -> tuple[Note, ...]:
    """Return a note for each channel whose sign, unit or name is wrong.

    Parameters
    ----------
    record : Record
        The log, without the channels whose sensors are accused.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    tuple of Note
        None for a sound log, however leaky or stuck the actuator.
    """
    if _repeats_one_row(record):
        return (ChannelCode.NOTHING_CHANGES.note(channel=" and ".join(one for one in MEASURED if one in record)),)
    short, middle, long = (channel_blocks(record, p, length) for length in (SHORT, MIDDLE, LONG))
    found = _swapped_notes(short) or _swapped_notes(long) or _motions_disagree(short, long, p)
    if found:
        return tuple(_time_unit_instead(one, record.sample_time) for one in found)
    balance = flow_balance(record, p, MIDDLE)
    if balance is not None and balance.explained < EXPLAINED:
        balance = None
    units = tuple(_time_unit_instead(one, record.sample_time) for one in pump_unit_notes(record, long, p, balance))
    unsigned = _unsigned_speed_notes(record, middle, balance)
    return unsigned or _wrong_sign_notes(record, middle, long, balance) or units or _pressure_units(middle, p, balance)


def _repeats_one_row(record: Record) -> bool:
    """Return whether nothing changes although the motor turns; at standstill nothing need change."""
    still = all(np.nanmax(record[name]) == np.nanmin(record[name]) for name in MEASURED if name in record)
    return still and SPEED in record and bool(np.nanmax(np.abs(record[SPEED])) > LIMITS[SPEED].least)


def _time_unit_instead(note: Note, sample_time: float) -> Note:
    """Return a note on time where that alone explains a position that went a thousandfold too far or too short.

    A rate needs no clock to agree with another rate; a position does.
    """
    if note.code != ChannelCode.CHANNEL_UNIT or note.data["channel"] != POSITION:
        return note
    if sample_time > SAMPLE_TIME_RANGE[1] and note.data["slip"] == LENGTHS[1e-3]:
        return unit_note(TIME, POSITION, 1e3, "ms read as s")
    if sample_time < SAMPLE_TIME_RANGE[0] and note.data["slip"] == LENGTHS[1e3]:
        return unit_note(TIME, POSITION, 1e-3, "s read as ms")
    return note


def _swapped_notes(blocks: ChannelBlocks) -> tuple[Note, ...]:
    """Compare the slope of velocity with position; the noise of a piston that hardly moves asks for long blocks."""
    there, ratio = correlation_and_ratio(blocks.velocity_slope, blocks.position)
    here, _ = correlation_and_ratio(blocks.slope, blocks.velocity)
    if there < SURE or not 1.0 / NEAR <= ratio <= NEAR or here > 0.5:
        return ()
    return (ChannelCode.CHANNELS_SWAPPED.note(channel=POSITION, other=VELOCITY, correlation=there),)


def _motions_disagree(short: ChannelBlocks, long: ChannelBlocks, p: EhaParameters) -> tuple[Note, ...]:
    """Compare the slope of position with velocity, and both with the pump to find which is wrong."""
    same, ratio = correlation_and_ratio(short.slope, short.velocity)
    if abs(same) < SURE:
        return ()
    with_pump = {
        POSITION: path_agreement(long.slope, long.pumped),
        VELOCITY: path_agreement(long.velocity, long.pumped),
    }
    found: list[Note] = []
    if ratio < 0.0:
        against = [name for name, (correlation, _) in with_pump.items() if correlation < -0.5]
        channel = against[0] if len(against) == 1 else f"{VELOCITY} or {POSITION}"
        other = POSITION if channel == VELOCITY else VELOCITY
        found.append(ChannelCode.CHANNEL_REVERSED.note(channel=channel, against=other, correlation=same))
    swept = {name: p.piston_area * abs(size) for name, (_, size) in with_pump.items()}
    return (*found, *_unlike_motion_notes(abs(ratio), swept))


def _unlike_motion_notes(ratio: float, swept: Mapping[str, float]) -> tuple[Note, ...]:
    """Return a note if position and velocity differ by a unit: the one by which a piston sweeps too much is wrong.

    ``ratio`` is the size of the slope of position over that of velocity, ``swept`` what a piston would sweep by each,
    over the volume pumped.
    """
    factor = matching_slip(ratio, LENGTHS)
    if factor is not None:
        large, small = (POSITION, VELOCITY) if factor > 1.0 else (VELOCITY, POSITION)
        wrong, other = (large, small) if swept[large] > FARTHEST else (small, large)
        times = ratio if wrong == POSITION else 1.0 / ratio
        slip = factor if wrong == POSITION else min(LENGTHS, key=lambda one: abs(np.log(one * factor)))
        return (unit_note(wrong, other, times, LENGTHS[slip]),)
    if 1.0 / LEAST_DISAGREEMENT <= ratio <= LEAST_DISAGREEMENT:
        return ()
    # such as a furlong read as a metre: only a pump shows which is wrong
    large, small = (POSITION, VELOCITY) if ratio > 1.0 else (VELOCITY, POSITION)
    wrong = large if swept[large] > FARTHEST else f"{large} or {small}"
    times = max(ratio, 1.0 / ratio)
    inches = matching_slip(times, INCHES, 0.95, 1.05)
    return (unit_note(wrong, small, times, UNKNOWN_UNIT if inches is None else INCHES[inches]),)


def _wrong_sign_notes(
    record: Record, middle: ChannelBlocks, long: ChannelBlocks, balance: FlowBalance | None
) -> tuple[Note, ...]:
    """Return which of pump, piston and pressure has the wrong sign: two of the three agree.

    Oil yields to pressure, and sliding and leakage take power: if neither holds, pump and pressure have opposite signs.
    If half the period of a sine equals a long block, the result depends on the phase of the blocks: a piston with a
    small lag may then seem opposed. In shorter blocks it does not.
    """
    together, _ = path_agreement(long.piston, long.pumped)
    apart = (
        all(correlation_and_ratio(one.piston, one.pumped)[0] < OPPOSED for one in (middle, long)) and together < OPPOSED
    )
    with_pump = together > FOLLOWS
    opposed = with_pressure = False
    if balance is not None and long.pumped is not None:
        power = pressure_flow_correlation(long.pressure, long.pumped, long.piston)
        opposed = power * len(long.pumped) ** 0.5 < -REFUTED and balance.compressed < -TOLD * balance.compressed_std
        with_pressure = balance.compressed > TOLD * balance.compressed_std
        apart = apart or (together < 0.0 and balance.swept < -max(TOLD * balance.swept_std, 0.3))
        goes_along = balance.swept > max(TOLD * balance.swept_std, 0.3)
        with_pump = with_pump or goes_along
        # a spring drives the piston back while the pump, whose whole flow leaks, goes on
        apart = apart and not goes_along
    moved = motion_channels(record)
    if apart:
        channel = SPEED if opposed else moved if with_pressure else f"{SPEED} or {moved}"
        against = SPEED if channel == moved else moved
    elif opposed:
        together = pressure_flow_correlation(long.pressure, long.pumped, long.piston)
        channel, against = (PRESSURE if with_pump else f"{PRESSURE} or {SPEED}"), SPEED
    else:
        return ()
    return (ChannelCode.CHANNEL_REVERSED.note(channel=channel, against=against, correlation=together),)


def _unsigned_speed_notes(record: Record, middle: ChannelBlocks, balance: FlowBalance | None) -> tuple[Note, ...]:
    """Return a note if a piston moves both ways, as fast and for as much oil, while speed is never negative.

    A load or a spring moves it back too, but against a pump that turns slowly, or so that leakage explains the flow.
    Noise of a stuck piston goes both ways as well, and changes its sign from block to block.
    """
    piston, pumped = middle.piston, middle.pumped
    if piston is None or pumped is None or balance is not None or np.nanmin(record[SPEED]) < 0.0:
        return ()
    ways = (piston > 0.0, piston < 0.0)
    if not all(np.any(way) for way in ways):
        return ()
    if not pumped.mean() > 0.0 or piston[1:] @ piston[:-1] < LEAST_PERSISTENCE * (piston @ piston):
        return ()
    size = np.abs(piston)
    forth, back = (np.array([size[way].sum(), size[way].mean(), pumped[way].mean()]) for way in ways)
    if np.any(np.minimum(forth, back) < LEAST_RETURN * np.maximum(forth, back)):
        return ()
    return (ChannelCode.SPEED_UNSIGNED.note(channel=SPEED),)


def _pressure_units(middle: ChannelBlocks, p: EhaParameters, balance: FlowBalance | None) -> tuple[Note, ...]:
    """Judge the unit of pressure by the oil that it seems to compress, and by the pressure of sliding."""
    if middle.pressure is None or balance is None or balance.compressed < TOLD * balance.compressed_std:
        return ()
    sliding = max(p.friction_coulomb / p.piston_area, 0.05 * p.relief_pressure)
    size = float(np.sqrt(np.mean(middle.pressure**2))) / sliding
    small = size * PRESSURE_UNIT_RATIO < 1.0 and balance.compressed > PRESSURE_UNIT_RATIO
    large = size > PRESSURE_UNIT_RATIO and balance.compressed * PRESSURE_UNIT_RATIO < 1.0
    if not (small or large):
        return ()
    slip = "kPa, psi, bar or MPa read as Pa" if small else "Pa read as kPa, psi, bar or MPa"
    return (unit_note(PRESSURE, SPEED, 1.0 / balance.compressed, slip),)
