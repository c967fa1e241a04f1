"""The functions that a model may use, for floats, arrays and symbols.

Models written with these functions and ``+ - * / **`` can be run, vectorised, differentiated and compiled.
"""

from typing import Any, TypeAlias, cast

import numpy as np

from plant.compiled.expression import Expression, as_expression, select, unary

Scalar: TypeAlias = Any
"""A float, an array of shape (runs,), or an `Expression`: any argument of a model."""


def _apply(name: str, x: Scalar) -> Scalar:
    if isinstance(x, Expression):
        return unary(name, x)
    return getattr(np, name)(x)


def sqrt(x: Scalar) -> Scalar:
    """Return the square root.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Not negative, any unit.

    Returns
    -------
    float, ndarray or Expression
        Its root.
    """
    return _apply("sqrt", x)


def exp(x: Scalar) -> Scalar:
    """Return e to the power x.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Dimensionless.

    Returns
    -------
    float, ndarray or Expression
        The exponential.
    """
    return _apply("exp", x)


def log(x: Scalar) -> Scalar:
    """Return the natural logarithm.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Positive, dimensionless.

    Returns
    -------
    float, ndarray or Expression
        Its logarithm.
    """
    return _apply("log", x)


def tanh(x: Scalar) -> Scalar:
    """Return the hyperbolic tangent.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Dimensionless.

    Returns
    -------
    float, ndarray or Expression
        Between -1 and 1.
    """
    return _apply("tanh", x)


def sin(x: Scalar) -> Scalar:
    """Return the sine.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Angle [rad].

    Returns
    -------
    float, ndarray or Expression
        Between -1 and 1.
    """
    return _apply("sin", x)


def cos(x: Scalar) -> Scalar:
    """Return the cosine.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Angle [rad].

    Returns
    -------
    float, ndarray or Expression
        Between -1 and 1.
    """
    return _apply("cos", x)


def arctan(x: Scalar) -> Scalar:
    """Return the angle of a tangent.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Dimensionless.

    Returns
    -------
    float, ndarray or Expression
        Angle between -pi/2 and pi/2 [rad].
    """
    return unary("atan", x) if isinstance(x, Expression) else np.arctan(x)


def sign(x: Scalar) -> Scalar:
    """Return -1, 0 or 1; held constant in derivatives.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Any unit.

    Returns
    -------
    float, ndarray or Expression
        The sign.
    """
    return _apply("sign", x)


def absolute(x: Scalar) -> Scalar:
    """Return the magnitude; its derivative is the sign.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Any unit.

    Returns
    -------
    float, ndarray or Expression
        The magnitude.
    """
    return abs(x)


def where(condition: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """Return a if the condition holds, else b; both are evaluated.

    Parameters
    ----------
    condition : bool, ndarray of shape (runs,), or Expression
        A comparison.
    a, b : float, ndarray of shape (runs,), or Expression
        The two values, in one unit.

    Returns
    -------
    float, ndarray or Expression
        The chosen value.

    Examples
    --------
    >>> float(where(2.0 > 1.0, 10.0, 20.0))
    10.0
    """
    if isinstance(condition, Expression):
        return select(condition, as_expression(a), as_expression(b))
    return cast("Scalar", np.where(condition, a, b))


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """Return the larger of two.

    Parameters
    ----------
    a, b : float, ndarray of shape (runs,), or Expression
        In one unit.

    Returns
    -------
    float, ndarray or Expression
        The larger.
    """
    return where(a > b, a, b)


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """Return the smaller of two.

    Parameters
    ----------
    a, b : float, ndarray of shape (runs,), or Expression
        In one unit.

    Returns
    -------
    float, ndarray or Expression
        The smaller.
    """
    return where(a < b, a, b)
