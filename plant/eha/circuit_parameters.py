"""Parameters of the circuit-level plant: the actuator's, and those that the lumped plant omits."""

from dataclasses import asdict, dataclass, fields
from types import SimpleNamespace
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.components.oil import ATMOSPHERE, specific_volume
from plant.eha.model import JUDGED, JUDGED_STROKE, EhaParameters, piston_areas
from plant.errors import RigError
from plant.units import si


@dataclass(frozen=True, kw_only=True)
class CircuitParameters(EhaParameters):
    """Parameters of the whole circuit of Figures 1 and 2, normal condition by default.

    ``leakage_coefficient`` is still the lumped L_t of all paths; the part that does not flow through pump and drain
    flows inside the cylinder and through throttle A (`cylinder_leakage`, errata E17). Each chamber's volume is twice
    ``chamber_volume``, so that this is the same actuator as the lumped one (errata E2).

    Raises
    ------
    RigError
        If a value is not a finite number or out of range, the pump and the drain leak more than L_t, the stroke
        is longer than the chambers, friction is negative at some velocity, or the accumulator is too small.

    Examples
    --------
    >>> CircuitParameters().cylinder_leakage
    2.2724e-12
    """

    stroke: float = si(JUDGED_STROKE, "m", "full stroke of the piston", JUDGED)
    pump_crossport_leakage: float = si(
        2.392e-12,
        "m^3/(s Pa)",
        "cross-port leakage xi of the pump",
        "judged: half of Table 3's L_t when normal",
        zero=True,
    )
    pump_case_leakage: float = si(
        2.392e-13,
        "m^3/(s Pa)",
        "case leakage C_ep a port",
        "judged: a twentieth of Table 3's L_t when normal",
        zero=True,
    )
    cylinder_drain_leakage: float = si(
        0.0, "m^3/(s Pa)", "external leakage L_out a chamber, drained", "judged: equation 5.3 gives no value"
    )
    bypass_conductance: float = si(
        0.0, "m^3/(s Pa)", "bypass valve, port to port; shut at 0", "section 2: the pump's fail-safe"
    )
    air_fraction: float = si(0.0, "1", "entrained air at atmospheric pressure", "piezo-stack paper, equation 6")
    vapour_pressure: float = si(2e3, "Pa", "absolute pressure of the vapour", "judged, errata P5")
    makeup_opening: float = si(7e3, "Pa", "drop at which a make-up check valve is half open", "judged: 1 psi")
    accumulator_gas: float = si(1e-3, "m^3", "gas volume of the accumulator at its pressure", JUDGED)
    accumulator_oil: float = si(1e-3, "m^3", "oil in the accumulator at its pressure", JUDGED)
    throttle_rated_flow: float = si(2.57e-3, "m^3/s", "rated flow of a throttle, fully open", "section 3")
    throttle_rated_pressure: float = si(
        3.4475e5, "Pa", "pressure drop at the rated flow", "judged: 50 psi, the paper gives none"
    )
    motor_lag: float = si(2e-3, "s", "time constant of the motor's speed", JUDGED, zero=True)
    presliding_displacement: float = si(2e-5, "m", "deflection at which the seals break loose", JUDGED)
    presliding_damping: float = si(0.2, "1", "damping ratio of the mass on the seals' stiffness", JUDGED, zero=True)
    end_stop_stiffness: float = si(1e8, "N/m", "stiffness of the cylinder's ends", "judged")
    end_stop_damping: float = si(
        20.0, "s/m", "damping over spring force at the ends, a unit of velocity", "judged", zero=True
    )

    @property
    def cylinder_leakage(self) -> float:
        """Leakage L_in inside the cylinder and through throttle A: the remainder of L_t by errata E17 [m^3/(s Pa)]."""
        drained = self.pump_case_leakage + self.cylinder_drain_leakage
        return self.leakage_coefficient - self.pump_crossport_leakage - 0.5 * drained

    @property
    def settled_leakage(self) -> float:
        """Leakage in the steady state [m^3/(s Pa)], as measured by equation 5.7.

        The halves of errata E17 are valid while both chambers float. Make-up soon holds the low-pressure chamber at the
        accumulator's pressure, and then the drain takes all its flow from the high-pressure chamber.
        """
        return self.leakage_coefficient + 0.5 * (self.pump_case_leakage + self.cylinder_drain_leakage)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.cylinder_leakage < -_ROUNDING * self.leakage_coefficient:
            raise RigError(
                "leakage_coefficient must cover what pump and drain leak (errata E17), "
                f"got {self.leakage_coefficient:g} and a rest of {self.cylinder_leakage:g} m^3/(s Pa)"
            )
        longest = longest_stroke(self)
        if self.stroke > longest * (1.0 + _ROUNDING):
            raise RigError(
                f"stroke must leave room in a chamber of {2.0 * self.chamber_volume:g} m^3 on average, so be at most "
                f"{longest:g} m, got {self.stroke:g} m"
            )
        if self.air_fraction > MOST_AIR:
            raise RigError(f"air_fraction must be at most {MOST_AIR:g}, got {self.air_fraction!r}")
        falling = max(-self.friction_linear, 0.0)
        if falling**2 > 4.0 * self.friction_quadratic * self.friction_coulomb:
            raise RigError(
                "friction must oppose motion at every speed: a negative friction_linear may be at most "
                f"2 sqrt(friction_quadratic friction_coulomb) in size, got {self.friction_linear!r} N s/m"
            )
        if not self.vapour_pressure < min(self.accumulator_pressure, ATMOSPHERE):
            raise RigError(
                f"vapour_pressure must be below {min(self.accumulator_pressure, ATMOSPHERE):g} Pa, "
                f"got {self.vapour_pressure!r} Pa"
            )
        needed = oil_demand(self)
        if self.accumulator_oil < needed:
            raise RigError(
                f"accumulator_oil must fill both chambers up to the relief pressure, {needed:.3g} m^3, "
                f"got {self.accumulator_oil:g} m^3"
            )


