"""The actuator in small motion about a steady velocity: the frequency at which its gain falls by 3 dB."""

from math import pi, sqrt

from plant.eha.model import EhaValues
from plant.eha.steady_state import steady_state


def break_frequency_about(speed: float, p: EhaValues) -> float:
    """Return the -3 dB frequency from motor speed to velocity, about the steady state at a motor speed.

    Equations 5.8 to 5.10, linearised: the slope of quadratic friction, a_2 + 2 a_1 v, damps a mass on a spring of oil.

    Parameters
    ----------
    speed : float
        Mean motor speed [rad/s], positive and above the dead zone.
    p : EhaParameters or namespace of float
        The actuator.

    Returns
    -------
    float
        Frequency [Hz].

    Examples
    --------
    >>> from plant.eha.model import EhaParameters
    >>> [round(break_frequency_about(volts * 31.416, EhaParameters()), 1) for volts in (2.0, 4.0, 7.0)]
    [17.1, 9.7, 6.0]
    """
    velocity, _ = steady_state(speed, p)
    M, A, leakage = p.moving_mass, p.piston_area, p.leakage_coefficient
    slope = p.friction_linear + 2.0 * p.friction_quadratic * abs(velocity)
    oil = p.bulk_modulus / p.chamber_volume
    damping = slope / M + oil * leakage
    stiffness = oil * (A * A + leakage * slope) / M
    part = 2.0 * stiffness - damping * damping
    # |stiffness / (stiffness - w^2 + j w damping)|^2 = 1/2, solved for w^2
    square = 0.5 * (part + sqrt(part * part + 4.0 * stiffness * stiffness))
    return sqrt(square) / (2.0 * pi)
