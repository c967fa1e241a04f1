"""Arithmetic as a graph: the result of a model function that is called with symbols.

Equal sub-expressions are one node, so common sub-expressions cost nothing. Differentiation works node by node: its size
grows with the model's operations, not with the size of the expanded formula.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from plant.errors import ModelError

Number: TypeAlias = float | int


@dataclass(frozen=True, eq=False)
class Expression:
    """One operation of the graph.

    Parameters
    ----------
    operation : str
        ``symbol``, ``constant``, a comparison, or another operation that `plant.compiled.source` can write.
    value : float or str
        A constant's value [any unit], or a symbol's name.
    slopes : tuple of (Expression, Expression)
        What it depends on for derivatives, each with the derivative by it; if empty, its arguments.

    Raises
    ------
    ModelError
        If a model uses it as a truth value, compares it with ``==``, or raises it to a broken power.
    """

    operation: str
    arguments: tuple["Expression", ...]
    value: float | str = 0.0
    slopes: tuple[tuple["Expression", "Expression"], ...] = ()

    def __add__(self, other: "Expression | Number") -> "Expression":
        b = as_expression(other)
        if self is ZERO:
            return b
        return self if b is ZERO else node("+", self, b)

    def __radd__(self, other: Number) -> "Expression":
        return as_expression(other) + self

    def __sub__(self, other: "Expression | Number") -> "Expression":
        b = as_expression(other)
        if b is ZERO:
            return self
        return ZERO if self is b else node("-", self, b)

    def __rsub__(self, other: Number) -> "Expression":
        return as_expression(other) - self

    def __mul__(self, other: "Expression | Number") -> "Expression":
        b = as_expression(other)
        if self is ZERO or b is ZERO:
            return ZERO
        if self is ONE:
            return b
        return self if b is ONE else node("*", self, b)

    def __rmul__(self, other: Number) -> "Expression":
        return as_expression(other) * self

    def __truediv__(self, other: "Expression | Number") -> "Expression":
        b = as_expression(other)
        return self if self is ZERO or b is ONE else node("/", self, b)

    def __rtruediv__(self, other: Number) -> "Expression":
        return as_expression(other) / self

    def __pow__(self, exponent: "Expression | Number") -> "Expression":
        if isinstance(exponent, Expression) or exponent != int(exponent):
            got = "a symbol" if isinstance(exponent, Expression) else exponent
            raise ModelError(
                f"a model may raise to whole powers only, beside sqrt and exp, got {got}: write exp(power * log(x))"
            )
        result: Expression = ONE
        for _ in range(abs(int(exponent))):
            result = result * self
        return result if exponent >= 0 else ONE / result

    def __neg__(self) -> "Expression":
        return ZERO - self

    def __pos__(self) -> "Expression":
        return self

    def __abs__(self) -> "Expression":
        return unary("abs", self)

    def __lt__(self, other: "Expression | Number") -> "Expression":
        return node("<", self, as_expression(other))

    def __le__(self, other: "Expression | Number") -> "Expression":
        return node("<=", self, as_expression(other))

    def __gt__(self, other: "Expression | Number") -> "Expression":
        return node(">", self, as_expression(other))

    def __ge__(self, other: "Expression | Number") -> "Expression":
        return node(">=", self, as_expression(other))

    def __eq__(self, other: object) -> bool:
        raise ModelError("a model must compare with <, <=, > or >=, not with == or !=: its values are symbols here")

    __hash__ = object.__hash__

    def __array_ufunc__(self, function: Any, method: str, *arguments: Any, **options: Any) -> "Expression":
        from plant.compiled.numpy_calls import elementwise_call

        return elementwise_call(function, method, arguments, options)

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> "Expression":
        from plant.compiled.numpy_calls import function_call

        return function_call(function, arguments, options)

    def __bool__(self) -> bool:
        raise ModelError("a model must choose with where(condition, a, b), not with if: its values are symbols here")


_NODES: dict[tuple[str, tuple[int, ...], float | str, tuple[int, ...]], Expression] = {}


def node(
    operation: str,
    *arguments: Expression,
    value: float | str = 0.0,
    slopes: tuple[tuple[Expression, Expression], ...] = (),
) -> Expression:
    """Return the unique node of this operation on these arguments.

    Parameters
    ----------
    value : float or str
        A constant's value [any unit], or a symbol's name.
    slopes : tuple of (Expression, Expression)
        See `Expression`.

    Returns
    -------
    Expression
        The node, created on first use.
    """
    known = tuple(id(one) for pair in slopes for one in pair)
    key = (operation, tuple(id(argument) for argument in arguments), value, known)
    known_as = _NODES.get(key)  # most nodes exist already
    return _NODES.setdefault(key, Expression(operation, arguments, value, slopes)) if known_as is None else known_as


def constant(value: float) -> Expression:
    """Return the node of a number.

    Parameters
    ----------
    value : float
        The number, dimensionless here.
    """
    return node("constant", value=float(value))


def symbol(name: str) -> Expression:
    """Return the node of a named input.

    Parameters
    ----------
    name : str
        A Python identifier.
    """
    return node("symbol", value=name)


def as_expression(value: "Expression | Number") -> Expression:
    """Return the value itself, or the constant node of a number.

    Parameters
    ----------
    value : Expression or float
        What to wrap, dimensionless here.
    """
    return value if isinstance(value, Expression) else constant(float(value))


ZERO = constant(0.0)
ONE = constant(1.0)


def unary(operation: str, a: Expression) -> Expression:
    """Return a one-argument function of a node: ``abs sign sqrt exp log tanh sin cos atan``."""
    return node(operation, a)


def select(condition: Expression, a: Expression, b: Expression) -> Expression:
    """Return ``a`` if the condition holds, else ``b``.

    Parameters
    ----------
    condition : Expression
        A comparison.

    Returns
    -------
    Expression
        The node; ``a`` itself if both are the same.
    """
    return a if a is b else node("where", condition, a, b)


def ordered(outputs: Iterable[Expression], *, by_slopes: bool = False) -> list[Expression]:
    """Return every node that the outputs need, operands before results.

    Parameters
    ----------
    outputs : iterable of Expression
        The final results.
    by_slopes : bool
        Whether to follow the nodes by which a node's derivatives are taken, rather than its operands.
    """
    order: list[Expression] = []
    seen: set[int] = set()
    stack: list[tuple[Expression, bool]] = [(output, False) for output in reversed(list(outputs))]
    while stack:
        item, ready = stack.pop()
        if ready:
            order.append(item)
        elif id(item) not in seen:
            seen.add(id(item))
            stack.append((item, True))
            below = [one for one, _ in item.slopes] if by_slopes and item.slopes else item.arguments
            stack.extend((argument, False) for argument in reversed(below) if id(argument) not in seen)
    return order


def local_derivatives(item: Expression) -> Sequence[Expression]:
    """Return the derivative of a node with respect to each argument; signs and choices are held constant.

    Raises
    ------
    NotImplementedError
        If the derivative of the operation is not defined yet.
    """
    a = item.arguments[0]
    match item.operation:
        case "+" | "-":
            return ONE, ONE if item.operation == "+" else -ONE
        case "*":
            return item.arguments[1], a
        case "/":
            b = item.arguments[1]
            return ONE / b, -(item / b)
        case "abs":
            return (unary("sign", a),)
        case "sqrt":
            return (0.5 / item,)
        case "exp":
            return (item,)
        case "log":
            return (ONE / a,)
        case "tanh":
            return (ONE - item * item,)
        case "sin":
            return (unary("cos", a),)
        case "cos":
            return (-unary("sin", a),)
        case "atan":
            return (ONE / (ONE + a * a),)
        case "where":
            return ZERO, select(a, ONE, ZERO), select(a, ZERO, ONE)
        case "sign" | "<" | "<=" | ">" | ">=" | "present":
            return tuple(ZERO for _ in item.arguments)
        case _:
            raise NotImplementedError(f"operation {item.operation!r} has no derivative yet")


def slopes_of(item: Expression) -> Sequence[tuple[Expression, Expression]]:
    """Return the derivatives of a node, each with the expression by which it is taken."""
    if item.slopes or not item.arguments:
        return item.slopes
    return tuple(zip(item.arguments, local_derivatives(item), strict=True))


def jacobian(outputs: Sequence[Expression], inputs: Sequence[Expression]) -> list[list[Expression]]:
    """Differentiate every output with respect to every input, with sign() and where() held constant.

    Parameters
    ----------
    inputs : sequence of Expression
        Symbols.

    Returns
    -------
    list of list of Expression
        ``result[i][j]`` is the derivative of output i by input j; `ZERO` where it vanishes structurally.
    """
    order = ordered(outputs, by_slopes=True)
    locals_of = {id(item): slopes_of(item) for item in order}
    columns: list[dict[int, Expression]] = []
    for variable in inputs:
        tangent: dict[int, Expression] = {id(variable): ONE}
        for item in order:
            total: Expression = ZERO
            for argument, local in locals_of[id(item)]:
                inner = tangent.get(id(argument), ZERO)
                if inner is not ZERO and local is not ZERO:
                    total = total + _chain(item, local, inner)
            if total is not ZERO:
                tangent[id(item)] = total
        columns.append(tangent)
    return [[tangent.get(id(output), ZERO) for tangent in columns] for output in outputs]


def _chain(item: Expression, local: Expression, inner: Expression) -> Expression:
    """Multiply by a local derivative; a choice selects the tangent rather than multiplying it by 0 or 1."""
    if item.operation != "where" or item.slopes:
        return local * inner
    condition = item.arguments[0]
    chosen = local.arguments[1] is ONE
    return select(condition, inner, ZERO) if chosen else select(condition, ZERO, inner)
