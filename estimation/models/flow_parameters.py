"""Parameters of the flow form: the actuator's, and those that the form adds."""

from collections.abc import Container
from dataclasses import dataclass, fields

from plant.eha.model import EhaParameters
from plant.units import si


@dataclass(frozen=True, kw_only=True)
class FlowParameters(EhaParameters):
    """The actuator's parameters, and those that the flow form adds."""

    makeup_opening: float = si(1e3, "Pa", "drop at which a make-up valve is half open", "fitted")
    case_leakage: float = si(0.0, "m^3/(s Pa)", "drain of a port to the inner circuit", "fitted")
    speed_lead: float = si(0.0, "s", "lead of the motor on the line between samples", "fitted")
    accumulator_stiffness: float = si(
        0.0, "Pa/m^3", "rise of the inner circuit's pressure per volume pushed back into it", "fitted"
    )
    makeup_bend: float = si(
        0.0, "1/Pa", "inverse of the drop from which a make-up valve's flow goes with its root", "fitted"
    )
    crack_a: float = si(0.0, "Pa", "drop at which the make-up valve of chamber A leaves its seat", "fitted")
    crack_b: float = si(0.0, "Pa", "the same of chamber B", "fitted")

    def __post_init__(self) -> None:
        """Take any finite number: a fit keeps to its own bounds."""


def flow_parameters(p: EhaParameters) -> FlowParameters:
    """Return an actuator's parameters as the flow form takes them.

    Returns
    -------
    FlowParameters
        With the defaults of what the form adds.
    """
    return FlowParameters(**{one.name: getattr(p, one.name) for one in fields(EhaParameters)})


def is_single(found: Container[str], area_difference: float) -> bool:
    """Return whether a rod is single, by its rig or by what is found of its log.

    Parameters
    ----------
    found : container of str
        Parameters that a fit finds.
    area_difference : float
        Of the rig [fraction].
    """
    return area_difference != 0.0 or "area_difference" in found
