"""Without pressure, stiff oil is no fault: the conditions are compared around the oil that the fitted circuit has.

Where pressure is logged, bulk modulus is measured before a circuit is fitted. Soft oil holds air, which is a fault.
"""

from dataclasses import replace

from faults.diagnosis.beyond_nine.load import Diagnosed, Loaded
from faults.notes import AgainstCode, ClassCode
from plant.eha.model import EhaParameters


def whatever_the_oil(diagnosed: Diagnosed, parameters: EhaParameters) -> Loaded:
    """Return a diagnosis, around stiffer oil than the rig file's where that alone speaks against all conditions.

    Parameters
    ----------
    diagnosed : callable
        Gives a diagnosis around an actuator, and for a doubt of the force on its rod [N].
    parameters : EhaParameters
        The actuator.

    Returns
    -------
    Loaded
        The diagnosis, the actuator around which it is, and a note where its oil is another.
    """
    found = diagnosed(parameters, 0.0)
    if [note.code for note in found.against] != [AgainstCode.OIL_STIFF]:
        return Loaded(found, parameters)
    ratio = float(found.against[0].data["share"])
    stiffer = replace(parameters, bulk_modulus=ratio * parameters.bulk_modulus)
    return Loaded(diagnosed(stiffer, 0.0), stiffer, (ClassCode.OIL_STIFFER_CLASS.note(ratio=ratio),))
