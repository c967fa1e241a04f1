"""Notes on rig and logger for a log that the plain flow form does not explain, and the corrected log."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from estimation.eha.another_rod import b_over_a
from estimation.eha.changing_leakage import growth_note, relative_leakage, step_note
from estimation.eha.entrained_air import air_note
from estimation.eha.port_drains import drain_note
from estimation.finding import NORMAL_95
from estimation.fits.cause_words import causes_in_words
from estimation.fits.greybox.play_courses import crossings
from estimation.fits.greybox.pump_ripple import NO_RIPPLE, Turning, delivering_speed
from estimation.fits.hypotheses import WORN_SHARE
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.not_excluded import blocked_note
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.clean import CleanLog
from estimation.models.inner_circuit import BEND
from estimation.models.wide_flow import GROWTH, OTHER_COURSES, TURBULENT_AT
from estimation.models.wrong_pressure import SETTLING, relative_drift
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

FAULTS_BEYOND_CONDITIONS = {
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
        causes = "; or by ".join(causes_in_words(one.split(" and ")) for one in found.rivals)
        notes.append(RigCode.EXPLAINED_OTHERWISE.note(others=", ".join(found.rivals), causes=causes))
    return tuple(notes)


def _half_width(found: Explanation, name: str) -> float:
    return NORMAL_95 * found.values[name][1]


def _pressure_late_note(found: Explanation, _: EhaParameters) -> Note:
    width = 1e3 * _half_width(found, LAGS[PRESSURE])
    return RigCode.PRESSURE_LATE.note(late_ms=1e3 * total_delay(found, PRESSURE), half_width_ms=width)


def _input_late_note(channel: str) -> Callable[[Explanation, EhaParameters], Note]:
    def note(found: Explanation, _: EhaParameters) -> Note:
        width = 1e3 * _half_width(found, LAGS[channel])
        return RigCode.INPUT_LATE.note(channel=channel, late_ms=1e3 * total_delay(found, channel), half_width_ms=width)

    return note


def _speed_early_note(found: Explanation, p: EhaParameters) -> Note:
    width, early = 1e3 * _half_width(found, LAGS[SPEED]), -1e3 * total_delay(found, SPEED)
    if early <= 0.0:  # the fitted lag is longer than the lead with which the search began
        return _input_late_note(SPEED)(found, p)
    return RigCode.INPUT_EARLY.note(channel=SPEED, early_ms=early, half_width_ms=width)


def total_delay(found: Explanation, channel: str) -> float:
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


def _pressure_offset_note(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["pressure_offset"][0]
    return RigCode.PRESSURE_OFFSET.note(offset_pa=value, half_width_pa=_half_width(found, "pressure_offset"))


def _pressure_drift_note(found: Explanation, _: EhaParameters) -> Note:
    first, settling = (found.values.get(name, (0.0, 0.0))[0] for name in ("pressure_drift", SETTLING))
    gone = float(relative_drift(1.0, settling))
    return RigCode.PRESSURE_DRIFTS.note(
        drift_pa=first * gone, half_width_pa=_half_width(found, "pressure_drift") * gone
    )


def _pressure_sides_note(found: Explanation, _: EhaParameters) -> Note:
    value, half_width = found.values["pressure_sides"][0], _half_width(found, "pressure_sides")
    return RigCode.PRESSURE_SIDES.note(percent=200.0 * value, half_width=200.0 * half_width)


def _position_zero_note(found: Explanation, p: EhaParameters) -> Note:
    """Return the note on chambers of unequal volume, which look like those of an encoder with another zero."""
    value, half_width = found.values["position_zero"][0], 1e3 * _half_width(found, "position_zero")
    more = 2.0 * p.piston_area * abs(value)
    side = "A" if value < 0.0 else "B"
    return RigCode.ENCODER_ZERO.note(zero_mm=1e3 * value, half_width_mm=half_width, side=side, more=more)


def _encoder_play_note(found: Explanation, _: EhaParameters) -> Note:
    return RigCode.POSITION_PLAY.note(play_um=1e6 * found.values["position_play"][0])


def _delivery_note(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["pump_displacement"][0]
    share, half_width = value / p.pump_displacement, _half_width(found, "pump_displacement") / p.pump_displacement
    return (RigCode.PUMP_WORN if share < WORN_SHARE else RigCode.AREA_TO_DISPLACEMENT).note(
        percent=100.0 * share, half_width=100.0 * half_width
    )


def _chamber_volume_note(found: Explanation, p: EhaParameters) -> Note:
    value = found.values["chamber_volume"][0]
    half_width = _half_width(found, "chamber_volume") / p.chamber_volume
    return RigCode.VOLUME_DIFFERS.note(percent=100.0 * value / p.chamber_volume, half_width=100.0 * half_width)


def _single_rod_note(found: Explanation, p: EhaParameters) -> Note:
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


def _load_note(found: Explanation, p: EhaParameters) -> Note:
    value, level = (found.values[name][0] for name in ("start_pressure", "start_level"))
    return RigCode.STARTS_UNDER_LOAD.note(pressure_pa=value, force_n=value * p.piston_area, level_pa=level)


def _makeup_bend_note(found: Explanation, _: EhaParameters) -> Note:
    return RigCode.MAKEUP_BENDS.note(drop_pa=3.0 / found.values[BEND][0])


def _relief_note(found: Explanation, p: EhaParameters) -> Note:
    setting, std = found.values["relief_pressure"]
    return RigCode.RELIEF_LOW.note(setting_pa=setting, half_width_pa=NORMAL_95 * std, rig_pa=p.relief_pressure)


def _turbulent_leakage_note(found: Explanation, _: EhaParameters) -> Note:
    value = found.values["leakage_turbulent"][0]
    half_width = 100.0 * _half_width(found, "leakage_turbulent")
    return RigCode.LEAKAGE_TURBULENT.note(percent=100.0 * value, half_width=half_width, at_pa=TURBULENT_AT)


def _compression_note(found: Explanation, _: EhaParameters) -> Note:
    value, half_width = found.values["pump_compression"][0], _half_width(found, "pump_compression")
    if value < 0.0:  # no pump delivers more under pressure, but a pressure that rises with motor speed looks like it
        return RigCode.PRESSURE_TAPPED.note()
    return RigCode.PUMP_COMPRESSES.note(share=value, half_width=half_width)


def _blocked_makeup_note(found: Explanation, _: EhaParameters) -> Note:
    return blocked_note("B" if found.values["makeup_share_b"][0] < 1.0 else "A")


def _crack_note(found: Explanation, _: EhaParameters) -> Note:
    mean, later = (found.values[name][0] for name in ("crack_pressure", "crack_difference"))
    return RigCode.CHECKS_CRACK.note(
        crack_pa=mean,
        half_width_pa=_half_width(found, "crack_pressure"),
        side="A" if later > 0.0 else "B",
        later_pa=abs(later),
        later_half_width_pa=_half_width(found, "crack_difference"),
    )


_NOTES: Mapping[str, Callable[[Explanation, EhaParameters], Note]] = {
    "pressure_late": _pressure_late_note,
    "speed_late": _input_late_note(SPEED),
    "speed_early": _speed_early_note,
    "position_late": _input_late_note(POSITION),
    "pressure_offset": _pressure_offset_note,
    "pressure_drift": _pressure_drift_note,
    "pressure_sides": _pressure_sides_note,
    "encoder_zero": _position_zero_note,
    "position_play": _encoder_play_note,
    "delivery": _delivery_note,
    "volume": _chamber_volume_note,
    "single_rod": _single_rod_note,
    "start_load": _load_note,
    "air": air_note,
    "air_midway": air_note,
    "relief_low": _relief_note,
    "leakage_growth": growth_note,
    "leakage_rise": growth_note,
    "leakage_step": step_note,
    "leakage_turbulent": _turbulent_leakage_note,
    "pump_compresses": _compression_note,
    "makeup_blocked": _blocked_makeup_note,
    "makeup_bends": _makeup_bend_note,
    "checks_crack": _crack_note,
    "port_a_drains": drain_note("a"),
    "port_b_drains": drain_note("b"),
}


def log_with_means_in_time(log: CleanLog, late: float) -> CleanLog:
    """Return a log whose averaged pressures are in the middle of their rows.

    Parameters
    ----------
    late : float
        How late they are logged [s].
    """
    return (
        replace(log, record=log.record.replace(**{PRESSURE: _without_delay(log.record, PRESSURE, late)}))
        if late
        else log
    )


def log_at_pump_speed(log: CleanLog, turning: Turning) -> CleanLog:
    """Return a log with the speed at which a pump without ripple delivers the same flow.

    Returns
    -------
    CleanLog
        Unchanged if there is neither.
    """
    if turning == NO_RIPPLE:
        return log
    record = log.record
    speed = delivering_speed(bridged(record[SPEED]), turning.teeth, turning.offset, record.sample_time)
    return replace(log, record=record.replace(**{SPEED: speed}))


def corrected_log(log: CleanLog, found: Explanation) -> CleanLog:
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
        side = (courses @ [1.0, *(value.get(name, 0.0) for name in OTHER_COURSES)]).clip(-1.0, 1.0)
        changed[POSITION] = record[POSITION] - zero + 0.5 * play * side
    elapsed = np.arange(len(record)) / len(record)
    late, drift = total_delay(found, PRESSURE), value.get("pressure_drift", 0.0)
    offset = value.get("pressure_offset", 0.0) + drift * relative_drift(elapsed, value.get(SETTLING, 0.0))
    if any(name in value for name in GROWTH):
        grown = relative_leakage(found, elapsed)
        changed[LEAKAGE_COURSE] = grown / grown[-1]
    if late or np.any(offset):
        changed[PRESSURE] = _without_delay(record, PRESSURE, late) - offset
    if behind := total_delay(found, SPEED):
        changed[SPEED] = _without_delay(record, SPEED, behind)
    if behind := total_delay(found, POSITION):
        moved = _without_delay(record.replace(**changed), POSITION, behind)
        changed |= {POSITION: moved, **_velocity_without_delay(record, moved, behind)}
    return replace(log, record=record.replace(**changed))


def _velocity_without_delay(record: Record, moved: Array, behind: float) -> Mapping[str, Array]:
    """Return the velocity shifted along with the position, if both come from one late encoder; otherwise nothing."""
    if VELOCITY not in record:
        return {}
    slope, forward = np.gradient(moved) / record.sample_time, _without_delay(record, VELOCITY, behind)
    apart = [float(np.nanmean((one - slope) ** 2)) for one in (record[VELOCITY], forward)]
    return {VELOCITY: forward} if apart[1] < apart[0] else {}


def _without_delay(record: Record, channel: str, late: float) -> Array:
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


def corrected_rig(parameters: EhaParameters, found: Explanation) -> EhaParameters:
    """Return the rig with the pump's delivery and the chambers' volumes and areas that explain a log."""
    names = [name for name in RIG_ENTRIES if name in found.values]
    return replace(parameters, **{name: found.values[name][0] for name in names})
