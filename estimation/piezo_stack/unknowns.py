"""Possible faults inside a piezo-stack actuator, as scaled unknowns of a fit, and the start of that fit."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import exp, log
from types import SimpleNamespace

from plant.piezo_stack.parameters import PiezoStackParameters


@dataclass(frozen=True)
class Unknown:
    """A quantity that a fault may change.

    Parameters
    ----------
    scale : float
        Unit of its change in SI; 0 if it acts as a factor, whose logarithm is fitted.
    """

    names: tuple[str, ...]
    scale: float = 0.0
    unit: str = "1"


UNKNOWNS: Mapping[str, Unknown] = {
    "air_fraction": Unknown(("air_fraction",)),
    "chamber_leakage": Unknown(("chamber_leakage",), 1e-11, unit="m^3/(s Pa)"),
    "crossport_leakage": Unknown(("crossport_leakage",), 1e-11, unit="m^3/(s Pa)"),
    "coulomb_friction": Unknown(("coulomb_friction",), 100.0, unit="N"),
    "polarisation": Unknown(("free_stroke_a_volt", "hysteresis")),
    "outlet_reed_stiffness": Unknown(("outlet_reed_stiffness",), unit="N/m"),
    "inlet_reed_stiffness": Unknown(("inlet_reed_stiffness",), unit="N/m"),
    "outlet_reed_gap": Unknown(("outlet_reed_gap",), 1e-4, unit="m"),
    "inlet_reed_gap": Unknown(("inlet_reed_gap",), 1e-4, unit="m"),
    "bias_pressure": Unknown(("bias_pressure",), unit="Pa"),
    "viscous_friction": Unknown(("viscous_friction",), unit="N s/m"),
    "delivery_length": Unknown(("delivery_length", "return_length", "intake_length")),
    "discharge_coefficient": Unknown(("discharge_coefficient",)),
}
"""Quantities that can be estimated, by name; the last three calibrate a healthy actuator."""

DEFAULT_UNKNOWNS = tuple(UNKNOWNS)[:7]
"""Quantities that are estimated by default."""

STARTS: Sequence[Mapping[str, float]] = (
    {},
    {"air_fraction": log(2.0)},
    {"air_fraction": log(4.0)},
    {"chamber_leakage": 0.5},
    {"chamber_leakage": 2.0},
    {"crossport_leakage": 1.0},
    {"crossport_leakage": 2.0},
    {"coulomb_friction": 1.0},
    {"coulomb_friction": 2.5},
    {"crossport_leakage": 0.5, "coulomb_friction": 2.5},
    {"crossport_leakage": 2.0, "coulomb_friction": 2.5},
    {"polarisation": log(0.8)},
    {"outlet_reed_stiffness": log(0.5)},
    {"inlet_reed_stiffness": log(0.5)},
    {"outlet_reed_stiffness": log(100.0)},
    {"inlet_reed_stiffness": log(100.0)},
)
"""First guesses, scaled; the descent begins at the one that fits best."""


def changed_actuator(healthy: PiezoStackParameters, changes: Mapping[str, float]) -> SimpleNamespace:
    """Return an actuator with scaled changes, factors as logarithms.

    Parameters
    ----------
    healthy : PiezoStackParameters
        The actuator before the changes.
    changes : Mapping[str, float]
        Scaled changes [dimensionless], by names of `UNKNOWNS`.

    Returns
    -------
    namespace
        Its parameters; not checked, so that an estimate may leave their ranges.

    Examples
    --------
    >>> round(changed_actuator(PiezoStackParameters(), {"coulomb_friction": 0.5}).coulomb_friction, 9)
    70.0
    """
    values = asdict(healthy)
    for name, change in changes.items():
        unknown = UNKNOWNS[name]
        for parameter in unknown.names:
            if unknown.scale:
                values[parameter] += unknown.scale * change
            else:
                values[parameter] *= exp(min(max(change, -5.0), 5.0))
    return SimpleNamespace(**values)


def reported_value(
    actuator: SimpleNamespace, healthy: PiezoStackParameters, name: str, deviation: float
) -> tuple[float, float]:
    """Return the value to report for a quantity and its deviation; a factor if it scales several parameters.

    Parameters
    ----------
    name : str
        A name of `UNKNOWNS`.
    deviation : float
        Standard deviation of the scaled unknown [dimensionless].

    Returns
    -------
    tuple of float
        Value and deviation [SI; dimensionless for a factor].
    """
    unknown = UNKNOWNS[name]
    value = getattr(actuator, unknown.names[0])
    if len(unknown.names) > 1:
        value /= getattr(healthy, unknown.names[0])
    return value, deviation * (unknown.scale or value)
