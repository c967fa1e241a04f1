"""Straight lines of a graph as C: the same operations in the same order as in the kernels that Python runs.

Every line is one operation, so no compiler may fuse or reorder what the kernels do not. Choices are conditional
expressions, so each step costs the same number of operations, whatever the data.
"""

from collections import Counter
from collections.abc import Mapping

from plant.compiled.c99.precision import Precision
from plant.compiled.expression import Expression, ordered
from plant.compiled.source import symbols_in

TRUTHS = ("<", "<=", ">", ">=", "present")
"""Operations whose result is a truth, an ``int`` in C."""

KINDS: Mapping[str, str] = {
    "+": "additions",
    "-": "additions",
    "*": "products",
    "fma": "fused products",
    "fnma": "fused products",
    "fms": "fused products",
    "/": "divisions",
    "sqrt": "square roots",
    **dict.fromkeys(("exp", "log", "tanh", "sin", "cos", "atan"), "calls of exp, log, tanh"),
    "abs": "choices and comparisons",
    "sign": "choices and comparisons",
    "where": "choices and comparisons",
    **dict.fromkeys(TRUTHS, "choices and comparisons"),
}
"""What each operation counts as, where operations are counted."""


def spelt_in_c(item: Expression, operands: list[str], precision: Precision) -> str:
    """Return one operation in C.

    Parameters
    ----------
    operands : list of str
        Names of what it works on.

    Examples
    --------
    >>> from plant.compiled.c99.precision import DOUBLE
    >>> from plant.compiled.expression import symbol, unary
    >>> spelt_in_c(unary("sqrt", symbol("x")), ["x"], DOUBLE)
    'sqrt(x)'
    """
    match item.operation:
        case "+" | "-" | "*" | "/" | "<" | "<=" | ">" | ">=":
            return f"{operands[0]} {item.operation} {operands[1]}"
        case "present":
            return f"!isnan({operands[0]})"
        case "fma":
            return f"FUSED({operands[0]}, {operands[1]}, {operands[2]})"
        case "fnma":
            return f"FUSED(-{operands[0]}, {operands[1]}, {operands[2]})"
        case "fms":
            return f"FUSED({operands[0]}, {operands[1]}, -{operands[2]})"
        case "where":
            return f"{operands[0]} ? {operands[1]} : {operands[2]}"
        case "sign":
            zero, one = precision.literal(0.0), precision.literal(1.0)
            return f"({operands[0]} > {zero}) ? {one} : (({operands[0]} < {zero}) ? -{one} : {zero})"
        case "abs":
            return f"{precision.function('fabs')}({operands[0]})"
        case "sqrt" | "exp" | "log" | "tanh" | "sin" | "cos" | "atan":
            return f"{precision.function(item.operation)}({operands[0]})"
        case _:
            raise NotImplementedError(f"operation {item.operation!r} has no spelling in C yet")


def c_lines(
    outputs: Mapping[str, Expression], reads: Mapping[str, str], writes: Mapping[str, str], precision: Precision
) -> list[str]:
    r"""Write the body of a function that reads symbols, computes, then writes all results.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.
    reads : Mapping[str, str]
        Where each symbol is read from; only those needed are.
    writes : Mapping[str, str]
        Where each output goes.

    Returns
    -------
    list of str
        Lines of C, not indented.

    Examples
    --------
    >>> from plant.compiled.c99.precision import DOUBLE
    >>> from plant.compiled.expression import symbol
    >>> x = symbol("x")
    >>> print("\n".join(c_lines({"x": x * x + 1.0}, {"x": "state[0]"}, {"x": "state[0]"}, DOUBLE)))
    const double x = state[0];
    const double t0 = x * x;
    const double t1 = t0 + 1.0;
    state[0] = t1;
    """
    lines = [
        f"const {precision.name} {name} = {reads[name]};"
        for name in sorted(symbols_in(list(outputs.values())))
        if reads[name] != name
    ]
    names: dict[int, str] = {}
    count = 0
    for item in ordered(outputs.values()):
        if item.operation == "symbol":
            names[id(item)] = str(item.value)
        elif item.operation == "constant":
            spelling = precision.literal(float(item.value))
            names[id(item)] = f"({spelling})" if spelling.startswith("-") else spelling
        else:
            operands = [names[id(argument)] for argument in item.arguments]
            names[id(item)], kind = f"t{count}", "int" if item.operation in TRUTHS else precision.name
            lines.append(f"const {kind} t{count} = {spelt_in_c(item, operands, precision)};")
            count += 1
    return lines + [f"{writes[name]} = {names[id(value)]};" for name, value in outputs.items()]


def operations_of(outputs: Mapping[str, Expression]) -> Counter[str]:
    """Return how many operations a graph takes, which is the same whatever the data.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.

    Returns
    -------
    Counter
        By kind of operation, see `KINDS` [operations].

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> x = symbol("x")
    >>> dict(operations_of({"y": x * x + 1.0}))
    {'products': 1, 'additions': 1}
    """
    return Counter(KINDS[item.operation] for item in ordered(outputs.values()) if item.arguments)
