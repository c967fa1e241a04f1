"""Oil with entrained air that boils at its vapour pressure: how much room it takes, and how stiff it is.

A state of oil is its *stretch pressure*: what the pressure would be if oil did not boil. Below the vapour pressure the
oil's own law gives by how much a chamber has outgrown it, which is vapour, and what acts is the vapour pressure. So no
oil is lost when a chamber boils or fills again.
"""

from experiments.open_benchmark.machine import ATMOSPHERE, Machine

THINNEST = 0.05
"""Least stiffness of stretched oil over that at atmospheric pressure [dimensionless]."""


def air_space(pressure: float, air: float, m: Machine) -> float:
    """Return the room that entrained air takes, polytropic, a unit of oil at atmospheric pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    """
    return air * (ATMOSPHERE / pressure) ** (1.0 / m.polytropic) if air > 0.0 else 0.0


def stiffened(pressure: float, m: Machine) -> float:
    """Return bulk modulus over that at atmospheric pressure, linear in pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    """
    return max(1.0 + m.stiffening * (pressure - ATMOSPHERE) / m.bulk_modulus, THINNEST)


def liquid_space(pressure: float, m: Machine) -> float:
    """Return the room of the oil itself over that at atmospheric pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    m : Machine
        The actuator; with a stiffening of -1 the secant modulus is constant, and volume falls evenly.
    """
    grown = stiffened(pressure, m)
    return grown if m.stiffening == -1.0 else grown ** (-1.0 / m.stiffening)


def specific_volume(pressure: float, air: float, m: Machine) -> float:
    """Return volume over that of the oil at atmospheric pressure, bubbles and vapour included [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    """
    return liquid_space(pressure, m) + air_space(max(pressure, m.vapour), air, m)


def stiffness(pressure: float, air: float, m: Machine) -> float:
    """Return the tangent bulk modulus [Pa], minus volume times the slope of the stretch pressure in it.

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    air : float
        At atmospheric pressure, a unit of oil [dimensionless].
    """
    oil = m.bulk_modulus * stiffened(pressure, m)
    if air <= 0.0:
        return oil
    liquid, bubbles = liquid_space(pressure, m), air_space(max(pressure, m.vapour), air, m)
    give = bubbles / (m.polytropic * pressure) if pressure > m.vapour else 0.0
    return (liquid + bubbles) / (liquid / oil + give)
