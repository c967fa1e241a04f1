"""Parameters of the piezo-stack electro-hydrostatic actuator, and the faults that are changes of them.

The paper's own Table 1 is an image and is lost (errata P17). Each value is marked as printed, from a catalogue,
calibrated to the published flows, or judged.
"""

from dataclasses import dataclass
from math import sqrt

from plant.errors import RigError
from plant.units import require_numbers, si

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

    stack_mass: float = si(0.025, "kg", "moving mass m_0 of the stack", JUDGED)
    stack_damping: float = si(300.0, "N s/m", "damping c_0 of the stack", JUDGED)
    stack_stiffness: float = si(1.48e8, "N/m", "stiffness k_0 of the stack", CATALOGUE)
    free_stroke_a_volt: float = si(3.327e-7, "m/V", "a = k_u/k_0, free stroke a volt, equation 1", CALIBRATED)
    stack_lag: float = si(1e-4, "s", "time constant tau of equation 2, errata P2", JUDGED)
    hysteresis: float = si(6.17e-8, "m/V", "alpha of equation 1: small-signal hysteresis", JUDGED, zero=True)
    hysteresis_phi_1: float = si(0.020, "1/V", "phi_1 of equation 1", JUDGED, signed=True)
    hysteresis_phi_2: float = si(0.003, "1/V", "phi_2 of equation 1", JUDGED, signed=True)
    hysteresis_phi_3: float = si(-0.002, "1/V", "phi_3 of equation 1", JUDGED, signed=True)
    hysteresis_gamma: float = si(-0.004, "1/V", "gamma of equation 1", JUDGED, signed=True)
    head_mass: float = si(0.20, "kg", "mass m_p + m_r of piston and rod, equation 3", JUDGED)
    head_damping: float = si(500.0, "N s/m", "damping c_r of piston and rod, equation 3", JUDGED)
    head_stiffness: float = si(3.6e6, "N/m", "stiffness k_B + k_d of disc spring and diaphragm, equation 3", CALIBRATED)
    piston_area: float = si(2.67e-3, "m^2", "area A_p of the pump's piston", CALIBRATED)
    chamber_height: float = si(5.86e-4, "m", "height h of the pump chamber, equation 8", CALIBRATED)
    dead_volume: float = si(4.03e-7, "m^3", "ports of the pump chamber, errata P6", CALIBRATED)
    density: float = si(850.0, "kg/m^3", "density of the oil", JUDGED)
    viscosity: float = si(0.0224, "Pa s", "dynamic viscosity of the oil", CALIBRATED)
    bulk_modulus: float = si(1.4e9, "Pa", "bulk modulus beta_f of the oil without air, equation 5", JUDGED)
    air_fraction: float = si(
        0.0245, "1", "entrained air lambda_a at atmospheric pressure, equation 6, errata P4", CALIBRATED, zero=True
    )
    vapour_pressure: float = si(2e3, "Pa", "absolute pressure of the vapour", "judged, errata P5")
    reed_mass: float = si(2.89e-3, "kg", "mass of a reed with the oil it carries", CALIBRATED)
    reed_damping: float = si(17.6, "N s/m", "damping of a reed, equation 13", CALIBRATED)
    outlet_reed_stiffness: float = si(6.43e4, "N/m", "stiffness of the outlet reed", CALIBRATED)
    inlet_reed_stiffness: float = si(7.06e4, "N/m", "stiffness of the inlet reed", CALIBRATED)
    outlet_reed_gap: float = si(0.0, "m", "opening at which the outlet reed rests; 0 healthy", "a fault of ours")
    inlet_reed_gap: float = si(0.0, "m", "opening at which the inlet reed rests; 0 healthy", "a fault of ours")
    reed_area: float = si(4.75e-5, "m^2", "area A_R that pressure acts on, equation 13", CALIBRATED)
    reed_perimeter: float = si(0.0101, "m", "perimeter w of the opening, equation 15", CALIBRATED)
    reed_lift: float = si(3.88e-4, "m", "lift at the stop, errata P7", CALIBRATED)
    discharge_coefficient: float = si(0.62, "1", "discharge coefficient c_d, equation 15", JUDGED)
    seat_stiffness: float = si(2e7, "N/m", "stiffness of seat and stop, errata P7", JUDGED)
    seat_damping: float = si(300.0, "N s/m", "damping of seat and stop, errata P7", JUDGED)
    laminar_drop: float = si(1e4, "Pa", "drop below which an opening's flow is laminar, errata P8", JUDGED)
    delivery_length: float = si(0.23, "m", "line from pump to cylinder", CALIBRATED)
    return_length: float = si(0.163, "m", "line from cylinder to accumulator", CALIBRATED)
    intake_length: float = si(0.406, "m", "line from accumulator to pump", CALIBRATED)
    line_area: float = si(6.89e-5, "m^2", "cross-section A_t of the lines, equation 19", CALIBRATED)
    minor_losses: float = si(1.97, "1", "sum of xi in a line, equation 21, errata P12", CALIBRATED, zero=True)
    port_volume: float = si(3e-6, "m^3", "oil between a reed and its line, errata P10", JUDGED)
    accumulator_volume: float = si(2e-6, "m^3", "oil at the accumulator's port, errata P16", JUDGED)
    accumulator_gas: float = si(
        30e-6, "m^3", "gas at the bias pressure; 0 shuts the accumulator, errata P16", JUDGED, zero=True
    )
    gas_exponent: float = si(1.4, "1", "polytropic exponent of that gas", JUDGED)
    bias_pressure: float = si(1e6, "Pa", "bias pressure, absolute", "test conditions: 0.6 and 1.0 MPa")
    cylinder_area: float = si(4.16e-4, "m^2", "area A_cp of the cylinder", CALIBRATED)
    cylinder_start: float = si(0.151, "m", "rod's start x_0 from the high side's end, equation 18", CALIBRATED)
    cylinder_length: float = si(0.302, "m", "length L_c of both sides together, errata P11", CALIBRATED)
    carriage_mass: float = si(0.886, "kg", "rod and carriage, moved without load", CALIBRATED)
    load_mass: float = si(0.0, "kg", "load lifted, equation 22", "test conditions: 0 to 60 kg")
    viscous_friction: float = si(1200.0, "N s/m", "movement damping c_c, equation 22", CALIBRATED)
    coulomb_friction: float = si(20.0, "N", "friction F_f, equation 22, errata P13", JUDGED, zero=True)
    friction_speed: float = si(2e-3, "m/s", "speed that smooths the Coulomb force, errata P13", JUDGED)
    end_clearance: float = si(4e-3, "m", "least length of a side, at the end stop, errata P13", JUDGED)
    chamber_leakage: float = si(
        0.0, "m^3/(s Pa)", "leakage from pump chamber to accumulator, errata P6; 0 healthy", JUDGED
    )
    crossport_leakage: float = si(0.0, "m^3/(s Pa)", "leakage across the cylinder, errata P11; 0 healthy", JUDGED)

    def __post_init__(self) -> None:
        require_numbers(self)
        if self.port_volume < least_port(self):
            raise RigError(
                f"port_volume must be at least {least_port(self):.2g} m^3 for steps of {LONGEST_STEP:g} s "
                f"to be stable with laminar_drop {self.laminar_drop:g} Pa, got {self.port_volume:g} m^3"
            )

    @property
    def moving_mass(self) -> float:
        """Mass m_c that the cylinder moves [kg], equation 22."""
        return self.carriage_mass + self.load_mass


LONGEST_STEP = 2e-6
"""Step of the integrator [s]."""

_STABLE = 1.4
"""Product of rate and step that the integrator allows in a port: half the stability limit of classical Runge-Kutta."""


def least_port(p: PiezoStackParameters) -> float:
    """Return the smallest port volume whose pressure the integrator follows (errata P10).

    An open reed at zero pressure drop passes ``c_d w x sqrt(2/rho/eps)`` per pascal. A stiff port therefore empties at
    that rate times bulk modulus over volume. If a port is too small, flows are finite but wrong.

    Returns
    -------
    float
        Volume [m^3].
    """
    conductance = p.discharge_coefficient * p.reed_perimeter * p.reed_lift * sqrt(2.0 / p.density / p.laminar_drop)
    return conductance * p.bulk_modulus * LONGEST_STEP / _STABLE
