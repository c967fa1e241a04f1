"""The pump delivery that an explanation implies, and whether the pump of the rig file can deliver it."""

from typing import TYPE_CHECKING

from estimation.fits.hypotheses import LEAST_SHARE, MOST_SHARE
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.notes import Note

if TYPE_CHECKING:
    from estimation.fits.hypothesis_search.explanation import Explanation


def delivery_share(found: "Explanation", parameters: EhaParameters) -> float | None:
    """Return the pump's delivery as a share of its displacement in the rig file.

    Parameters
    ----------
    found : Explanation
        The explanation of a log.
    parameters : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    float or None
        The share [fraction]; None if the delivery is not part of the explanation.
    """
    if "pump_displacement" not in found.values:
        return None
    return found.values["pump_displacement"][0] / parameters.pump_displacement


def delivery_objection(found: "Explanation", parameters: EhaParameters) -> tuple[Note, ...]:
    """Return the objection to an explanation whose flow the pump of the rig file cannot deliver.

    Displacement, area and the scales of speed and position share one ratio; bulk modulus depends on which is wrong.
    """
    share = delivery_share(found, parameters)
    if share is None or LEAST_SHARE <= share <= MOST_SHARE:
        return ()
    return (EstimateCode.RIG_CONTRADICTED.note(percent=100.0 * share),)
