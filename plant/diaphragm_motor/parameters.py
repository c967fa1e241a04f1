"""Parameters of the seven-chamber piezo diaphragm motor, and the faults that are changes of them.

The paper prints sizes and materials (Table 1) and the flow that its pump is to give; the rest was derived from those by
plate theory, calibrated to that flow, or assumed. Each value says which (errata M22). The set is not unique: two hard
targets, peak flow and its frequency, stand against six calibrated values.
"""

from dataclasses import dataclass
from typing import Annotated

from plant.errors import RigError
from plant.units import SI, require_numbers

DIAPHRAGMS = 7
"""Diaphragms, and chambers, in series (section 2)."""

VALVES = DIAPHRAGMS + 1
"""Check valves: one before each chamber and one behind the last (section 2, errata M28)."""

PLATE = "derived: composite plate of Table 1, clamped at 14 mm, errata M14"
CALIBRATED = "calibrated to 110.11 ml/min at 480 Hz and 200 V peak to peak, section 7.1"
ASSUMED = "assumed, errata M22"
FAULT = "a fault of ours"

PerDiaphragm = tuple[float, ...]
"""Seven values, from the inlet on."""

PerValve = tuple[float, ...]
"""Eight values, from the inlet on."""


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

    diaphragm_compliance: Annotated[float, SI("m^3/Pa", "volume C_d that a diaphragm gives a pascal", PLATE)] = (
        1.174e-13
    )
    volume_a_volt: Annotated[float, SI("m^3/V", "volume d_V that a diaphragm displaces a volt", PLATE)] = 2.309e-11
    deflection_a_pascal: Annotated[float, SI("m/Pa", "deflection w_p of the centre a pascal", PLATE)] = 5.193e-10
    deflection_a_volt: Annotated[float, SI("m/V", "deflection w_V of the centre a volt", PLATE)] = 8.380e-8
    chamber_volume: Annotated[float, SI("m^3", "volume V_0 of a chamber, 0.5 mm high", "derived from Table 1")] = (
        3.079e-7
    )
    bulk_modulus: Annotated[float, SI("Pa", "bulk modulus beta of the liquid without gas", ASSUMED)] = 1e9
    gas_exponent: Annotated[float, SI("1", "polytropic exponent n of the entrapped gas", ASSUMED)] = 1.2
    supply_pressure: Annotated[float, SI("Pa", "absolute pressure p_0 of tank and supply", ASSUMED)] = 1.5e5
    least_pressure: Annotated[float, SI("Pa", "absolute pressure that no liquid falls below", ASSUMED)] = 3e3
    density: Annotated[float, SI("kg/m^3", "density rho of the liquid, water", ASSUMED)] = 998.0
    inertance: Annotated[float, SI("kg/m^4", "inertance I of the liquid in a port", CALIBRATED)] = 2.461e6
    port_area: Annotated[float, SI("m^2", "area A_v of a wide open check valve", CALIBRATED)] = 1.894e-6
    valve_lag: Annotated[float, SI("s", "time constant tau_v with which a check valve moves", CALIBRATED)] = 4.70e-4
    opening_range: Annotated[float, SI("Pa", "drop p_full over which a check valve opens", CALIBRATED)] = 600.0
    cracking_pressure: Annotated[float, SI("Pa", "drop p_cr at which a check valve leaves its seat", ASSUMED)] = 200.0
    valve_resistance: Annotated[float, SI("Pa s/m^3", "laminar resistance R_v of a port", CALIBRATED)] = 6.0e8
    discharge_coefficient: Annotated[float, SI("1", "discharge coefficient C_q of a check valve", ASSUMED)] = 0.65
    hysteresis: Annotated[float, SI("1", "small-signal slope h_A, equation 21, errata M21", ASSUMED)] = 0.30
    hysteresis_beta: Annotated[float, SI("1/V", "h_b of equation 21, for exponent 1", ASSUMED)] = 0.006
    hysteresis_gamma: Annotated[float, SI("1/V", "h_g of equation 21, for exponent 1", ASSUMED)] = 0.002
    hysteresis_exponent: Annotated[float, SI("1", "exponent n of equation 21", ASSUMED)] = 1.0
    sensing_gain: Annotated[float, SI("V/m", "sensing voltage h_s a metre of deflection, equation 15", ASSUMED)] = 1e6
    sensing_corner: Annotated[
        float, SI("Hz", "corner below which an electrode's charge leaks away, errata M15", ASSUMED)
    ] = 2.0
    piston_area: Annotated[float, SI("m^2", "area A_c of the cylinder's piston", "derived: Table 2, equation 18")] = (
        3.7934e-4
    )
    moving_mass: Annotated[float, SI("kg", "mass M_2 of piston, rod and carriage", ASSUMED)] = 0.8
    viscous_friction: Annotated[float, SI("N s/m", "damping c_2 of the cylinder", ASSUMED)] = 60.0
    coulomb_friction: Annotated[float, SI("N", "friction F_c of the cylinder", ASSUMED)] = 4.0
    friction_speed: Annotated[float, SI("m/s", "speed v_s that smooths the Coulomb force", ASSUMED)] = 2e-4
    spring_stiffness: Annotated[float, SI("N/m", "spring k_3 on the rod, equation 2", "option, errata M2")] = 0.0
    cubic_stiffness: Annotated[float, SI("N/m^3", "cubic spring k_4 on the rod, equation 2", "option, errata M2")] = 0.0
    half_stroke: Annotated[float, SI("m", "travel from the middle to either end", "judged from Table 1: 69.5 mm")] = (
        0.025
    )
    line_compliance: Annotated[float, SI("m^3/Pa", "compliance C_line of a cylinder side's line", ASSUMED)] = 4e-13
    cylinder_volume: Annotated[float, SI("m^3", "liquid V_A in a cylinder side", ASSUMED)] = 1e-5
    cylinder_bulk_modulus: Annotated[float, SI("Pa", "bulk modulus beta_c of that liquid", ASSUMED)] = 1e9
    land_conductance: Annotated[
        float, SI("m^3/(s Pa^0.5)", "conductance K_dv of an open land of the 4/3 valve", ASSUMED)
    ] = 4.243e-8
    crossport_leakage: Annotated[float, SI("m^3/(s Pa)", "leakage G across the piston", ASSUMED)] = 2e-14
    spool: Annotated[float, SI("1", "4/3 valve: 1 extends, -1 retracts, 0 holds, pump to tank", "section 5.1")] = 1.0
    load_force: Annotated[float, SI("N", "external force F against extension", "section 7.2")] = 0.0
    valve_leak: Annotated[PerValve, SI("1", "opening of each shut check valve; 1 is stuck open", ASSUMED)] = (
        2e-3,
    ) * VALVES
    valve_lift: Annotated[PerValve, SI("1", "opening of each wide open check valve", FAULT)] = (1.0,) * VALVES
    polarisation: Annotated[PerDiaphragm, SI("1", "share g of each diaphragm's drive that acts; 0 is dead", FAULT)] = (
        1.0,
    ) * DIAPHRAGMS
    sensor_gain: Annotated[PerDiaphragm, SI("1", "gain of each sensing electrode's reading", FAULT)] = (
        1.0,
    ) * DIAPHRAGMS
    gas_fraction: Annotated[
        PerDiaphragm, SI("1", "gas in each chamber at the supply pressure, over its volume", ASSUMED)
    ] = (1e-3,) * DIAPHRAGMS

    def __post_init__(self) -> None:
        for name, count in ROWS.items():
            if len(getattr(self, name)) != count:
                raise RigError(f"{name} must hold {count} values, got {len(getattr(self, name))}")
        require_numbers(self, signed=SIGNED, zero=MAY_BE_ZERO)
        if self.spool not in (-1.0, 0.0, 1.0):
            raise RigError(f"spool must be -1, 0 or 1, got {self.spool:g}")


