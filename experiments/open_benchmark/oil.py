"""Oil with entrained air that boils at its vapour pressure: its volume and its stiffness.

The state of the oil is its *stretch pressure*: the pressure that would act if the oil did not boil. Below the vapour
pressure, the oil's own law gives how much larger the chamber is than the oil; vapour fills the difference, and the
vapour pressure acts. So no oil is lost when a chamber boils or fills again.
"""

from experiments.open_benchmark.machine import ATMOSPHERE, Machine

LEAST_STIFFNESS = 0.05
"""Least stiffness of stretched oil relative to that at atmospheric pressure [dimensionless]."""


def air_space(pressure: float, air: float, m: Machine) -> float:
    """Return the volume of entrained air (polytropic) per unit of oil at atmospheric pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Absolute [Pa].
    air : float
        Entrained air at atmospheric pressure, per unit of oil [dimensionless].
    """
    return air * (ATMOSPHERE / pressure) ** (1.0 / m.polytropic) if air > 0.0 else 0.0


def relative_stiffness(pressure: float, m: Machine) -> float:
    """Return bulk modulus relative to that at atmospheric pressure, linear in pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    """
    return max(1.0 + m.stiffening * (pressure - ATMOSPHERE) / m.bulk_modulus, LEAST_STIFFNESS)


def liquid_space(pressure: float, m: Machine) -> float:
    """Return the volume of the oil alone relative to that at atmospheric pressure [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    m : Machine
        The actuator; with a stiffening of -1 the secant modulus is constant, and volume falls linearly.
    """
    grown = relative_stiffness(pressure, m)
    return grown if m.stiffening == -1.0 else grown ** (-1.0 / m.stiffening)


def specific_volume(pressure: float, air: float, m: Machine) -> float:
    """Return volume relative to the oil's at atmospheric pressure, with bubbles and vapour [dimensionless].

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    air : float
        Entrained air at atmospheric pressure, per unit of oil [dimensionless].
    """
    return liquid_space(pressure, m) + air_space(max(pressure, m.vapour), air, m)


def stiffness(pressure: float, air: float, m: Machine) -> float:
    """Return the tangent bulk modulus [Pa]: minus volume times the derivative of stretch pressure by volume.

    Parameters
    ----------
    pressure : float
        Stretch pressure, absolute [Pa].
    air : float
        Entrained air at atmospheric pressure, per unit of oil [dimensionless].
    """
    oil = m.bulk_modulus * relative_stiffness(pressure, m)
    if air <= 0.0:
        return oil
    liquid, bubbles = liquid_space(pressure, m), air_space(max(pressure, m.vapour), air, m)
    give = bubbles / (m.polytropic * pressure) if pressure > m.vapour else 0.0
    return (liquid + bubbles) / (liquid / oil + give)
