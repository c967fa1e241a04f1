"""Advice on what to do or measure next, from the contents of a log and its open questions."""

from collections.abc import Iterable, Mapping

import numpy as np

from estimation.finding import Quantity
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.notes import LoggerCode
from estimation.notes import ChannelCode, EstimateCode, RigCode, SensorCode
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

SURE = 0.9
"""Probability from which a condition counts as determined [probability]."""

LONG_ENOUGH = 10.0
"""Length of a log from which a longer one does not help [s]."""

SLOW_SAMPLE_TIME = 0.01
"""Time between samples from which many sound actuators have no verdict [s]; at half of it, intervals are wider only."""

STRETCH, FEWEST = 0.05, 4
"""Length of a stretch in which speed may be constant [s], and least number of samples in it."""

LEVEL = 0.05
"""Speeds closer than this share of the largest count as one [fraction]."""

DRIFT = 0.005
"""Speed is constant if its means over the halves of a stretch differ by less, as a share of the largest [fraction]."""

WIDEST_GROUP = 0.2
"""Neighbouring speeds that span more than this share of the largest are more than one [fraction]."""

LEAST_SHARE_HELD = 0.02
"""A speed counts if it lasts for this share of the log [fraction]."""


def held_speed_count(record: Record) -> int:
    """Return the number of different motor speeds in a log, regardless of direction.

    Returns
    -------
    int
        Speeds other than rest that are constant for about 0.1 s or more; 0 for a drive that never settles. Slowly
        changing speeds count as two, however many they are.

    Examples
    --------
    >>> steps = np.repeat([0.0, 50.0, -50.0, 100.0], 100)
    >>> held_speed_count(Record(1e-3, {"motor_speed_rad_s": steps}))
    2
    """
    speed = record["motor_speed_rad_s"]
    there = np.abs(speed[np.isfinite(speed)])
    largest = float(np.max(there, initial=0.0))
    length = max(FEWEST, round(STRETCH / record.sample_time * len(there) / len(speed)))
    stretches = there[: len(there) // length * length].reshape(-1, length)
    if largest == 0.0 or not len(stretches):
        return 0
    first, second = stretches[:, : length // 2], stretches[:, length // 2 :]
    drift = np.abs(np.mean(second, axis=1) - np.mean(first, axis=1)) / largest
    mean, spread = np.mean(stretches, axis=1) / largest, np.std(stretches, axis=1) / largest
    held = np.sort(mean[(drift < DRIFT) & (spread < LEVEL) & (mean > LEVEL)])
    groups = np.split(held, np.flatnonzero(np.diff(held) > LEVEL) + 1)
    return sum(
        2 if np.ptp(group) > WIDEST_GROUP else 1 for group in groups if len(group) > LEAST_SHARE_HELD * len(stretches)
    )


def advice_for(
    record: Record,
    probabilities: Mapping[str, float],
    against: Iterable[Note],
    not_told: Iterable[Note],
    channels: Iterable[str],
) -> tuple[Note, ...]:
    """Return advice on what to do or measure next.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Probability of each condition [probability]; empty if there are none.
    against : iterable of Note
        Reasons against all of them.
    not_told : iterable of Note
        What the log does not determine.
    channels : iterable of str
        Channels that were used.

    Returns
    -------
    tuple of Note
        The most useful first.
    """
    not_told = tuple(not_told)
    doubts, unclear = list(against), {note.code for note in not_told}
    slow = (
        [AdviceCode.LOG_FASTER.note(step_ms=1e3 * record.sample_time)] if record.sample_time >= SLOW_SAMPLE_TIME else []
    )
    if doubts:
        return _repair_advice(doubts, slow)
    found: list[Note] = []
    if PRESSURE not in channels:
        found.append(AdviceCode.LOG_PRESSURE.note())
    if ClassCode.FRICTION_NOT_VISIBLE in unclear:
        found.append(AdviceCode.MOVE_PISTON.note())
    unseen = [note for note in not_told if note.code is RigCode.MAKEUP_UNSEEN]
    found.extend(AdviceCode.DRAW_OIL.note(side=note.data["side"]) for note in unseen)
    alike = ClassCode.LEAKAGE_AND_BIAS_ALIKE in unclear
    if alike or ClassCode.WEAR_NOT_TOLD in unclear:
        speeds = held_speed_count(record)
        if speeds < 2 or alike:
            found.append((AdviceCode.MORE_SPEEDS if speeds < 2 else AdviceCode.CLOSER_SPEEDS).note(speeds=speeds))
    if probabilities and max(probabilities.values()) < SURE * sum(probabilities.values()):
        found += slow
        if record.duration < LONG_ENOUGH:
            found.append(AdviceCode.LOG_LONGER.note(duration_s=record.duration))
        elif not slow and AdviceCode.MOVE_PISTON not in [note.code for note in found]:  # that asks for larger steps
            found.append(AdviceCode.CONDITIONS_OPEN.note())
    return tuple(found) or ((AdviceCode.NOTHING.note(),) if probabilities else ())


def oil_advice(
    severity: Mapping[str, Quantity], healthy: Mapping[str, float], limits: Mapping[str, float], volume: float
) -> tuple[Note, ...]:
    """Return advice on oil that is softer than its limit, whatever the condition.

    A log determines only bulk modulus over volume, so too small a volume in the rig file looks the same.

    Parameters
    ----------
    severity : Mapping[str, Quantity]
        Severities, by the names of `faults.diagnosis.severity.UNITS`.
    healthy, limits : Mapping[str, float]
        The same for the healthy actuator, and their limits [each in the same unit].
    volume : float
        Chamber volume for which bulk modulus was estimated [m^3].

    Returns
    -------
    tuple of Note
        Empty if the interval given the rig includes the limit.
    """
    modulus, sound = severity["bulk_modulus"], healthy["bulk_modulus"]
    if modulus.value is None or modulus.ci95 is None or modulus.ci95[1] >= limits["bulk_modulus"]:
        return ()
    percent = 100.0 * (1.0 - modulus.value / sound)
    return (AdviceCode.BLEED.note(percent=percent, volume=volume * sound / modulus.value),)


def sensor_advice(left_out: Iterable[Note]) -> tuple[Note, ...]:
    """Return advice on a velocity sensor that was left out because all other channels contradict it.

    Parameters
    ----------
    left_out : iterable of Note
        What was left out of the log.
    """
    wrong = [note for note in left_out if note.code is ClassCode.VELOCITY_CONTRADICTED]
    return tuple(AdviceCode.MEND_SENSOR.note(channel=note.data["channel"]) for note in wrong)


def rig_advice(strange: Iterable[Note], healthy: EhaParameters, written: EhaParameters) -> tuple[Note, ...]:
    """Return advice on the two sides of the cylinder or the chamber volume, if the log contradicts the rig file.

    Parameters
    ----------
    strange : iterable of Note
        Unusual effects of rig, oil and logger.
    healthy, written : EhaParameters
        The healthy actuator, with and without the corrections found from the log.

    Returns
    -------
    tuple of Note
        Empty if the volume may be right: soft oil has its own advice.
    """
    for note in strange:
        if note.code == RigCode.SINGLE_ROD:
            return (AdviceCode.GIVE_TWO_SIDES.note(),)
        if note.code == RigCode.VOLUME_DIFFERS:
            return (AdviceCode.CORRECT_VOLUME.note(volume=healthy.chamber_volume, written=written.chamber_volume),)
        if note.code == RigCode.OIL_STIFFER:
            ratio = float(note.data["ratio"])
            volume = healthy.chamber_volume / ratio
            return (AdviceCode.CORRECT_VOLUME_OR_OIL.note(volume=volume, written=written.chamber_volume, ratio=ratio),)
    return ()


def _repair_advice(doubts: list[Note], slow: Iterable[Note]) -> tuple[Note, ...]:
    """Return what to repair before the next log: the suspected sensors, otherwise rig file and units."""
    if any(note.code == ChannelCode.NOTHING_CHANGES for note in doubts):
        return (AdviceCode.CHECK_LOGGER.note(),)
    if any(isinstance(note.code, ChannelCode) for note in doubts):
        named = dict.fromkeys(str(note.data["channel"]) for note in doubts if isinstance(note.code, ChannelCode))
        return (AdviceCode.MEND_COLUMNS.note(channels=" and ".join(named)),)
    if sparse := [str(note.data["channel"]) for note in doubts if isinstance(note.code, LoggerCode)]:
        return (AdviceCode.LOG_EVERY_ROW.note(channels=" and ".join(sparse)),)
    accused = dict.fromkeys(
        str(note.data["channel"]) for note in doubts if "channel" in note.data and _is_sensor_note(note)
    )
    if any(note.code == SensorCode.SENSORS_DISAGREE for note in doubts):
        accused |= {"position_m": None, "velocity_m_s": None}
    if accused:
        return (AdviceCode.CHECK_SENSOR.note(channels=" and ".join(accused)),)
    if work := tuple(one for one in map(_repair_of_fault, doubts) if one is not None):
        return work
    if smoothed := [note.data["channel"] for note in doubts if note.code == EstimateCode.PRESSURE_SMOOTHED]:
        return (AdviceCode.LOG_UNFILTERED.note(channel=smoothed[0]),)
    if any(note.code == EstimateCode.RIG_CONTRADICTED for note in doubts):
        return (AdviceCode.CHECK_RIG.note(),)
    if any(isinstance(note.code, EstimateCode) or note.code == AgainstCode.NONE_FITS for note in doubts):
        return (*slow, AdviceCode.FIT_DOUBTED.note())
    return (AdviceCode.CHECK_RIG.note(),)


def _repair_of_fault(fault: Note) -> Note | None:
    """Return the repair of a fault that is none of the nine conditions."""
    match fault.code:
        case RigCode.LEAKAGE_GROWS:
            return AdviceCode.STOP_LEAKAGE.note()
        case RigCode.BORE_LEAKS:
            return AdviceCode.INSPECT_BORE.note(at_mm=fault.data["at_mm"])
        case RigCode.TOOTH_LEAKS:
            return AdviceCode.INSPECT_PUMP.note()
        case RigCode.PUMP_STARVES:
            return AdviceCode.CHECK_INLET.note()
        case AgainstCode.STUCK_OR_LEAKS | AgainstCode.ROD_BLOCKED:
            return AdviceCode.FREE_PISTON.note()
        case AgainstCode.LOAD_VARIES:
            return AdviceCode.HOLD_LOAD.note()
        case AgainstCode.FRICTION_VARIES | AgainstCode.GRIPS_ONE_WAY:
            return AdviceCode.FREE_ROD.note()
        case RigCode.LEAKAGE_LIFTS | RigCode.LEAKS_ONE_WAY:
            return AdviceCode.CHECK_VALVES.note()
        case RigCode.PUMP_WORN | AgainstCode.PUMP_DELIVERS_LESS | ClassCode.WEAR_NOT_TOLD:
            return AdviceCode.CHECK_PUMP.note()
        case RigCode.MAKEUP_BLOCKED | RigCode.PORT_DRAINS | AgainstCode.MAKEUP_STUCK:
            return AdviceCode.CHECK_MAKEUP.note(side=fault.data["side"])
        case AgainstCode.MAKEUP_LEAKS:
            return AdviceCode.CHECK_MAKEUP.note(side="A or B")
        case RigCode.RELIEF_LOW | AgainstCode.RELIEF_EARLY:
            return AdviceCode.CHECK_RELIEF.note()
        case RigCode.AIR_ENTERS | AgainstCode.OIL_SOFTENS:
            return AdviceCode.FIND_AIR.note()
        case _:
            return None


def _is_sensor_note(note: Note) -> bool:
    return isinstance(note.code, SensorCode)
