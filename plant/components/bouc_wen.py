"""Bouc-Wen hysteresis: the asymmetric law of a piezo stack and the classical law of a yielding spring.

Both are rate-independent: the hysteresis changes only if its input changes. Written without ``sign``, they are
Lipschitz continuous.
"""

from plant.compiled.functions import Scalar, absolute, exp, log, maximum

LEAST_SIZE = 1e-12
"""Smallest hysteresis [V] in the powers, since zero has no logarithm."""


def asymmetric_bouc_wen_rate(
    rate: Scalar, hysteresis: Scalar, alpha: Scalar, phi_1: Scalar, phi_2: Scalar, phi_3: Scalar, gamma: Scalar
) -> Scalar:
    """Return the rate of the asymmetric law, equation 1 (24, 28) of the piezo-stack paper, multiplied out (errata P1).

    Parameters
    ----------
    rate : float or Expression
        Rate of the input, voltage for a stack [V/s].
    hysteresis : float or Expression
        Hysteretic displacement h [m].
    alpha : float or Expression
        Small-signal slope [m/V].
    phi_1, phi_2, phi_3, gamma : float or Expression
        Shape of the loop, on the four signs of rate and hysteresis [1/V].

    Returns
    -------
    float or Expression
        Rate of h [m/s].

    Examples
    --------
    >>> round(1e9 * asymmetric_bouc_wen_rate(100.0, 1e-6, 6e-8, 0.02, 0.003, -0.002, -0.004), 6)
    4300.0
    """
    speed, size = absolute(rate), absolute(hysteresis)
    return alpha * rate - speed * (phi_1 * hysteresis + phi_2 * size) - rate * (phi_3 * hysteresis + gamma * size)


def bouc_wen_rate(rate: Scalar, force: Scalar, alpha: Scalar, beta: Scalar, gamma: Scalar, delta: Scalar) -> Scalar:
    """Return the rate of the classical force, exponent 1: ``alpha y' - beta (gamma |y'| z + delta y' |z|)``.

    Source: Noël and Schoukens, hysteretic benchmark with a dynamic nonlinearity (2016), its equation 2.

    Parameters
    ----------
    rate : float or Expression
        Velocity [m/s].
    force : float or Expression
        Hysteretic force z [N].
    alpha : float or Expression
        Small-signal stiffness [N/m].
    beta : float or Expression
        Rate at which the force saturates [1/m].
    gamma, delta : float or Expression
        Shape of the loop [dimensionless]; only their products with beta act.

    Returns
    -------
    float or Expression
        Rate of z [N/s].

    Examples
    --------
    >>> bouc_wen_rate(0.01, 10.0, 5e4, 1e3, 0.8, -1.1)
    530.0
    """
    return alpha * rate - beta * (gamma * absolute(rate) * force + delta * rate * absolute(force))


def power_bouc_wen_rate(
    rate: Scalar, hysteresis: Scalar, alpha: Scalar, beta: Scalar, gamma: Scalar, exponent: Scalar
) -> Scalar:
    """Return the rate of the classical law for any exponent, ``a u' - b |u'| h |h|^(n-1) - g u' |h|^n``.

    Source: equation 21 of the diaphragm-motor paper, with the rates that it omits (errata M21).

    Parameters
    ----------
    rate : float or Expression
        Rate of the input, voltage for a diaphragm [V/s].
    hysteresis : float or Expression
        Hysteretic part of the input h [V].
    alpha : float or Expression
        Small-signal slope [dimensionless].
    beta, gamma : float or Expression
        Shape of the loop, 1/V^n [units of that].
    exponent : float or Expression
        Sharpness n of the yield, at least 1 [dimensionless].

    Returns
    -------
    float or Expression
        Rate of h [V/s].

    Examples
    --------
    >>> round(float(power_bouc_wen_rate(100.0, 10.0, 0.3, 0.006, 0.002, 1.0)), 9)
    22.0
    """
    size = absolute(hysteresis)
    power = exp((exponent - 1.0) * log(maximum(size, LEAST_SIZE)))
    return alpha * rate - power * (beta * absolute(rate) * hysteresis + gamma * rate * size)
