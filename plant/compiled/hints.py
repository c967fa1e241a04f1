"""Hints of a model about its own arithmetic: known derivatives, waypoints of a covariance, late values.

No hint changes a value. A number is returned unchanged, and so is any value that is not an expression.
"""

from plant.compiled.expression import ONE, ZERO, Expression, as_expression, node, select
from plant.compiled.functions import Scalar


def frozen(x: Scalar) -> Scalar:
    """Return the same number, constant in derivatives.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Any unit.

    Returns
    -------
    float, ndarray or Expression
        The number.
    """
    return _with_slopes(x, (ZERO, ZERO))


def with_derivatives(x: Scalar, *slopes: tuple[Scalar, Scalar]) -> Scalar:
    """Return the same number with known derivatives: an equation's solution changes as the equation's balance does.

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Any unit.
    *slopes : tuple of (float or Expression, float or Expression)
        The quantities on which it depends [any unit], each with its derivative by that quantity [unit of x over that
        one's]; the operands from which it is computed are ignored.

    Returns
    -------
    float, ndarray or Expression
        The number.

    Examples
    --------
    The root of ``x * x = a`` moves by ``1 / (2 x)`` of what leaves that balance:

    >>> from plant.compiled.expression import jacobian, symbol, unary
    >>> a = symbol("a")
    >>> x = unary("sqrt", a)
    >>> [[slope]] = jacobian([with_derivatives(x, (a - frozen(x) * frozen(x), 0.5 / x))], [a])
    >>> slope.operation, slope.arguments[0].value
    ('/', 0.5)
    """
    if not isinstance(x, Expression):
        return x
    return _with_slopes(x, *((as_expression(one), as_expression(slope)) for one, slope in slopes))


def waypoint(x: Scalar) -> Scalar:
    """Return the same number, marked as a node that a filter's covariance passes through (`estimation.engine.spread`).

    Parameters
    ----------
    x : float, ndarray of shape (runs,), or Expression
        Any unit.

    Returns
    -------
    float, ndarray or Expression
        The number.
    """
    return _with_slopes(x, (x, ONE))


def is_waypoint(item: Expression) -> bool:
    """Return whether a node is a waypoint of a covariance."""
    if len(item.slopes) != 1 or item.slopes[0][1] is not ONE:
        return False
    itself = item.slopes[0][0]
    return itself.operation == item.operation and list(map(id, itself.arguments)) == list(map(id, item.arguments))


def _with_slopes(x: Scalar, *slopes: tuple[Expression, Expression]) -> Scalar:
    return node(x.operation, *x.arguments, value=x.value, slopes=slopes) if isinstance(x, Expression) else x


def affine_form(y: Scalar, x: Scalar) -> Scalar:
    """Return y, which is affine in x, as a sum of a part that does not wait for x and a multiple of x.

    Parameters
    ----------
    y : float, ndarray of shape (runs,), or Expression
        Any unit.
    x : float, ndarray of shape (runs,), or Expression
        The quantity that is available late, any unit; None if there is none.

    Returns
    -------
    float, ndarray or Expression
        The same value, to rounding.

    Raises
    ------
    ValueError
        If y is not affine in x.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import lines_source
    >>> x, a, b = symbol("x"), symbol("a"), symbol("b")
    >>> print(lines_source("lines", {"y": affine_form((x - a) * b + x, x)}))
    def lines(a, b, x):
        t0_ = 0.0 - a
        t1_ = t0_ * b
        t2_ = b + 1.0
        t3_ = t2_ * x
        t4_ = t1_ + t3_
        return {"y": t4_}
    """
    if not isinstance(y, Expression) or not isinstance(x, Expression):
        return y
    rest, slope = _affine(y, {id(x): (ZERO, ONE)})
    return rest + slope * x


def _affine(item: Expression, known: dict[int, tuple[Expression, Expression]]) -> tuple[Expression, Expression]:
    """Return a node without x, and its slope by x; the condition of a choice may still depend on x."""
    if id(item) not in known:
        operands = item.arguments[1:] if item.operation == "where" else item.arguments
        parts = [_affine(one, known) for one in operands]
        moves = any(slope is not ZERO for _, slope in parts)
        known[id(item)] = _affine_of(item, parts) if moves else (item, ZERO)
    return known[id(item)]


def _affine_of(item: Expression, parts: list[tuple[Expression, Expression]]) -> tuple[Expression, Expression]:
    """Return a node without x, and its slope by x, from those of its operands."""
    (a, da), (b, db) = parts if len(parts) == 2 else ((ZERO, ONE), (ZERO, ONE))
    match item.operation:
        case "where":
            return select(item.arguments[0], a, b), select(item.arguments[0], da, db)
        case "+":
            return a + b, da + db
        case "-":
            return a - b, da - db
        case "*" if da is ZERO or db is ZERO:
            return a * b, a * db if da is ZERO else da * b
        case "/" if db is ZERO:
            return a / b, da / b
        case _:
            raise ValueError(f"{item.operation!r} is not affine in what comes late")
