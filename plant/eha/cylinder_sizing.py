"""Sizing of a double-acting cylinder and its circuit for a given duty, section 5.1 of the diaphragm-motor paper.

A single-rod cylinder with a 4/3 directional valve, a pump with relief valve, check valves and pipes. The paper says
that these were determined and gives no numbers. Only steady balances; standard bores and rods are from ISO 3320.
"""

from dataclasses import dataclass
from math import inf, isfinite, pi, sqrt
from typing import Annotated

from plant.errors import HydrostateError
from plant.units import SI, require_numbers, si

BORES_MM = (8, 10, 12, 16, 20, 25, 32, 40, 50, 63, 80, 100, 125, 160, 200, 250, 320)
RODS_MM = (
    *(4, 5, 6, 8, 10, 12, 14, 16, 18, 20, 22, 25, 28, 32),
    *(36, 40, 45, 50, 56, 63, 70, 80, 90, 100, 110, 125, 140, 160),
)
"""Standard diameters, ISO 3320 [mm]."""

STEEL_STIFFNESS, BUCKLING_SAFETY = 2.1e11, 3.5
"""Young's modulus of the rod [Pa], and the safety factor against Euler's load [dimensionless]."""

LARGEST_ROD_SHARE = 0.75
"""Largest ratio of rod to bore diameter [dimensionless]."""


@dataclass(frozen=True, kw_only=True)
class Duty:
    """The cylinder's task: forces, speeds, stroke and pressures.

    Raises
    ------
    HydrostateError
        If a value is not finite and positive; forces, return pressure and relief margin may be zero.

    Examples
    --------
    >>> Duty(extend_force=40.0, extend_speed=4.2e-3, stroke=0.03, supply_pressure=1.2e5).retract_speed
    0.0042
    """

    extend_force: Annotated[float, SI("N", "force against the load while the rod goes out", "asked for", zero=True)]
    extend_speed: Annotated[float, SI("m/s", "speed of the rod going out", "asked for")]
    stroke: Annotated[float, SI("m", "stroke", "asked for")]
    supply_pressure: Annotated[float, SI("Pa", "pressure at the valve's supply port, above tank", "asked for")]
    retract_force: float = si(0.0, "N", "force while the rod goes in", "asked for")
    retract_speed: float = si(0.0, "m/s", "speed going in; that of going out unless given", "asked for")
    return_pressure: float = si(0.0, "Pa", "pressure in the return line, above tank", "judged")
    efficiency: float = si(0.9, "1", "force at the rod over pressure times area", "judged: seals")
    valve_drop: float = si(0.05, "1", "drop at each edge of the valve, over supply", "judged")
    relief_margin: float = si(0.1, "1", "relief setting above supply, over supply", "judged", zero=True)
    line_speed: float = si(3.0, "m/s", "largest mean speed in a pipe", "judged: pressure lines")
    density: float = si(998.0, "kg/m^3", "density of the liquid", "water")
    discharge_coefficient: float = si(0.65, "1", "discharge coefficient of check valves", "judged")

    def __post_init__(self) -> None:
        require_numbers(self)
        if self.efficiency > 1.0 or self.valve_drop >= 0.5:
            raise HydrostateError(
                f"efficiency must be at most 1 and valve_drop below 0.5, got {self.efficiency} and {self.valve_drop}"
            )
        if self.retract_speed == 0.0:
            object.__setattr__(self, "retract_speed", self.extend_speed)


@dataclass(frozen=True)
class CylinderCircuit:
    """A cylinder with the flows, pressures and sizes of the circuit around it."""

    bore: Annotated[float, SI("m", "bore of the cylinder", "section 5.1")]
    rod: Annotated[float, SI("m", "diameter of the rod", "section 5.1")]
    extend_force: Annotated[float, SI("N", "force it can give going out", "pressure times area")]
    retract_force: Annotated[float, SI("N", "force it can give going in", "pressure times area")]
    buckling_force: Annotated[float, SI("N", "Euler's load of the rod, wholly out, its end free", "Euler")]
    extend_pressure: Annotated[float, SI("Pa", "pressure behind the piston for the load going out", "balance")]
    retract_pressure: Annotated[float, SI("Pa", "pressure on the rod side for the load going in", "balance")]
    cap_flow: Annotated[float, SI("m^3/s", "largest flow of the port behind the piston", "area times speed")]
    rod_flow: Annotated[float, SI("m^3/s", "largest flow of the rod side's port", "area times speed")]
    pump_flow: Annotated[float, SI("m^3/s", "flow that the pump must give", "larger of the two inflows")]
    cycle_time: Annotated[float, SI("s", "out and in again", "stroke over speeds")]
    relief_setting: Annotated[float, SI("Pa", "setting of the relief valve, which takes the pump's flow", "margin")]
    power: Annotated[float, SI("W", "hydraulic power at the relief setting", "pressure times flow")]
    valve_conductance: Annotated[
        float, SI("m^3/(s Pa^0.5)", "conductance K of the directional valve, Q = K sqrt(dp)", "drop")
    ]
    check_valve_area: Annotated[float, SI("m^2", "open area of a check valve at the same drop", "orifice")]
    pipe_bore: Annotated[float, SI("m", "smallest bore of the pipes", "line speed")]


