"""Parameters of the piezo-stack electro-hydrostatic actuator, and the faults that are changes of them.

The paper's own Table 1 is a picture and lost (errata P17): each value says whether it was printed, comes from a
catalogue, was calibrated to the published flows, or judged.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Annotated

from plant.errors import RigError
from plant.units import SI, require_numbers

CATALOGUE = "catalogue of multilayer stacks, 14 x 14 mm, 150 V"
CALIBRATED = "calibrated to the flows that the paper quotes, errata P17"
JUDGED = "judged, errata P17"


@dataclass(frozen=True, kw_only=True)
class PiezoStackParameters:
    """Parameters of the stack, pump, reeds, lines, accumulator and cylinder; a healthy actuator by default.

    Raises
    ------
    RigError
        If a value is not finite, or of the wrong sign, or a port is too small for the integrator (see `least_port`).

    Examples
    --------
    >>> p = PiezoStackParameters()
    >>> round(1e6 * p.free_stroke_a_volt * 140.0, 1)
    46.6
    """

    stack_mass: Annotated[float, SI("kg", "moving mass m_0 of the stack", JUDGED)] = 0.025
    stack_damping: Annotated[float, SI("N s/m", "damping c_0 of the stack", JUDGED)] = 300.0
    stack_stiffness: Annotated[float, SI("N/m", "stiffness k_0 of the stack", CATALOGUE)] = 1.48e8
    free_stroke_a_volt: Annotated[float, SI("m/V", "a = k_u/k_0, free stroke a volt, equation 1", CALIBRATED)] = (
        3.327e-7
    )
    stack_lag: Annotated[float, SI("s", "time constant tau of equation 2, errata P2", JUDGED)] = 1e-4
    hysteresis: Annotated[float, SI("m/V", "alpha of equation 1: small-signal hysteresis", JUDGED)] = 6.17e-8
    hysteresis_phi_1: Annotated[float, SI("1/V", "phi_1 of equation 1", JUDGED)] = 0.020
    hysteresis_phi_2: Annotated[float, SI("1/V", "phi_2 of equation 1", JUDGED)] = 0.003
    hysteresis_phi_3: Annotated[float, SI("1/V", "phi_3 of equation 1", JUDGED)] = -0.002
    hysteresis_gamma: Annotated[float, SI("1/V", "gamma of equation 1", JUDGED)] = -0.004
    head_mass: Annotated[float, SI("kg", "mass m_p + m_r of piston and rod, equation 3", JUDGED)] = 0.20
    head_damping: Annotated[float, SI("N s/m", "damping c_r of piston and rod, equation 3", JUDGED)] = 500.0
    head_stiffness: Annotated[
        float, SI("N/m", "stiffness k_B + k_d of disc spring and diaphragm, equation 3", CALIBRATED)
    ] = 3.6e6
    piston_area: Annotated[float, SI("m^2", "area A_p of the pump's piston", CALIBRATED)] = 2.67e-3
    chamber_height: Annotated[float, SI("m", "height h of the pump chamber, equation 8", CALIBRATED)] = 5.86e-4
    dead_volume: Annotated[float, SI("m^3", "ports of the pump chamber, errata P6", CALIBRATED)] = 4.03e-7
    density: Annotated[float, SI("kg/m^3", "density of the oil", JUDGED)] = 850.0
    viscosity: Annotated[float, SI("Pa s", "dynamic viscosity of the oil", CALIBRATED)] = 0.0224
    bulk_modulus: Annotated[float, SI("Pa", "bulk modulus beta_f of the oil without air, equation 5", JUDGED)] = 1.4e9
    air_fraction: Annotated[
        float, SI("1", "entrained air lambda_a at atmospheric pressure, equation 6, errata P4", CALIBRATED)
    ] = 0.0245
    vapour_pressure: Annotated[float, SI("Pa", "absolute pressure of the vapour", "judged, errata P5")] = 2e3
    reed_mass: Annotated[float, SI("kg", "mass of a reed with the oil it carries", CALIBRATED)] = 2.89e-3
    reed_damping: Annotated[float, SI("N s/m", "damping of a reed, equation 13", CALIBRATED)] = 17.6
    outlet_reed_stiffness: Annotated[float, SI("N/m", "stiffness of the outlet reed", CALIBRATED)] = 6.43e4
    inlet_reed_stiffness: Annotated[float, SI("N/m", "stiffness of the inlet reed", CALIBRATED)] = 7.06e4
    outlet_reed_gap: Annotated[
        float, SI("m", "opening at which the outlet reed rests; 0 healthy", "a fault of ours")
    ] = 0.0
    inlet_reed_gap: Annotated[float, SI("m", "opening at which the inlet reed rests; 0 healthy", "a fault of ours")] = (
        0.0
    )
    reed_area: Annotated[float, SI("m^2", "area A_R that pressure acts on, equation 13", CALIBRATED)] = 4.75e-5
    reed_perimeter: Annotated[float, SI("m", "perimeter w of the opening, equation 15", CALIBRATED)] = 0.0101
    reed_lift: Annotated[float, SI("m", "lift at the stop, errata P7", CALIBRATED)] = 3.88e-4
    discharge_coefficient: Annotated[float, SI("1", "discharge coefficient c_d, equation 15", JUDGED)] = 0.62
    seat_stiffness: Annotated[float, SI("N/m", "stiffness of seat and stop, errata P7", JUDGED)] = 2e7
    seat_damping: Annotated[float, SI("N s/m", "damping of seat and stop, errata P7", JUDGED)] = 300.0
    laminar_drop: Annotated[float, SI("Pa", "drop below which an opening's flow is laminar, errata P8", JUDGED)] = 1e4
    delivery_length: Annotated[float, SI("m", "line from pump to cylinder", CALIBRATED)] = 0.23
    return_length: Annotated[float, SI("m", "line from cylinder to accumulator", CALIBRATED)] = 0.163
    intake_length: Annotated[float, SI("m", "line from accumulator to pump", CALIBRATED)] = 0.406
    line_area: Annotated[float, SI("m^2", "cross-section A_t of the lines, equation 19", CALIBRATED)] = 6.89e-5
    minor_losses: Annotated[float, SI("1", "sum of xi in a line, equation 21, errata P12", CALIBRATED)] = 1.97
    port_volume: Annotated[float, SI("m^3", "oil between a reed and its line, errata P10", JUDGED)] = 3e-6
    accumulator_volume: Annotated[float, SI("m^3", "oil at the accumulator's port, errata P16", JUDGED)] = 2e-6
    accumulator_gas: Annotated[
        float, SI("m^3", "gas at the bias pressure; 0 shuts the accumulator, errata P16", JUDGED)
    ] = 30e-6
    gas_exponent: Annotated[float, SI("1", "polytropic exponent of that gas", JUDGED)] = 1.4
    bias_pressure: Annotated[float, SI("Pa", "bias pressure, absolute", "test conditions: 0.6 and 1.0 MPa")] = 1e6
    cylinder_area: Annotated[float, SI("m^2", "area A_cp of the cylinder", CALIBRATED)] = 4.16e-4
    cylinder_start: Annotated[float, SI("m", "rod's start x_0 from the high side's end, equation 18", CALIBRATED)] = (
        0.151
    )
    cylinder_length: Annotated[float, SI("m", "length L_c of both sides together, errata P11", CALIBRATED)] = 0.302
    carriage_mass: Annotated[float, SI("kg", "rod and carriage, moved without load", CALIBRATED)] = 0.886
    load_mass: Annotated[float, SI("kg", "load lifted, equation 22", "test conditions: 0 to 60 kg")] = 0.0
    viscous_friction: Annotated[float, SI("N s/m", "movement damping c_c, equation 22", CALIBRATED)] = 1200.0
    coulomb_friction: Annotated[float, SI("N", "friction F_f, equation 22, errata P13", JUDGED)] = 20.0
    friction_speed: Annotated[float, SI("m/s", "speed that smooths the Coulomb force, errata P13", JUDGED)] = 2e-3
    end_clearance: Annotated[float, SI("m", "least length of a side, at the end stop, errata P13", JUDGED)] = 4e-3
    chamber_leakage: Annotated[
        float, SI("m^3/(s Pa)", "leakage from pump chamber to accumulator, errata P6; 0 healthy", JUDGED)
    ] = 0.0
    crossport_leakage: Annotated[
        float, SI("m^3/(s Pa)", "leakage across the cylinder, errata P11; 0 healthy", JUDGED)
    ] = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, signed=SIGNED, zero=MAY_BE_ZERO)
        if self.port_volume < least_port(self):
            raise RigError(
                f"port_volume must be at least {least_port(self):.2g} m^3 for steps of {LONGEST_STEP:g} s "
                f"to be stable with laminar_drop {self.laminar_drop:g} Pa, got {self.port_volume:g} m^3"
            )

    @property
    def moving_mass(self) -> float:
        """Mass m_c that the cylinder moves [kg], equation 22."""
        return self.carriage_mass + self.load_mass


SIGNED = frozenset({"hysteresis_phi_1", "hysteresis_phi_2", "hysteresis_phi_3", "hysteresis_gamma"})
"""Parameters of either sign."""

MAY_BE_ZERO = frozenset({"hysteresis", "air_fraction", "minor_losses", "accumulator_gas", "coulomb_friction"})
"""Parameters that may be zero, beside those that are zero by default."""

LONGEST_STEP = 2e-6
"""Step of the integrator [s]."""

_STABLE = 1.4
"""Rate times step that the integrator takes in a port, half of where the classical Runge-Kutta method is stable."""


def least_port(p: PiezoStackParameters) -> float:
    """Return the smallest port volume whose pressure the integrator follows (errata P10).

    An open reed at no pressure drop passes ``c_d w x sqrt(2/rho/eps)`` a pascal, which empties a stiff port at that
    rate times bulk modulus over volume. Too small a port gives flows that are finite and wrong.

    Returns
    -------
    float
        Volume [m^3].
    """
    conductance = p.discharge_coefficient * p.reed_perimeter * p.reed_lift * sqrt(2.0 / p.density / p.laminar_drop)
    return conductance * p.bulk_modulus * LONGEST_STEP / _STABLE
