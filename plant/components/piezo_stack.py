"""The stack of the piezo-stack paper and the piston on it, equations 1 to 3, as forces and rates."""

from plant.compiled.functions import Scalar


def lagged_force_rate(force: Scalar, voltage: Scalar, newtons_a_volt: Scalar, lag: Scalar) -> Scalar:
    """Return the rate of the stack's linear force, equation 2 read as the intended first-order lag (errata P2).

    Parameters
    ----------
    force : float or Expression
        Linear force F_lin [N].
    voltage : float or Expression
        Drive u [V].
    newtons_a_volt : float or Expression
        k_u [N/V].
    lag : float or Expression
        tau [s].

    Returns
    -------
    float or Expression
        Rate of F_lin [N/s].

    Examples
    --------
    >>> lagged_force_rate(0.0, 100.0, 50.0, 1e-4)
    50000000.0
    """
    return (newtons_a_volt * voltage - force) / lag


def stack_force(
    driven: Scalar, hysteresis: Scalar, displacement: Scalar, velocity: Scalar, stiffness: Scalar, damping: Scalar
) -> Scalar:
    """Return the force that the stack exerts, and that a sensor below it measures: equation 2 without its mass.

    Parameters
    ----------
    driven : float, ndarray or Expression
        Linear force F_lin [N].
    hysteresis : float, ndarray or Expression
        h, which reduces the stroke (errata P2) [m].
    displacement, velocity : float, ndarray or Expression
        Displacement [m] and velocity [m/s] of the stack's end.
    stiffness, damping : float or Expression
        k_0 [N/m], c_0 [N s/m].

    Returns
    -------
    float, ndarray or Expression
        Force [N].

    Examples
    --------
    >>> round(stack_force(5000.0, 2e-6, 20e-6, 0.0, 1.5e8, 300.0), 6)
    1700.0
    """
    return driven - stiffness * (hysteresis + displacement) - damping * velocity
