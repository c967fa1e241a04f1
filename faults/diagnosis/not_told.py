"""Severities that a log does not determine, with notes."""

from collections.abc import Collection, Mapping
from math import inf, nan

import numpy as np

from estimation.finding import Quantity
from estimation.log_checks.channel_blocks import channel_blocks
from estimation.log_checks.channel_names import POSITION
from estimation.log_checks.channel_physics import MIDDLE
from estimation.log_checks.standstill import travels
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.circuits.not_shown import FRICTION_LAW, undetermined_coordinates
from faults.diagnosis.severity import FRICTION_SEVERITIES, OIL_SEVERITIES
from faults.notes import AgainstCode, ClassCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

HELD_PERCENTILE, BLOCKED_RATIO = 95.0, 2.0
"""Percentile of pressure that a piston at rest withstands [%], and multiple of the breakaway pressure under major
friction from which it is blocked [dimensionless]; judged: friction at rest may be 1.5 times that of sliding."""

VAGUE_RATIO = 3.0
"""Ratio of relative widths from which a combination is known and its parts are not [dimensionless]."""


def not_told_notes(fits: ClassFits, found: Mapping[str, Quantity], *, pressure: bool) -> list[Note]:
    """Return a note for each thing that the log does not determine.

    Parameters
    ----------
    fits : ClassFits
        The fit.
    found : Mapping[str, Quantity]
        Its severities [each in its unit].
    pressure : bool
        Whether differential pressure is logged.

    Returns
    -------
    list[Note]
        Empty for a log that determines everything.
    """
    blind, said = undetermined_coordinates(fits), list[Note]()
    unseen = blind >= FRICTION_LAW
    if unseen:
        said.append(ClassCode.FRICTION_NOT_VISIBLE.note())
    if "bulk_modulus" in blind:
        said.append(ClassCode.BULK_MODULUS_NOT_VISIBLE.note())
    flow, speed = found["leakage_flow"], found["velocity_lost"]
    lost = [] if unseen else _velocity_lost_notes(speed)  # it depends on friction too
    if not pressure:
        said += [ClassCode.ONE_SCALE.note(), *lost]
    elif _relative_width(flow) > VAGUE_RATIO * interval_width(speed) / 100.0 and _relative_width(flow) > 0.3:
        said += [ClassCode.LEAKAGE_AND_BIAS_ALIKE.note(), *lost]
    return said


def standstill_notes(record: Record, p: EhaParameters, not_told: Collection[Note]) -> tuple[Note, ...]:
    """Return the reason against all nine conditions if none of them holds the piston still, or if it may be blocked.

    In the nine, friction gives way at relief pressure, so only leakage keeps the piston still. A blocked rod does so as
    well. Pressure tells the two apart, or friction that shows in small movements.

    Parameters
    ----------
    p : EhaParameters
        The healthy actuator.
    not_told : collection of Note
        What the log does not determine.

    Returns
    -------
    tuple of Note
        Empty if the piston moves, if friction may hold it at that pressure, or if friction shows without pressure.
    """
    gone = travels(record, p)
    if gone is None or not gone.stuck:
        return ()
    said = {note.code for note in not_told}
    if ClassCode.ONE_SCALE in said:
        shows = ClassCode.FRICTION_NOT_VISIBLE not in said and POSITION in record
        return () if shows else (AgainstCode.STUCK_OR_LEAKS.note(moved_m=gone.piston, pumped_m=gone.pump),)
    pressure = channel_blocks(record, p, MIDDLE).pressure
    if pressure is None or not len(pressure) or p.single_rod:
        return ()
    held = float(np.percentile(np.abs(pressure), HELD_PERCENTILE))
    rubs = parameters_for(CONDITIONS["major_friction"], p).friction_coulomb + abs(p.load_force)
    yields = rubs / p.piston_area
    if not held >= BLOCKED_RATIO * yields:  # also true for NaN, which gaps leave
        return ()
    return (AgainstCode.ROD_BLOCKED.note(moved_m=gone.piston, held_pa=held, yields_pa=yields),)


def undetermined_severities(codes: Collection[object]) -> frozenset[str]:
    """Return the severities that a log does not determine; their values are those of the prior.

    Parameters
    ----------
    codes : collection of Code or str
        Codes of what the log does not determine.

    Returns
    -------
    frozenset[str]
        Names of `UNITS`.

    Examples
    --------
    >>> [sorted(undetermined_severities([code])) for code in ("friction_not_visible", "bulk_modulus_not_visible")]
    [['added_friction', 'pressure_rise', 'velocity_lost'], ['bulk_modulus', 'entrained_air']]
    """
    said = set(map(str, codes))
    friction = str(ClassCode.FRICTION_NOT_VISIBLE) in said
    # without pressure, a piston that yields on its seals shows only the ratio of bulk modulus to friction
    oil = str(ClassCode.BULK_MODULUS_NOT_VISIBLE) in said or (friction and str(ClassCode.ONE_SCALE) in said)
    return (FRICTION_SEVERITIES if friction else frozenset()) | (OIL_SEVERITIES if oil else frozenset())


def without_undetermined(found: Mapping[str, Quantity], codes: Collection[object]) -> Mapping[str, Quantity]:
    """Return severities, without a number if the log does not determine it: it would be that of the prior.

    Parameters
    ----------
    found : Mapping[str, Quantity]
        Severities [each in its unit].
    codes : collection of Code or str
        Codes of what the log does not determine.
    """
    unseen = undetermined_severities(codes)
    return {name: Quantity(None, one.unit) if name in unseen else one for name, one in found.items()}


def _velocity_lost_notes(speed: Quantity) -> list[Note]:
    if speed.value is None or speed.ci95 is None:
        return []
    return [ClassCode.VELOCITY_LOST_TOLD.note(percent=speed.value, low=speed.ci95[0], high=speed.ci95[1])]


def interval_width(one: Quantity) -> float:
    """Return the width of a severity's interval [its unit]; infinite if it has none."""
    return inf if one.ci95 is None else one.ci95[1] - one.ci95[0]


def _relative_width(one: Quantity) -> float:
    if one.ci95 is None:
        return nan
    return interval_width(one) / abs(one.value) if one.value else inf