ROWS = {
    "valve_leak": VALVES,
    "valve_lift": VALVES,
    "polarisation": DIAPHRAGMS,
    "sensor_gain": DIAPHRAGMS,
    "gas_fraction": DIAPHRAGMS,
}
"""Parameters that hold a value for each valve or diaphragm, with how many."""

SIGNED = frozenset({"hysteresis_gamma", "spool", "load_force", "cubic_stiffness"})
"""Parameters of either sign."""

MAY_BE_ZERO = frozenset(
    {
        "hysteresis",
        "hysteresis_beta",
        "cracking_pressure",
        "valve_resistance",
        "viscous_friction",
        "coulomb_friction",
        "crossport_leakage",
        "polarisation",
        "sensor_gain",
        "gas_fraction",
    }
)
"""Parameters that may be zero, beside those that are zero by default."""


def changed(row: tuple[float, ...], place: int, value: float) -> tuple[float, ...]:
    """Return a row of values with one of them changed: how a fault of one valve or diaphragm is written.

    Parameters
    ----------
    row : tuple of float
        Seven or eight values, from the inlet on [any unit].
    place : int
        Which, counted from 1 as the paper counts diaphragms A1 to A7.
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
    >>> changed((1.0, 1.0, 1.0), 2, 0.8)
    (1.0, 0.8, 1.0)
    """
    if not 1 <= place <= len(row):
        raise RigError(f"a place from 1 to {len(row)} is wanted, got {place}")
    return (*row[: place - 1], value, *row[place:])
