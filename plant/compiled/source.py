"""Writes an expression graph as straight lines of Python, for kernels."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from plant.compiled.expression import Expression, ordered

Slot: TypeAlias = int | tuple[int, int]
"""Place of a number: its offset in numbers from a step's address; or which other address, and the offset from that."""

ROWS = 8
"""Number of logs whose samples `plant.compiled.native.operations.transpose` transposes at a time."""

CALLED_OPERATIONS = (
    "present",
    "sign",
    "sqrt",
    "exp",
    "log",
    "tanh",
    "sin",
    "cos",
    "atan",
    "ratios",
    "roots",
    "where",
    "fma",
)
"""Functions that lines call (`plant.compiled.native.lines`): no symbol may have their names."""

_CALLS: Mapping[str, str] = {
    **{sign: f"{{0}} {sign} {{1}}" for sign in ("+", "-", "*", "/", "<", "<=", ">", ">=")},
    **{name: f"{name}({{0}})" for name in ("abs", *CALLED_OPERATIONS[:-4])},
    "where": "where({0}, {1}, {2})",
    "fma": "fma({0}, {1}, {2})",
    "fnma": "fma(-{0}, {1}, {2})",
    "fms": "fma({0}, {1}, -{2})",
}
"""Spelling of each operation; a new one needs a line here and one in `expression.local_derivatives`."""


def lines_source(name: str, outputs: Mapping[str, Expression]) -> str:
    """Write straight lines as a function for `plant.compiled.native.operations`.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        Its results, by name.

    Returns
    -------
    str
        Its source; it takes the symbols in alphabetical order.

    Examples
    --------
    >>> from plant.compiled.expression import symbol, unary
    >>> x, y = symbol("x"), symbol("y")
    >>> print(lines_source("grown", {"x": unary("sqrt", y) + x}))
    def grown(x, y):
        t0_ = sqrt(y)
        t1_ = t0_ + x
        return {"x": t1_}
    """
    names: dict[int, str] = {}
    lines: list[str] = []
    for item in ordered(outputs.values()):
        if item.arguments:
            target = f"t{len(lines)}_"
            lines.append(f"{target} = {operation_text(item, names)}")
            names[id(item)] = target
        else:
            names[id(item)] = leaf(item)
    return function_source(name, outputs, lines, names)


def function_source(
    name: str, outputs: Mapping[str, Expression], lines: Sequence[str], names: Mapping[int, str]
) -> str:
    """Return lines as a function of the symbols in alphabetical order, which returns the outputs by name.

    Parameters
    ----------
    lines : sequence of str
        Assignments, not indented.
    names : Mapping[int, str]
        Variables of the graph's nodes, by their ids.
    """
    given = ", ".join(f'"{output}": {names[id(value)]}' for output, value in outputs.items())
    takes = ", ".join(sorted(symbols_in(list(outputs.values()))))
    return "\n    ".join([f"def {name}({takes}):", *lines, f"return {{{given}}}"])


def operations_source(lines: Mapping[str, str], slots: Mapping[str, Slot], width: int) -> str:
    """Write lines and, as ``NAME_at``, each of them as an operation on numbers in memory.

    Parameters
    ----------
    lines : Mapping[str, str]
        Sources of functions by name, as from `lines_source`.
    slots : Mapping[str, Slot]
        Place of the first of a symbol's numbers.
    width : int
        Number of values of each symbol that are processed at a time.

    Returns
    -------
    str
        Their source, see `plant.compiled.native.operations.stepping`.
    """
    made = "\n".join(f"{name}_at = stepping(SLOTS, {width}, {name})" for name in lines)
    return "\n\n\n".join([*lines.values(), f"SLOTS = {dict(slots)}\n\n{made}"])


def leaf(item: Expression) -> str:
    """Return the source text of a symbol or a constant."""
    return str(item.value) if item.operation == "symbol" else repr(item.value)


def operation_text(item: Expression, names: Mapping[int, str]) -> str:
    """Return the source text of an operation.

    Parameters
    ----------
    names : Mapping[int, str]
        Variables of its operands, by their ids.
    """
    return _CALLS[item.operation].format(*(names[id(argument)] for argument in item.arguments))


def symbols_in(outputs: Sequence[Expression]) -> set[str]:
    """Return the names of the symbols that the outputs depend on."""
    return {str(item.value) for item in ordered(outputs) if item.operation == "symbol"}
