"""Notes on rig and logger for a log that the plain flow form does not explain, and the corrected log."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from estimation.eha.another_rod import b_over_a
from estimation.eha.changing_leakage import growth_note, leakage_over, step_note
from estimation.eha.entrained_air import air_note
from estimation.eha.port_drains import drain_note
from estimation.finding import NORMAL_95
from estimation.fits.greybox.play_courses import crossings
from estimation.fits.greybox.pump_ripple import EVENLY, Turning, delivering
from estimation.fits.hypotheses import WORN
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.not_excluded import blocked_note
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.clean import CleanLog
from estimation.models.inner_circuit import BEND
from estimation.models.wide_flow import CROSSED, GROWTH, TURBULENT_AT
from estimation.models.wrong_pressure import SETTLING, drifted
from estimation.notes import RigCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

LAGS: Mapping[str, str] = {PRESSURE: "pressure_lag", SPEED: "speed_lag", POSITION: "position_lag"}
"""The lag of each channel that may be late, beside its delay."""

LEAKAGE_COURSE = "leakage_course"
"""Channel of a corrected log: leakage over its value at the end of the log [dimensionless]."""

RIG_ENTRIES = ("pump_displacement", "chamber_volume", "area_difference", "volume_difference", "pilot_share")
"""Entries of a rig file that a log may correct."""

OUTSIDE = {
    RigCode.PUMP_WORN,
    RigCode.LEAKAGE_GROWS,
    RigCode.MAKEUP_BLOCKED,
    RigCode.PORT_DRAINS,
    RigCode.AIR_ENTERS,
    RigCode.RELIEF_LOW,
    RigCode.BORE_LEAKS,
    RigCode.TOOTH_LEAKS,
    RigCode.PUMP_STARVES,
    RigCode.LEAKAGE_LIFTS,
    RigCode.LEAKS_ONE_WAY,
}
"""Faults that are none of the nine conditions."""


def notes_of(found: Explanation, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return notes on the explanation of a log, each with its value and 95 % half width.

    Returns
    -------
    tuple of Note
        One per hypothesis, and one if others explain the log about as well.
    """
    notes = [_NOTES[name](found, parameters) for name in found.names]
    if found.rivals:
        notes.append(RigCode.EXPLAINED_OTHERWISE.note(others=", ".join(found.rivals)))
    return tuple(notes)


def _half_width(found: Explanation, name: str) -> float:
    return NORMAL_95 * found.values[name][1]


def _late(found: Explanation, _: EhaParameters) -> Note:
    width = 1e3 * _half_width(found, LAGS[PRESSURE])
    return RigCode.PRESSURE_LATE.note(late_ms=1e3 * lateness(found, PRESSURE), half_width_ms=width)


def _input_late(channel: str) -> Callable[[Explanation, EhaParameters], Note]:
    def note(found: Explanation, _: EhaParameters) -> Note:
        width = 1e3 * _half_width(found, LAGS[channel])
        return RigCode.INPUT_LATE.note(channel=channel, late_ms=1e3 * lateness(found, channel), half_width_ms=width)

    return note


def _speed_early(found: Explanation, p: EhaParameters) -> Note:
    width, early = 1e3 * _half_width(found, LAGS[SPEED]), -1e3 * lateness(found, SPEED)
    if early <= 0.0:  # the fitted lag is longer than the lead with which the search began
        return _input_late(SPEED)(found, p)
    return RigCode.INPUT_EARLY.note(channel=SPEED, early_ms=early, half_width_ms=width)


def lateness(found: Explanation, channel: str) -> float:
    """Return the total delay of a channel: lag plus delay.

    Parameters
    ----------
    found : Explanation
        The explanation of the log.
    channel : str
        One of `LAGS`.

    Returns
    -------
    float
        Time [s], negative for a lead.
    """
    return found.delays.get(channel, 0.0) + found.values.get(LAGS[channel], (0.0, 0.0))[0]


