"""`rejected_if_foreign_oil(...)`: a bulk modulus that no oil has, or that a piston at rest leaves undetermined.

Motion confirms the units of speed and pressure: the piston moves as far as it is pumped, and slides at the pressure
that friction takes. Compression of oil behind a piston at rest confirms no scale.
"""

from dataclasses import replace
from math import log as ln

import numpy as np

from estimation.eha.result import BulkModulusEstimate, is_vague, without_number
from estimation.finding import Outcome
from estimation.fits.flow.misread import FOREIGN, KIN
from estimation.fits.hypotheses import AIR, AIR_MIDWAY
from estimation.log_checks.channel_names import POSITION, PRESSURE, VELOCITY
from estimation.log_checks.channel_physics import PRESSURE_UNIT_RATIO
from estimation.log_checks.standstill import travels
from estimation.notes import ChannelCode, EstimateCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

STIFFEST = 2.5e9
"""Largest bulk modulus of any oil [Pa]: mineral oils have 1.4 to 2 GPa (Merritt, Hydraulic Control Systems, 1967,
chapter 2), and if a chamber is 15 % larger than its rig file says, the estimate is as much larger."""

SOFTEST = 3e7
"""Least bulk modulus of any oil without bubbles [Pa]; judged. The softest oil of the open benchmark has 40 MPa, and the
paper's in psi read as bar 14 MPa."""

UNLIKE_RIG_OIL = 0.2
"""Logarithm of bulk modulus over the rig file's from which units are doubted if no motion confirms them
[dimensionless]; judged."""

VAGUE_STILL = 0.1
"""Relative deviation of bulk modulus behind a piston at rest, above which it is not reported [fraction]; judged. Two
slips of scale that cancel had 13 to 30 %, logs without a slip 1 to 3 %."""


def no_motion_notes(record: Record, p: EhaParameters) -> tuple[Note, ...]:
    """Return the objection to a log in which neither pump nor piston moves, or no sensor of the piston ever changes.

    A piston at rest yields on its seals, which is 2 % of bulk modulus; a sensor that does not show it is dead or too
    coarse.

    Parameters
    ----------
    record : Record
        The log, with position.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    tuple of Note
        Empty if one of them moves.
    """
    gone = travels(record, p)
    if gone is not None and gone.at_rest:
        return (EstimateCode.PUMP_AND_PISTON_REST.note(),)
    seen = [record[name][np.isfinite(record[name])] for name in (POSITION, VELOCITY) if name in record]
    if any(len(one) and np.ptp(one) > 0.0 for one in seen):
        return ()
    return (EstimateCode.POSITION_CONSTANT.note(channel=POSITION),)


def rejected_if_foreign_oil(found: BulkModulusEstimate, record: Record, p: EhaParameters) -> BulkModulusEstimate:
    """Return an estimate, without a number if no oil is like that.

    Parameters
    ----------
    found : BulkModulusEstimate
        The estimate; unchanged if it has no value.
    record : Record
        Its log.
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    BulkModulusEstimate
        Without a number if no oil is like that. For a piston at rest, also if it is vague or unlike the rig's oil, and
        more strictly so if an unusual effect explains the log. A note says that no motion confirms the units if the
        pump turns, and if the oil is unlike the rig's.
    """
    if found.value is None:
        return found
    ratio = found.value / p.bulk_modulus
    if not 1.0 / PRESSURE_UNIT_RATIO < ratio < PRESSURE_UNIT_RATIO or _is_foreign(found, ratio):
        return _rejected(found, Outcome.MISMATCH, ChannelCode.NO_SUCH_OIL.note(channel=PRESSURE, ratio=ratio))
    gone = travels(record, p)
    if gone is None or not gone.still:
        return found
    unlike = abs(ln(ratio))
    doubted = gone.stuck or unlike > UNLIKE_RIG_OIL
    said = (EstimateCode.PISTON_STANDS_STILL.note(moved_m=gone.piston, pumped_m=gone.pump),) if doubted else ()
    # an offset absorbs half of the information about the scale
    most = ln(KIN) if found.explanation is None else UNLIKE_RIG_OIL
    if unlike < most and not is_vague(found.value, found.std, VAGUE_STILL):
        return replace(found, remarks=(*found.remarks, *said))
    return _rejected(found, Outcome.NOT_OBSERVABLE, *said, EstimateCode.STILL_AND_FOREIGN.note(ratio=ratio))


def _is_foreign(found: BulkModulusEstimate, ratio: float) -> bool:
    """Return whether oil without bubbles, measured with pressure, is softer or stiffer than any.

    Pressure in another unit scales bulk modulus and leakage, and the flow balance explains that as well.
    """
    names = () if found.explanation is None else found.explanation.names
    if PRESSURE not in found.channels or found.value is None or {AIR.name, AIR_MIDWAY.name} & set(names):
        return False
    softer, stiffer = ratio < 1.0 / FOREIGN, ratio > FOREIGN
    return (softer and found.value < SOFTEST) or (stiffer and found.value > STIFFEST)


def _rejected(found: BulkModulusEstimate, outcome: Outcome, *said: Note) -> BulkModulusEstimate:
    return without_number(outcome, (*said, *found.gate.reasons), found.form, found.channels, found.bound)
