"""Robust updates: how an innovation too large for noise counts."""

from plant.compiled.expression import ONE, Expression, unary
from plant.compiled.functions import where

HUBER = 3.0
"""Innovations beyond this many standard deviations count linearly [dimensionless]."""

DEGREES = 4.0
"""Degrees of freedom of the Student-t noise [dimensionless]."""


def inflation(robust: str, ratio: Expression) -> Expression:
    """Return the inflation of a channel's noise variance for an innovation too large to be noise.

    Parameters
    ----------
    robust : str
        ``"none"``; ``"huber"``: beyond three standard deviations an innovation counts linearly (Huber 1964);
        ``"student-t"``: the scale that a t distribution with four degrees of freedom expects (Lange, Little and Taylor
        1989, equation 3), so that a gross outlier has no effect.
    ratio : Expression
        Innovation squared over its variance [dimensionless].

    Returns
    -------
    Expression
        Factor on the measurement variance, 1 or more.
    """
    if robust == "huber":
        return where(ratio > HUBER**2, unary("sqrt", ratio) / HUBER, ONE)
    if robust == "student-t":
        return where(ratio > 1.0, (DEGREES + ratio) / (DEGREES + 1.0), ONE)
    return ONE
