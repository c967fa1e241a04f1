"""The piston's friction, as a force law and as an implicit step in which the piston really sticks."""

from plant.compiled.functions import Scalar, absolute, sqrt, where


def quadratic_friction(
    velocity: Scalar, direction: Scalar, quadratic: Scalar, linear: Scalar, coulomb: Scalar
) -> Scalar:
    """Return the friction force of a sliding piston, equation 5.10.

    The law is also written in four other forms, first in `sliding`; ``docs/friction-law.md`` lists them.

    Parameters
    ----------
    velocity : float or Expression
        Piston velocity [m/s].
    direction : float or Expression
        Direction of sliding, -1 or 1 [dimensionless]; the sign of the velocity, or the direction of the coming
        breakaway.
    quadratic, linear, coulomb : float or Expression
        Coefficients a_1 [N s^2/m^2], a_2 [N s/m], a_3 [N].

    Returns
    -------
    float or Expression
        Force against the motion [N].

    Examples
    --------
    >>> round(quadratic_friction(0.04, 1.0, 6.589e4, 2.144e3, 436.0), 3)
    627.184
    """
    return linear * velocity + (quadratic * velocity**2 + coulomb) * direction


def velocity_under_friction(push: Scalar, resistance: Scalar, quadratic: Scalar, coulomb: Scalar) -> Scalar:
    """Solve ``resistance * v + quadratic * v * |v| + coulomb * Sgn(v) = push`` for v, where Sgn(0) is all of [-1, 1].

    This is the force balance, equation 5.9, with the friction of equation 5.10 over one implicit step. Below the
    Coulomb force the result is exactly zero, so the piston sticks. Above it there is one root if the resistance is
    positive, computed in a form without cancellation.

    Parameters
    ----------
    push : float or Expression
        Driving force, including the momentum at the start of the step [N].
    resistance : float or Expression
        Everything proportional to the new velocity [N s/m], positive.
    quadratic : float or Expression
        Quadratic friction a_1 [N s^2/m^2].
    coulomb : float or Expression
        Coulomb friction a_3 [N].

    Returns
    -------
    float or Expression
        New velocity [m/s].

    Examples
    --------
    >>> float(velocity_under_friction(400.0, 1e4, 6.589e4, 436.0))
    0.0
    >>> v = float(velocity_under_friction(-900.0, 1e4, 6.589e4, 436.0))
    >>> round(1e4 * v - 6.589e4 * v * v - 436.0, 9)
    -900.0
    """
    return sliding(push, resistance, quadratic, coulomb)[0]


def sliding(push: Scalar, resistance: Scalar, quadratic: Scalar, coulomb: Scalar) -> tuple[Scalar, Scalar]:
    """Return the velocity of `velocity_under_friction`, and half the derivative of the force by the velocity.

    Source: the root of the quadratic in the velocity, differentiated by the force.

    Parameters
    ----------
    push : float or Expression
        Driving force, including the momentum at the start of the step [N].
    resistance : float or Expression
        Everything proportional to the new velocity [N s/m], positive.
    quadratic : float or Expression
        Quadratic friction a_1 [N s^2/m^2].
    coulomb : float or Expression
        Coulomb friction a_3 [N].

    Returns
    -------
    tuple of (float or Expression, float or Expression)
        New velocity [m/s]; and half the derivative of the force by the velocity during sliding [N s/m].

    Examples
    --------
    >>> v, stiff = sliding(900.0, 1e4, 6.589e4, 436.0)
    >>> more, _ = sliding(900.0 + 2.0 * stiff * 1e-6, 1e4, 6.589e4, 436.0)
    >>> round(1e6 * float(more - v), 3)
    1.0
    """
    half = 0.5 * resistance
    excess = where(push > 0.0, push - coulomb, push + coulomb)
    root = sqrt(half * half + quadratic * absolute(excess))
    return where(absolute(push) <= coulomb, 0.0, excess / (half + root)), root
