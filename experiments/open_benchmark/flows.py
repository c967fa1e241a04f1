"""Flows of the open benchmark's actuator: pump, leakage, drain, relief and make-up."""

import math

from experiments.open_benchmark.machine import LIFT, PRELOAD, Machine
from experiments.open_benchmark.oil import specific_volume


def orifice_flow(drop: float, coefficient: float) -> float:
    """Return turbulent flow through an orifice [m^3/s], laminar below `PRELOAD`.

    Parameters
    ----------
    drop : float
        Pressure difference [Pa].
    coefficient : float
        Flow at one pascal if it were turbulent [m^3/(s Pa^0.5)].
    """
    return coefficient * drop / math.sqrt(math.sqrt(drop * drop + PRELOAD * PRELOAD))


def check_flow(chamber: float, other: float, supply: float, valve: tuple[float, float, float, float]) -> float:
    """Return the flow of a check valve into its chamber [m^3/s]; the other chamber's pressure also opens a piloted one.

    Parameters
    ----------
    chamber, other, supply : float
        Absolute pressures [Pa].
    valve : tuple of float
        Flow coefficient [m^3/(s Pa^0.5)], cracking pressure [Pa], leak of the seat [m^3/(s Pa)], pilot ratio
        [dimensionless].
    """
    coefficient, crack, seat_leak, pilot = valve
    pushed = supply - chamber - crack + pilot * max(other - supply, 0.0)
    opening = min(max(pushed / LIFT, 0.0), 1.0)
    return opening * orifice_flow(supply - chamber, coefficient) + seat_leak * (supply - chamber)


def pump_flow(speed: float, angle: float, m: Machine) -> float:
    """Return the flow of a gear pump, including the ripple of its teeth [m^3/s]; its losses never drive it (errata E8).

    Parameters
    ----------
    speed : float
        Motor speed [rad/s].
    angle : float
        Shaft angle [rad].
    """
    geometric = m.efficiency * m.displacement * speed * (1.0 + m.ripple * math.cos(m.teeth * angle))
    return math.copysign(max(abs(geometric) - m.flow_bias, 0.0), geometric)


def filling(pressure: float, air: float, m: Machine) -> float:
    """Return the filling of the pump's tooth spaces; boiling oil is partly vapour [fraction].

    Parameters
    ----------
    pressure : float
        Stretch pressure of the inlet, absolute [Pa].
    air : float
        Entrained air at atmospheric pressure, per unit of oil [dimensionless].
    """
    return 1.0 if pressure >= m.vapour else specific_volume(m.vapour, air, m) / specific_volume(pressure, air, m)


def leakage_flow(drop: float, coefficient: float, m: Machine) -> float:
    """Return the flow across seals and gaps [m^3/s]: laminar, except for a turbulent share.

    Parameters
    ----------
    drop : float
        Pressure difference [Pa].
    coefficient : float
        Laminar leakage, or the sum of laminar and turbulent leakage at the reference pressure [m^3/(s Pa)].
    """
    laminar = (1.0 - m.turbulent) * coefficient * drop
    return laminar + m.turbulent * orifice_flow(drop, coefficient * math.sqrt(m.turbulent_pressure))


def oil_flows(
    pump: tuple[float, float], pressures: tuple[float, float, float], thin: float, air: float, m: Machine
) -> tuple[float, float, float]:
    """Return the oil that chamber A and B gain and the accumulator loses, as volume at atmospheric pressure [m^3/s].

    Each flow has the density of the side that it leaves, and the pump's flow that of its outlet, so no oil is lost.

    Parameters
    ----------
    pump : tuple of float
        Motor speed [rad/s] and shaft angle [rad].
    pressures : tuple of float
        Stretch pressures of chambers A and B, and the accumulator's pressure, absolute [Pa].
    thin : float
        Factor by which thinner oil and wear raise leakage above the machine's value [dimensionless].
    air : float
        Entrained air at atmospheric pressure, per unit of oil [dimensionless].
    """
    supply = pressures[2]
    density_a, density_b = 1.0 / specific_volume(pressures[0], air, m), 1.0 / specific_volume(pressures[1], air, m)
    density = 1.0 / specific_volume(supply, air, m)
    a, b = max(pressures[0], m.vapour), max(pressures[1], m.vapour)
    delivered = pump_flow(pump[0], pump[1], m)
    fill_a, fill_b = filling(pressures[1], air, m), filling(pressures[0], air, m)
    pumped = delivered * (density_a * fill_a if delivered > 0.0 else density_b * fill_b)
    drop = a - b
    across = leakage_flow(drop, thin * (m.leakage - 0.5 * m.drain), m)
    across += math.copysign(m.relief_slope * max(abs(drop) - m.relief, 0.0), drop)
    across *= density_a if drop > 0.0 else density_b
    drained_a = thin * m.drain * max(a - supply, 0.0) * density_a
    drained_b = thin * m.drain * max(b - supply, 0.0) * density_b
    made_a = check_flow(a, b, supply, (m.check_a, m.crack_a, m.seat_leak_a, m.pilot))
    made_b = check_flow(b, a, supply, (m.check_b, m.crack_b, m.seat_leak_b, m.pilot))
    made_a *= density if made_a > 0.0 else density_a
    made_b *= density if made_b > 0.0 else density_b
    into_a = pumped - across - drained_a + made_a
    into_b = across - pumped - drained_b + made_b
    return into_a, into_b, into_a + into_b