def _offset(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["pressure_offset"][0]
    return RigCode.PRESSURE_OFFSET.note(offset_pa=value, half_width_pa=_half_width(found, "pressure_offset"))


def _drift(found: Explanation, _: EhaParameters) -> Note:
    first, settling = (found.values.get(name, (0.0, 0.0))[0] for name in ("pressure_drift", SETTLING))
    gone = float(drifted(1.0, settling))
    return RigCode.PRESSURE_DRIFTS.note(
        drift_pa=first * gone, half_width_pa=_half_width(found, "pressure_drift") * gone
    )


def _sides(found: Explanation, _: EhaParameters) -> Note:
    value, half_width = found.values["pressure_sides"][0], _half_width(found, "pressure_sides")
    return RigCode.PRESSURE_SIDES.note(percent=200.0 * value, half_width=200.0 * half_width)


def _zero(found: Explanation, p: EhaParameters) -> Note:
    """Return the note on chambers of unequal volume, which look like those of an encoder with another zero."""
    value, half_width = found.values["position_zero"][0], 1e3 * _half_width(found, "position_zero")
    more = 2.0 * p.piston_area * abs(value)
    side = "A" if value < 0.0 else "B"
    return RigCode.ENCODER_ZERO.note(zero_mm=1e3 * value, half_width_mm=half_width, side=side, more=more)


def _play(found: Explanation, _: EhaParameters) -> Note:
    return RigCode.POSITION_PLAY.note(play_um=1e6 * found.values["position_play"][0])


def _delivery(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["pump_displacement"][0]
    share, half_width = value / p.pump_displacement, _half_width(found, "pump_displacement") / p.pump_displacement
    return (RigCode.PUMP_WORN if share < WORN else RigCode.AREA_TO_DISPLACEMENT).note(
        percent=100.0 * share, half_width=100.0 * half_width
    )


def _volume(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["chamber_volume"][0]
    half_width = _half_width(found, "chamber_volume") / p.chamber_volume
    return RigCode.VOLUME_DIFFERS.note(percent=100.0 * value / p.chamber_volume, half_width=100.0 * half_width)


def _single_rod(found: Explanation, p: EhaParameters) -> Note:
    differ, volumes = found.values["area_difference"][0], found.values["volume_difference"][0]
    half_width = 2.0 * _half_width(found, "area_difference") / (1.0 + differ) ** 2
    return RigCode.SINGLE_ROD.note(
        percent=100.0 * b_over_a(differ),
        half_width=100.0 * half_width,
        volume_percent=100.0 * b_over_a(volumes),
        pilot_share=found.values["pilot_share"][0],
        rig_percent=100.0 * b_over_a(p.area_difference),
        rig_volume_percent=100.0 * b_over_a(p.volume_difference),
        rig_pilot_share=p.pilot_share,
    )


def _load(found: Explanation, p: EhaParameters) -> Note:
    value, level = (found.values[name][0] for name in ("start_pressure", "start_level"))
    return RigCode.STARTS_UNDER_LOAD.note(pressure_pa=value, force_n=value * p.piston_area, level_pa=level)


def _bends(found: Explanation, _: EhaParameters) -> Note:
    return RigCode.MAKEUP_BENDS.note(drop_pa=3.0 / found.values[BEND][0])


def _relief(found: Explanation, p: EhaParameters) -> Note:
    setting, std = found.values["relief_pressure"]
    return RigCode.RELIEF_LOW.note(setting_pa=setting, half_width_pa=NORMAL_95 * std, rig_pa=p.relief_pressure)


def _turbulent(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["leakage_turbulent"][0]
    half_width = 100.0 * _half_width(found, "leakage_turbulent")
    return RigCode.LEAKAGE_TURBULENT.note(percent=100.0 * value, half_width=half_width, at_pa=TURBULENT_AT)


def _compresses(found: Explanation, _: EhaParameters) -> Note:
    value, half_width = found.values["pump_compression"][0], _half_width(found, "pump_compression")
    if value < 0.0:  # no pump delivers more under pressure, but a pressure that rises with motor speed looks like it
        return RigCode.PRESSURE_TAPPED.note()
    return RigCode.PUMP_COMPRESSES.note(share=value, half_width=half_width)


def _blocked(found: Explanation, _: EhaParameters) -> Note:
    return blocked_note("B" if found.values["makeup_share_b"][0] < 1.0 else "A")


def _crack(found: Explanation, _: EhaParameters) -> Note:
    mean, later = (found.values[name][0] for name in ("crack_pressure", "crack_difference"))
    return RigCode.CHECKS_CRACK.note(
        crack_pa=mean,
        half_width_pa=_half_width(found, "crack_pressure"),
        side="A" if later > 0.0 else "B",
        later_pa=abs(later),
        later_half_width_pa=_half_width(found, "crack_difference"),
    )


_NOTES: Mapping[str, Callable[[Explanation, EhaParameters], Note]] = {
    "pressure_late": _late,
    "speed_late": _input_late(SPEED),
    "speed_early": _speed_early,
    "position_late": _input_late(POSITION),
    "pressure_offset": _offset,
    "pressure_drift": _drift,
    "pressure_sides": _sides,
    "encoder_zero": _zero,
    "position_play": _play,
    "delivery": _delivery,
    "volume": _volume,
    "single_rod": _single_rod,
    "start_load": _load,
    "air": air_note,
    "air_midway": air_note,
    "relief_low": _relief,
    "leakage_growth": growth_note,
    "leakage_rise": growth_note,
    "leakage_step": step_note,
    "leakage_turbulent": _turbulent,
    "pump_compresses": _compresses,
    "makeup_blocked": _blocked,
    "makeup_bends": _bends,
    "checks_crack": _crack,
    "port_a_drains": drain_note("a"),
    "port_b_drains": drain_note("b"),
}


def at_pump_speed(log: CleanLog, turning: Turning) -> CleanLog:
    """Return a log with the speed at which a pump without ripple delivers the same flow.

    Returns
    -------
    CleanLog
        Unchanged if there is neither.
    """
    if turning == EVENLY:
        return log
    record = log.record
    speed = delivering(bridged(record[SPEED]), turning.teeth, turning.offset, record.sample_time)
    return replace(log, record=record.replace(**{SPEED: speed}))


def set_right(log: CleanLog, found: Explanation) -> CleanLog:
    """Return a log without the sensors' offsets and delays that explain it.

    Returns
    -------
    CleanLog
        The log, with a `LEAKAGE_COURSE` if leakage drifts over it; pressures at its end that are no longer known are
        missing.
    """
    value = {name: pair[0] for name, pair in found.values.items()}
    record, changed = log.record, dict[str, Array]()
    zero, play = value.get("position_zero", 0.0), value.get("position_play", 0.0)
    if zero or play:
        courses = crossings(bridged(record[POSITION]), record[PRESSURE], record.sample_time)
        side = (courses @ [1.0, *(value.get(name, 0.0) for name in CROSSED)]).clip(-1.0, 1.0)
        changed[POSITION] = record[POSITION] - zero + 0.5 * play * side
    elapsed = np.arange(len(record)) / len(record)
    late, drift = lateness(found, PRESSURE), value.get("pressure_drift", 0.0)
    offset = value.get("pressure_offset", 0.0) + drift * drifted(elapsed, value.get(SETTLING, 0.0))
    if any(name in value for name in GROWTH):
        grown = leakage_over(found, elapsed)
        changed[LEAKAGE_COURSE] = grown / grown[-1]
    if late or np.any(offset):
        changed[PRESSURE] = _brought_forward(record, PRESSURE, late) - offset
    if behind := lateness(found, SPEED):
        changed[SPEED] = _brought_forward(record, SPEED, behind)
    if behind := lateness(found, POSITION):
        moved = _brought_forward(record.replace(**changed), POSITION, behind)
        changed |= {POSITION: moved, **_with_position(record, moved, behind)}
    return replace(log, record=record.replace(**changed))


def _with_position(record: Record, moved: Array, behind: float) -> Mapping[str, Array]:
    """Return the velocity shifted along with the position, if both come from one late encoder; otherwise nothing."""
    if VELOCITY not in record:
        return {}
    slope, forward = np.gradient(moved) / record.sample_time, _brought_forward(record, VELOCITY, behind)
    apart = [float(np.nanmean((one - slope) ** 2)) for one in (record[VELOCITY], forward)]
    return {VELOCITY: forward} if apart[1] < apart[0] else {}


def _brought_forward(record: Record, channel: str, late: float) -> Array:
    """Return a channel without its delay; if it is sampled in some rows only, each sample goes to its nearest row."""
    values, rows = record[channel], np.arange(len(record))
    there = np.flatnonzero(np.isfinite(values))
    if len(there) in (0, 1, len(record)):
        return np.interp(rows + late / record.sample_time, rows, values, right=np.nan)
    began = there - late / record.sample_time
    row = np.rint(began).astype(np.int64)
    moved, slope = np.full(len(record), np.nan), np.gradient(values[there], there)
    within = (row >= 0) & (row < len(record))
    moved[row[within]] = (values[there] + slope * (row - began))[within]
    return moved


def rig_set_right(parameters: EhaParameters, found: Explanation) -> EhaParameters:
    """Return the rig with the pump's delivery and the chambers' volumes and areas that explain a log."""
    names = [name for name in RIG_ENTRIES if name in found.values]
    return replace(parameters, **{name: found.values[name][0] for name in names})
