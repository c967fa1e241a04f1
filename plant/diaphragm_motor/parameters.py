"""Parameters of the seven-chamber piezo diaphragm motor, and the faults that are changes of them.

The paper prints sizes and materials (Table 1) and the pump's design flow. The other values were derived from those by
plate theory, calibrated to that flow, or assumed; each value says which (errata M22). The set is not unique: two hard
targets, peak flow and its frequency, constrain six calibrated values.
"""

from dataclasses import dataclass

from plant.errors import RigError
from plant.units import require_numbers, si

DIAPHRAGMS = 7
"""Number of diaphragms, and of chambers, in series (section 2)."""

VALVES = DIAPHRAGMS + 1
"""Number of check valves: one before each chamber and one after the last (section 2, errata M28)."""

PLATE = "derived: composite plate of Table 1, clamped at 14 mm, errata M14"
CALIBRATED = "calibrated to 110.11 ml/min at 480 Hz and 200 V peak to peak, section 7.1"
ASSUMED = "assumed, errata M22"
FAULT = "a fault of ours"

PerDiaphragm = tuple[float, ...]
"""Seven values, ordered from the inlet."""

PerValve = tuple[float, ...]
"""Eight values, ordered from the inlet."""


@dataclass(frozen=True, kw_only=True)
class DiaphragmMotorParameters:
    """Parameters of diaphragms, check valves, directional valve and cylinder; a healthy motor by default.

    Raises
    ------
    RigError
        If a value is not finite or of the wrong sign, or a row of values is not as long as it must be.

    Examples
    --------
    >>> p = DiaphragmMotorParameters()
    >>> round(p.volume_a_volt / p.diaphragm_compliance, 1)
    196.7
    """

    diaphragm_compliance: float = si(1.174e-13, "m^3/Pa", "volume C_d that a diaphragm gives a pascal", PLATE)
    volume_a_volt: float = si(2.309e-11, "m^3/V", "volume d_V that a diaphragm displaces a volt", PLATE)
    deflection_a_pascal: float = si(5.193e-10, "m/Pa", "deflection w_p of the centre a pascal", PLATE)
    deflection_a_volt: float = si(8.380e-8, "m/V", "deflection w_V of the centre a volt", PLATE)
    chamber_volume: float = si(3.079e-7, "m^3", "volume V_0 of a chamber, 0.5 mm high", "derived from Table 1")
    bulk_modulus: float = si(1e9, "Pa", "bulk modulus beta of the liquid without gas", ASSUMED)
    gas_exponent: float = si(1.2, "1", "polytropic exponent n of the entrapped gas", ASSUMED)
    supply_pressure: float = si(1.5e5, "Pa", "absolute pressure p_0 of tank and supply", ASSUMED)
    least_pressure: float = si(3e3, "Pa", "absolute pressure that no liquid falls below", ASSUMED)
    density: float = si(998.0, "kg/m^3", "density rho of the liquid, water", ASSUMED)
    inertance: float = si(2.461e6, "kg/m^4", "inertance I of the liquid in a port", CALIBRATED)
    port_area: float = si(1.894e-6, "m^2", "area A_v of a wide open check valve", CALIBRATED)
    valve_lag: float = si(4.70e-4, "s", "time constant tau_v with which a check valve moves", CALIBRATED)
    opening_range: float = si(600.0, "Pa", "drop p_full over which a check valve opens", CALIBRATED)
    cracking_pressure: float = si(200.0, "Pa", "drop p_cr at which a check valve leaves its seat", ASSUMED, zero=True)
    valve_resistance: float = si(6.0e8, "Pa s/m^3", "laminar resistance R_v of a port", CALIBRATED, zero=True)
    discharge_coefficient: float = si(0.65, "1", "discharge coefficient C_q of a check valve", ASSUMED)
    hysteresis: float = si(0.30, "1", "small-signal slope h_A, equation 21, errata M21", ASSUMED, zero=True)
    hysteresis_beta: float = si(0.006, "1/V", "h_b of equation 21, for exponent 1", ASSUMED, zero=True)
    hysteresis_gamma: float = si(0.002, "1/V", "h_g of equation 21, for exponent 1", ASSUMED, signed=True)
    hysteresis_exponent: float = si(1.0, "1", "exponent n of equation 21", ASSUMED)
    sensing_gain: float = si(1e6, "V/m", "sensing voltage h_s a metre of deflection, equation 15", ASSUMED)
    sensing_corner: float = si(2.0, "Hz", "corner below which an electrode's charge leaks away, errata M15", ASSUMED)
    piston_area: float = si(3.7934e-4, "m^2", "area A_c of the cylinder's piston", "derived: Table 2, equation 18")
    moving_mass: float = si(0.8, "kg", "mass M_2 of piston, rod and carriage", ASSUMED)
    viscous_friction: float = si(60.0, "N s/m", "damping c_2 of the cylinder", ASSUMED, zero=True)
    coulomb_friction: float = si(4.0, "N", "friction F_c of the cylinder", ASSUMED, zero=True)
    friction_speed: float = si(2e-4, "m/s", "speed v_s that smooths the Coulomb force", ASSUMED)
    spring_stiffness: float = si(0.0, "N/m", "spring k_3 on the rod, equation 2", "option, errata M2")
    cubic_stiffness: float = si(
        0.0, "N/m^3", "cubic spring k_4 on the rod, equation 2", "option, errata M2", signed=True
    )
    half_stroke: float = si(0.025, "m", "travel from the middle to either end", "judged from Table 1: 69.5 mm")
    line_compliance: float = si(4e-13, "m^3/Pa", "compliance C_line of a cylinder side's line", ASSUMED)
    cylinder_volume: float = si(1e-5, "m^3", "liquid V_A in a cylinder side", ASSUMED)
    cylinder_bulk_modulus: float = si(1e9, "Pa", "bulk modulus beta_c of that liquid", ASSUMED)
    land_conductance: float = si(
        4.243e-8, "m^3/(s Pa^0.5)", "conductance K_dv of an open land of the 4/3 valve", ASSUMED
    )
    crossport_leakage: float = si(2e-14, "m^3/(s Pa)", "leakage G across the piston", ASSUMED, zero=True)
    spool: float = si(1.0, "1", "4/3 valve: 1 extends, -1 retracts, 0 holds, pump to tank", "section 5.1", signed=True)
    load_force: float = si(0.0, "N", "external force F against extension", "section 7.2", signed=True)
    valve_leak: PerValve = si((2e-3,) * VALVES, "1", "opening of each shut check valve; 1 is stuck open", ASSUMED)
    valve_lift: PerValve = si((1.0,) * VALVES, "1", "opening of each wide open check valve", FAULT)
    polarisation: PerDiaphragm = si(
        (1.0,) * DIAPHRAGMS, "1", "share g of each diaphragm's drive that acts; 0 is dead", FAULT, zero=True
    )
    sensor_gain: PerDiaphragm = si(
        (1.0,) * DIAPHRAGMS, "1", "gain of each sensing electrode's reading", FAULT, zero=True
    )
    gas_fraction: PerDiaphragm = si(
        (1e-3,) * DIAPHRAGMS, "1", "gas in each chamber at the supply pressure, over its volume", ASSUMED, zero=True
    )

    def __post_init__(self) -> None:
        for name, count in ROWS.items():
            if len(getattr(self, name)) != count:
                raise RigError(f"{name} must hold {count} values, got {len(getattr(self, name))}")
        require_numbers(self)
        if self.spool not in (-1.0, 0.0, 1.0):
            raise RigError(f"spool must be -1, 0 or 1, got {self.spool:g}")


ROWS = {
    "valve_leak": VALVES,
    "valve_lift": VALVES,
    "polarisation": DIAPHRAGMS,
    "sensor_gain": DIAPHRAGMS,
    "gas_fraction": DIAPHRAGMS,
}
"""Parameters with one value for each valve or diaphragm, and the number of values."""


def with_changed_value(row: tuple[float, ...], place: int, value: float) -> tuple[float, ...]:
    """Return a row of values with one of them changed, which represents a fault of one valve or diaphragm.

    Parameters
    ----------
    row : tuple of float
        Seven or eight values, ordered from the inlet [any unit].
    place : int
        Position to change, counted from 1 as the paper counts diaphragms A1 to A7.
    value : float
        The new value [any unit].

    Returns
    -------
    tuple of float
        The changed row.

    Raises
    ------
    RigError
        If there is no such place.

    Examples
    --------
    >>> with_changed_value((1.0, 1.0, 1.0), 2, 0.8)
    (1.0, 0.8, 1.0)
    """
    if not 1 <= place <= len(row):
        raise RigError(f"a place from 1 to {len(row)} is needed, got {place}")
    return (*row[: place - 1], value, *row[place:])