def buckling_rod(force: float, stroke: float) -> float:
    """Return the rod that carries a force at full extension, one end free: Euler's load ``pi^2 E I/(2 L)^2``, safely.

    Parameters
    ----------
    force : float
        Pushing force [N].
    stroke : float
        Extended length L [m].

    Returns
    -------
    float
        Diameter [m].

    Examples
    --------
    >>> round(1e3 * buckling_rod(10e3, 0.5), 1)
    24.2
    """
    return (64.0 * BUCKLING_SAFETY * force * (2.0 * stroke) ** 2 / (pi**3 * STEEL_STIFFNESS)) ** 0.25


def cylinder_circuit(duty: Duty, bore: float, rod: float) -> CylinderCircuit:
    """Return the circuit of a cylinder of given diameters, even if it is too small for its duty (section 5.1).

    Parameters
    ----------
    duty : Duty
        Loads, speeds, pressures.
    bore, rod : float
        Diameters [m].

    Raises
    ------
    HydrostateError
        If the rod is not thinner than the bore, or a diameter not positive.

    Examples
    --------
    >>> duty = Duty(extend_force=40.0, extend_speed=4.2e-3, stroke=0.03, supply_pressure=1.6e5)
    >>> found = cylinder_circuit(duty, 0.022, 0.006)
    >>> round(found.extend_force, 1), round(6e7 * found.cap_flow, 1)  # N, mL/min
    (49.5, 95.8)
    """
    if not (isfinite(bore) and 0.0 < rod < bore):
        raise HydrostateError(f"rod must be thinner than the bore, and both positive, got {rod!r} m in {bore!r} m")
    cap = pi / 4.0 * bore**2
    ring = cap - pi / 4.0 * rod**2
    drop = duty.valve_drop * duty.supply_pressure
    pressed, back = duty.supply_pressure - drop, duty.return_pressure + drop
    inflow = max(cap * duty.extend_speed, ring * duty.retract_speed)
    fastest = max(duty.extend_speed, duty.retract_speed)
    setting = (1.0 + duty.relief_margin) * duty.supply_pressure
    return CylinderCircuit(
        bore=bore,
        rod=rod,
        extend_force=duty.efficiency * (cap * pressed - ring * back),
        retract_force=duty.efficiency * (ring * pressed - cap * back),
        buckling_force=pi**3 * STEEL_STIFFNESS * rod**4 / (64.0 * (2.0 * duty.stroke) ** 2),
        extend_pressure=(duty.extend_force / duty.efficiency + ring * back) / cap,
        retract_pressure=(duty.retract_force / duty.efficiency + cap * back) / ring,
        cap_flow=cap * fastest,
        rod_flow=ring * fastest,
        pump_flow=inflow,
        cycle_time=duty.stroke / duty.extend_speed + duty.stroke / duty.retract_speed,
        relief_setting=setting,
        power=setting * inflow,
        valve_conductance=cap * fastest / sqrt(drop),
        check_valve_area=inflow / (duty.discharge_coefficient * sqrt(2.0 * drop / duty.density)),
        pipe_bore=sqrt(4.0 * cap * fastest / (pi * duty.line_speed)),
    )


def size_cylinder(duty: Duty) -> CylinderCircuit:
    """Return the smallest standard cylinder that meets its duty, with its circuit (section 5.1).

    Returns
    -------
    CylinderCircuit
        With the smallest bore, and the thinnest rod that does not buckle if the load is blocked at the relief setting.

    Raises
    ------
    HydrostateError
        If no standard cylinder meets the duty; the message names the reason.

    Examples
    --------
    >>> found = size_cylinder(Duty(extend_force=10e3, extend_speed=0.1, stroke=0.5, supply_pressure=100e5))
    >>> [round(1e3 * size, 1) for size in (found.bore, found.rod)]
    [40.0, 28.0]
    """
    best_extend, best_retract = 0.0, 0.0
    for bore in (d / 1e3 for d in BORES_MM):
        stalled = pi / 4.0 * bore**2 * (1.0 + duty.relief_margin) * duty.supply_pressure
        least_rod = buckling_rod(stalled, duty.stroke)
        rod = min((d / 1e3 for d in RODS_MM if d / 1e3 >= least_rod), default=inf)
        if rod <= LARGEST_ROD_SHARE * bore:
            found = cylinder_circuit(duty, bore, rod)
            if found.extend_force >= duty.extend_force and found.retract_force >= duty.retract_force:
                return found
            best_extend, best_retract = found.extend_force, found.retract_force
    raise HydrostateError(
        f"no standard cylinder up to {BORES_MM[-1]} mm does it: wanted {duty.extend_force:g} N out and "
        f"{duty.retract_force:g} N in at {duty.supply_pressure:g} Pa, got at most {best_extend:.3g} N and "
        f"{best_retract:.3g} N with a rod that does not buckle"
    )
