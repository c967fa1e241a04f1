"""Where no bulk modulus is known, stiff oil is no fault: conditions are compared around the oil of the fitted circuit.

With pressure, bulk modulus is usually measured before a circuit is fitted. Without, or where the flow balance gives no
number, the circuit alone tells the oil. Soft oil contains air, which is a fault. See decision 461.
"""

import math
from dataclasses import replace

from estimation.eha.rig_share import SOFT_OIL_RATIO
from faults.diagnosis.beyond_nine.load import DiagnoseAround, LoadedDiagnosis
from faults.diagnosis.beyond_nine.near_enough import is_only_outside
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.notes import AgainstCode, ClassCode
from plant.eha.model import EhaParameters


def with_stiffer_oil(diagnosed: DiagnoseAround, parameters: EhaParameters) -> LoadedDiagnosis:
    """Return a diagnosis around stiffer oil than the rig file's, if stiffness alone contradicts all conditions.

    If the log determines the oil only roughly, it is not called stiff, but its circuit may be outside the nine
    conditions because of it.

    Parameters
    ----------
    diagnosed : callable
        Gives a diagnosis around an actuator, and for a doubt of the force on its rod [N].

    Returns
    -------
    LoadedDiagnosis
        The diagnosis, its actuator, and a note if the oil is another.
    """
    found = diagnosed(parameters, 0.0)
    ratio = _stiffness_ratio(found, parameters)
    if ratio is None:
        return LoadedDiagnosis(found, parameters)
    stiffer = replace(parameters, bulk_modulus=ratio * parameters.bulk_modulus)
    around = diagnosed(stiffer, 0.0)
    if around.unknown and is_only_outside(found.against):  # then stiffer oil does not explain the objection
        return LoadedDiagnosis(found, parameters)
    return LoadedDiagnosis(around, stiffer, (ClassCode.OIL_STIFFER_CLASS.note(ratio=ratio),))


def _stiffness_ratio(found: Diagnosis, parameters: EhaParameters) -> float | None:
    """Return the oil's bulk modulus over the rig file's, if it may be the only objection to the conditions."""
    if [note.code for note in found.against] == [AgainstCode.OIL_STIFF]:
        return float(found.against[0].data["share"])
    if not found.against or not is_only_outside(found.against):
        return None
    logarithm = float(found.scoreboard.fits.best.coordinates[COORDINATES.index("bulk_modulus")])
    ratio = math.exp(logarithm) / parameters.bulk_modulus
    return ratio if ratio > 1.0 / SOFT_OIL_RATIO else None
