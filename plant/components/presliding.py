"""Presliding friction, which yields before it slides: a LuGre bristle with the steady-state law, equation 5.10.

Why LuGre and not Dahl: under minor friction a_2 is negative (errata E12), so the force decreases with speed. A Dahl
spring needs that part in parallel, as negative damping, which shakes the mass on the spring and creates energy; the
LuGre bristle has the decreasing part in its own steady-state law g(v), and cannot release more energy than it
received.

The law is split so that it is passive and exact in the steady state. With ``falling = max(-a_2, 0)``::

    g(v) = a_3 / (1 + falling |v| / a_3)                                       held by the bristle
    rest = max(a_2, 0) v + v |v| (a_1 - falling^2 / (a_3 + falling |v|))       seals and throttle, beside it

and ``g(v) sign(v) + rest`` is equation 5.10 to the last digit. Source: Canudas de Wit et al., IEEE Transactions on
Automatic Control 40 (1995), equations 1 to 3, for the bristle; the split is ours.
"""

from plant.compiled.functions import Scalar, absolute, maximum, sqrt, where


def bristle_rate(velocity: Scalar, bristle: Scalar, linear: Scalar, coulomb: Scalar, displacement: Scalar) -> Scalar:
    """Return the rate of the bristle's deflection, normalised by the deflection at which it slides.

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    bristle : float or Expression
        Deflection over `displacement` [dimensionless], -1 to 1.
    linear, coulomb : float or Expression
        Coefficients a_2 [N s/m], a_3 [N].
    displacement : float or Expression
        Presliding displacement [m], positive.

    Returns
    -------
    float or Expression
        Rate [1/s].

    Examples
    --------
    >>> float(bristle_rate(0.04, 1.0, 2.144e3, 436.0, 2e-5))
    0.0
    """
    falling = maximum(-linear, 0.0) / where(coulomb > 0.0, coulomb, 1.0)
    speed = absolute(velocity)
    return (velocity - speed * bristle * (1.0 + falling * speed)) / displacement


def presliding_friction(
    velocity: Scalar,
    bristle: Scalar,
    rate: Scalar,
    coefficients: tuple[Scalar, Scalar, Scalar],
    displacement: Scalar,
    mass: Scalar,
    damping_ratio: Scalar,
) -> Scalar:
    """Return the friction force of a deflecting bristle and of the sliding part in parallel with it.

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    bristle : float or Expression
        Deflection over `displacement` [dimensionless].
    rate : float or Expression
        Its rate, from `bristle_rate` [1/s].
    coefficients : tuple of float or Expression
        a_1 [N s^2/m^2], a_2 [N s/m], a_3 [N].
    displacement : float or Expression
        Presliding displacement [m].
    mass : float or Expression
        Moving mass [kg].
    damping_ratio : float or Expression
        Damping ratio of the mass on the bristle [dimensionless]. It is multiplied by a factor that falls as the bristle
        slides, ``1 / (1 + damping |v| / a_3)``, which keeps the friction passive at any speed.

    Returns
    -------
    float or Expression
        Force against the motion [N].

    Examples
    --------
    >>> round(float(presliding_friction(0.04, 1.0, 0.0, (6.589e4, 2.144e3, 436.0), 2e-5, 7.376, 0.2)), 3)
    627.184
    """
    quadratic, linear, coulomb = coefficients
    held = where(coulomb > 0.0, coulomb, 1.0)
    speed = absolute(velocity)
    falling = maximum(-linear, 0.0)
    damping = 2.0 * damping_ratio * sqrt(coulomb * mass / displacement)
    fading = damping * displacement / (1.0 + damping / held * speed)
    beside = maximum(linear, 0.0) * velocity + velocity * speed * (
        quadratic - falling * falling / (held + falling * speed)
    )
    return coulomb * bristle + fading * rate + beside
