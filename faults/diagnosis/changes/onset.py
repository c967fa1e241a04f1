"""Did the condition change within a log, and when? Two circuits, one before and one after, against one for all.

The derivatives of a fit give, for every time of change at once, what two circuits would explain more than one (the
generalised likelihood ratio, linearised: Basseville and Nikiforov, Detection of Abrupt Changes, 1993, section 2.4.3).
If that is much, both are fitted; it is a change if they are in different conditions.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimation.finding import Change
from estimation.log_checks.still_beginning import without_still_beginning
from faults.conditions import CONDITIONS
from faults.diagnosis.changes.change_odds import gain_of_parts, is_change_believed
from faults.diagnosis.changes.end_stop import with_end_stop
from faults.diagnosis.changes.fault_throughout import fault_throughout
from faults.diagnosis.changes.split import GAIN, in_one_condition, likeliest_split
from faults.diagnosis.changes.warming import Drift, find_drift
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.between_samples import with_fitted_lead
from faults.diagnosis.circuits.blocks import LONGEST, Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import least_scales, nominal_runs
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.model_doubt import lasting_misfit
from faults.diagnosis.circuits.out_of_model import unexplained_notes
from faults.notes import AgainstCode
from faults.watch.events import INTERVAL_DROP, LOSS_BALANCE, Alarm
from faults.watch.watch import LEAST_LEARNING, SLOWEST, watch_record
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

SOFTENING_GAIN = 30.0
"""Log-likelihood that two circuits must gain before softer oil is tested [dimensionless]: steady training logs of the
open benchmark gain up to 27, those with air entry 95 to 126."""

ONE_SIDED_95 = 1.645
"""Deviations by which bulk modulus must have fallen then [dimensionless]: a chance of one in twenty, beside that
gain."""

MOST_LATE, MOST_EARLY = 0.8, 0.1
"""How much later, or earlier, than its true time a change may be detected [s]."""

MOST_ALARMS = 3
"""Most alarms of a watch that are examined, from the last."""


@dataclass(frozen=True, eq=False)
class LastPart:
    """The part of a log in the condition in which it ends.

    Parameters
    ----------
    window : Record
        The part that was examined.
    record : Record
        The part of it that is in the last condition.
    blocks : Blocks
        The window in blocks; those in another condition are missing.
    fits : ClassFits
        Circuits fitted to them.
    onset : Change or None
        When the condition began; None if it did so before the log.
    against : tuple of Note
        What changed within the log and is no change of condition.
    drift : Drift or None
        Drift of its leakage that the circuits do not include; without pressure.
    """

    window: Record
    record: Record
    blocks: Blocks
    fits: ClassFits
    onset: Change | None
    against: tuple[Note, ...] = ()
    drift: Drift | None = None


class TwoParts(NamedTuple):
    """A log in two parts, each fitted separately.

    Parameters
    ----------
    place : int
        First block of the second.
    parts : list of Blocks
        Both.
    fits : list of ClassFits
        Circuits fitted to each.
    gain : float
        Log-likelihood that they gain over one circuit for all [dimensionless].
    whole : ClassFits
        Circuits fitted to all.
    """

    place: int
    parts: list[Blocks]
    fits: list[ClassFits]
    gain: float
    whole: ClassFits

    @property
    def conditions(self) -> tuple[int, int]:
        """Indices of the conditions of the two parts."""
        first, last = (int(np.argmax(one.one_law_scores)) for one in self.fits)
        return first, last


def last_part(record: Record, actuator: Actuator) -> LastPart:
    """Return the part of a log that is in the condition in which it ends.

    Parameters
    ----------
    record : Record
        The log. If it is longer than `LONGEST`, the part about the last change that `watch_record` finds is used, or
        its beginning if there is none, from just before it first moves.

    Returns
    -------
    LastPart
        The part, fitted.

    Raises
    ------
    LogError
        If the log has neither position nor velocity, or is too short.
    """
    for window in _windows_about_alarms(record, actuator):
        found = _last_part_of_window(window, actuator)
        if found.onset is not None:
            return found
    return _last_part_of_window(without_still_beginning(record, LONGEST), actuator)


def _last_part_of_window(window: Record, actuator: Actuator) -> LastPart:
    blocks = with_fitted_lead(blocks_of(window), actuator)
    blocks, fits = with_end_stop(blocks, fit_classes(blocks, actuator), actuator)
    two = two_parts(blocks, fits, actuator)
    drift = find_drift(blocks, fits, actuator, 0.0 if two is None else two.gain)
    if drift is not None and (two is None or drift.gain > two.gain):
        return LastPart(window, window, blocks, fits, None, drift=drift)
    against = () if two is None else softening_notes(two)
    drifts = (
        blocks.pressure is None and blocks.leakage_course is not None
    )  # drift explains the log better than a change
    found = None if two is None or against or drifts else find_onset(blocks, two, actuator)
    if found is None:
        return LastPart(window, window, blocks, fits, None, against)
    onset, blocks, fits = found
    rest = window.slice(round(onset.since / window.sample_time), None)
    ends = onset.ci95[0] + window.start_time, onset.ci95[1] + window.start_time
    return LastPart(window, rest, blocks, fits, Change(onset.since + window.start_time, ends, onset.before))


def _windows_about_alarms(record: Record, actuator: Actuator) -> Iterator[Record]:
    """Yield parts about the last alarms of a watch, the last first, for logs too long to be fitted whole."""
    if record.duration <= LONGEST + LEAST_LEARNING or record.sample_time > SLOWEST:
        return
    events = watch_record(record, actuator.circuit, learning=LEAST_LEARNING)
    sudden = (event for event in events if isinstance(event, Alarm) and event.balance != LOSS_BALANCE)
    changes = [event.since - record.start_time for event in sudden]
    for since in changes[: -MOST_ALARMS - 1 : -1]:
        first = round(max(since - 0.5 * LONGEST, 0.0) / record.sample_time)
        yield record.slice(first, first + round(LONGEST / record.sample_time) + 1)


def two_parts(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> TwoParts | None:
    """Return a log in two parts, if two successive circuits may explain it much better than one.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits fitted to all of it.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    TwoParts or None
        Both parts; None if one circuit suffices, or both would be in one condition.
    """
    split = likeliest_split(blocks, fits.best)
    if split is None:
        return None
    # without pressure, the oil may have softened between parts in one condition
    if blocks.pressure is not None and in_one_condition(split, blocks, actuator):
        return None
    place = split.place
    parts = [part_of(blocks, 0, place), part_of(blocks, place, len(blocks.velocity))]
    runs, start = nominal_runs(blocks, actuator), fits.best.coordinates
    found = [fit_classes(part, actuator, runs=runs, start=start) for part in parts]
    return TwoParts(place, parts, found, gain_of_parts(fits, parts, found), fits)


def find_onset(blocks: Blocks, two: TwoParts, actuator: Actuator) -> tuple[Change, Blocks, ClassFits] | None:
    """Return when the condition changed, and the part of the log after that.

    Parameters
    ----------
    blocks : Blocks
        The log.
    two : TwoParts
        Its parts.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    tuple of Change, Blocks and ClassFits, or None
        The change, the log with everything before it missing, and the circuits that fit the rest, which continue from
        the piston's state before the change. None for a log in one condition throughout, if no circuit follows one of
        the parts, or if one with a fault outside the nine explains the log as well.
    """
    (before, after), (first, last) = two.fits, two.conditions
    if two.gain < GAIN or first == last:
        return None
    if unexplained_notes(two.parts[0], before, actuator):  # a fault that comes and goes: the rest is a quiet stretch
        return None
    if not is_change_believed(blocks, two.parts, two.fits, two.whole, actuator):
        return None
    if fault_throughout(blocks, two.parts, two.fits, two.whole, actuator):
        return None
    row = parameter_rows(before.best.coordinates[None], actuator.circuit, actuator.rated)[0]
    low, best, high = _change_block(blocks, row, after.best.coordinates, two.place, actuator)
    step = blocks.block * blocks.sample_time
    onset = Change(best * step, (low * step, high * step), list(CONDITIONS)[first])
    rest = replace(part_of(blocks, best, len(blocks.velocity)), earlier_circuit=(best * blocks.block, row))
    fits = fit_classes(rest, actuator)
    if unexplained_notes(rest, fits, actuator):  # no circuit follows it, so it is in no condition
        return None
    return onset, rest, fits


def softening_notes(two: TwoParts) -> tuple[Note, ...]:
    """Return a note if the oil of a log without pressure softened: air entered, which no condition has.

    It is tested whatever the conditions of the parts: air in the oil may look like friction, and no condition softens
    the oil.

    Returns
    -------
    tuple of Note
        Empty with pressure, since the flow balance tests for it.
    """
    if two.parts[0].pressure is not None or two.gain < SOFTENING_GAIN:
        return ()
    at = COORDINATES.index("bulk_modulus")
    fallen = float(two.fits[1].best.coordinates[at] - two.fits[0].best.coordinates[at])
    if fallen > -ONE_SIDED_95 * float(np.sqrt(sum(one.spread[at, at] for one in two.fits))):
        return ()
    begun = two.place * two.parts[0].block * two.parts[0].sample_time
    return (AgainstCode.OIL_SOFTENS.note(share=float(np.exp(fallen)), at_s=begun),)


def part_of(blocks: Blocks, begin: int, end: int) -> Blocks:
    """Return a log with all but some of its blocks missing; the drive stays complete.

    Parameters
    ----------
    begin, end : int
        First remaining block, and the one after the last.
    """
    there = np.arange(len(blocks.velocity))
    away = (there < begin) | (there >= end)
    pressure = None if blocks.pressure is None else np.where(away, np.nan, blocks.pressure)
    return replace(blocks, velocity=np.where(away, np.nan, blocks.velocity), pressure=pressure)


def _change_block(blocks: Blocks, before: Array, after: Array, place: int, actuator: Actuator) -> tuple[int, int, int]:
    """Return the likeliest block of the change, and the ends of its 95 % interval, from a run of both circuits.

    A circuit needs time to show what changed, so most candidates are before the block at which the change was detected.
    """
    step = blocks.block * blocks.sample_time
    first = max(place - round(MOST_LATE / step), blocks.first)
    candidates = np.arange(first, min(place + round(MOST_EARLY / step), len(blocks.velocity) - 1))
    (row,) = parameter_rows(after[None], actuator.circuit, actuator.rated)
    changing = replace(blocks, earlier_circuit=(blocks.block * candidates, before))
    runs = predicted_outputs(changing, np.repeat(row[None], len(candidates), axis=0))
    scales = least_scales(blocks)
    costs = [0.5 * float(np.nansum(((blocks.outputs - run)[blocks.first :] / scales) ** 2)) for run in runs]
    best = int(np.argmin(costs))
    room = INTERVAL_DROP * max(1.0, lasting_misfit(runs[best], blocks) ** 2)
    likely = candidates[np.array(costs) <= costs[best] + room]
    return int(likely[0]) - 1, int(candidates[best]), int(likely[-1]) + 1
