"""Oil with entrained air that boils at its vapour pressure: how much room it takes, and how stiff it is."""

import math

from experiments.open_benchmark.machine import ATMOSPHERE, VOID, Machine


def air_space(pressure: float, air: float, m: Machine) -> float:
    """Return the room that entrained air takes, polytropic, a unit of oil at atmospheric pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    m : Machine
        The actuator.
    """
    return air * (ATMOSPHERE / pressure) ** (1.0 / m.polytropic) if air > 0.0 else 0.0


def liquid_space(pressure: float, m: Machine) -> float:
    """Return the room that the oil itself takes over that at atmospheric pressure, its stiffness linear in pressure.

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    m : Machine
        The actuator; with a stiffening of -1 the secant modulus is constant, and volume falls evenly.
    """
    grown = 1.0 + m.stiffening * (pressure - ATMOSPHERE) / m.bulk_modulus
    return grown if m.stiffening == -1.0 else grown ** (-1.0 / m.stiffening)


def specific_volume(pressure: float, air: float, m: Machine) -> float:
    """Return volume over volume at atmospheric pressure; below the vapour pressure it grows at almost no change of it.

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    m : Machine
        The actuator.
    """
    full = max(pressure, m.vapour)
    return (liquid_space(full, m) + air_space(full, air, m)) * math.exp((full - pressure) / VOID)


def stiffness(pressure: float, air: float, m: Machine) -> float:
    """Return the tangent bulk modulus [Pa], minus volume times the slope of pressure in it.

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    m : Machine
        The actuator.
    """
    if pressure < m.vapour:
        return VOID
    oil = m.bulk_modulus + m.stiffening * (pressure - ATMOSPHERE)
    if air <= 0.0:
        return oil
    liquid, bubbles = liquid_space(pressure, m), air_space(pressure, air, m)
    return (liquid + bubbles) / (liquid / oil + bubbles / (m.polytropic * pressure))