MOST_AIR = 0.5
"""Largest air fraction at which the mixture is oil with bubbles rather than a foam."""

_LARGEST_SWEPT_SHARE = 0.95
"""Largest fraction of a chamber that the piston may sweep, so that volume remains beyond the end stop."""

_ROUNDING = 1e-9
"""Fraction of L_t by which the cylinder's part may be negative due to rounding."""


def oil_demand(p: CircuitParameters) -> float:
    """Return the oil that both chambers take up from the accumulator's pressure to one relief pressure above it.

    Returns
    -------
    float
        Oil, as its volume at atmospheric pressure [m^3].
    """
    low, high = (
        specific_volume(pressure, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
        for pressure in (p.accumulator_pressure, p.accumulator_pressure + p.relief_pressure)
    )
    return 4.0 * p.chamber_volume * (1.0 / high - 1.0 / low) if high > 0.0 else float("inf")


def longest_stroke(p: EhaParameters | SimpleNamespace) -> Any:
    """Return the longest stroke that fits into the chambers of an actuator.

    Parameters
    ----------
    p : EhaParameters or namespace of ndarray
        Areas and volumes.

    Returns
    -------
    float or ndarray
        Full stroke [m].

    Examples
    --------
    >>> round(float(longest_stroke(EhaParameters())), 3)
    2.7
    """
    area_a, area_b = piston_areas(p)
    side_a, side_b = (1.0 + p.volume_difference) / area_a, (1.0 - p.volume_difference) / area_b
    return 4.0 * _LARGEST_SWEPT_SHARE * p.chamber_volume * np.minimum(side_a, side_b)


def circuit_of(p: EhaParameters) -> CircuitParameters:
    """Return the circuit around an actuator: a circuit unchanged, else with the paper's other parameters, scaled.

    Leakage of the pump is at most its share of L_t; the accumulator grows with the compliance of the chambers. An
    unknown stroke is at most as long as the chambers allow.

    Returns
    -------
    CircuitParameters
        The circuit; it keeps all of the actuator's own parameters.

    Raises
    ------
    RigError
        If no circuit fits, see `CircuitParameters`.

    Examples
    --------
    >>> circuit_of(EhaParameters(leakage_coefficient=0.0)).pump_crossport_leakage
    0.0
    """
    if isinstance(p, CircuitParameters):
        return p
    paper = CircuitParameters()
    share = min(1.0, p.leakage_coefficient / paper.leakage_coefficient)
    compliance = p.chamber_volume / p.bulk_modulus * paper.bulk_modulus / paper.chamber_volume
    size = max(1.0, compliance * max(1.0, p.relief_pressure / paper.relief_pressure))
    known = {name: value for name, value in asdict(p).items() if value is not None}
    judged = {"stroke": min(paper.stroke, float(longest_stroke(p))), "accumulator_gas": size * paper.accumulator_gas}
    return CircuitParameters(
        **{**judged, **known},
        pump_crossport_leakage=share * paper.pump_crossport_leakage,
        pump_case_leakage=share * paper.pump_case_leakage,
        accumulator_oil=size * paper.accumulator_oil,
    )


_COLUMNS = {field.name: place for place, field in enumerate(fields(CircuitParameters))}


class CircuitRows:
    """Parameters of circuits by name, read from their rows on access: most callers read only a few of forty.

    Parameters
    ----------
    rows : ndarray, shape (..., parameters)
        Parameters in the order of the fields [SI].
    """

    def __init__(self, rows: Array) -> None:
        self._rows = rows

    def __getattr__(self, name: str) -> Any:
        if name not in _COLUMNS:
            raise AttributeError(f"a circuit has no parameter {name!r}")
        return self._rows[..., _COLUMNS[name]]


def circuit_values(rows: Array) -> Any:
    """Return a circuit's parameters by name, from one row or from rows of many circuits.

    Parameters
    ----------
    rows : ndarray, shape (..., parameters)
        Parameters in the order of the fields [SI].
    """
    return CircuitRows(rows)
