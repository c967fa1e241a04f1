"""Straight-line code of a graph as C: the same operations in the same order as in the kernels that Python runs.

Every line is one operation, so no compiler may fuse or reorder operations that the kernels do not. Choices are
conditional expressions, or blocks if one side is much work; so a step takes at most the counted operations.
"""

from collections import Counter
from collections.abc import Mapping

from plant.compiled.c99.branches import Block, blocks_of
from plant.compiled.c99.precision import Precision
from plant.compiled.expression import Expression, ordered
from plant.compiled.hoist import COMPARISONS
from plant.compiled.source import symbols_in

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
    **dict.fromkeys(COMPARISONS, "choices and comparisons"),
}
"""Category in which each operation is counted."""


def c_operation(item: Expression, operands: list[str], precision: Precision) -> str:
    """Return one operation in C.

    Examples
    --------
    >>> from plant.compiled.c99.precision import DOUBLE
    >>> from plant.compiled.expression import symbol, unary
    >>> c_operation(unary("sqrt", symbol("x")), ["x"], DOUBLE)
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
        Outputs, by name.
    reads : Mapping[str, str]
        Source of each symbol; only the needed symbols are read.
    writes : Mapping[str, str]
        Destination of each output.

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
    writer = _Writer(list(outputs.values()), precision)
    return [*lines, *writer.lines, *(f"{writes[name]} = {writer.names[id(value)]};" for name, value in outputs.items())]


class _Writer:
    """Writes nodes one after another: their ``lines``, and the ``names`` of their variables by the nodes' ids."""

    def __init__(self, outputs: list[Expression], precision: Precision) -> None:
        order = ordered(outputs)
        self.names: dict[int, str] = {}
        self.lines: list[str] = []
        self._precision, self._count = precision, 0
        self._blocks = blocks_of(order, outputs)
        within = {id(one) for block in self._blocks.values() for side in block.sides for one in side}
        for item in order:
            if id(item) not in within:
                self._write(item, "")

    def _write(self, item: Expression, indent: str) -> None:
        if id(item) in self.names:
            return
        if item.operation == "symbol":
            self.names[id(item)] = str(item.value)
        elif item.operation == "constant":
            spelling = self._precision.literal(float(item.value))
            self.names[id(item)] = f"({spelling})" if spelling.startswith("-") else spelling
        elif id(item) in self._blocks:
            self._write_block(self._blocks[id(item)], indent)
        else:
            for one in item.arguments:
                self._write(one, indent)
            operands = [self.names[id(one)] for one in item.arguments]
            kind = "int" if item.operation in COMPARISONS else self._precision.name
            spelling = c_operation(item, operands, self._precision)
            self.lines.append(f"{indent}const {kind} {self._new_variable(item)} = {spelling};")

    def _new_variable(self, item: Expression) -> str:
        self.names[id(item)] = f"t{self._count}"
        self._count += 1
        return self.names[id(item)]

    def _write_block(self, block: Block, indent: str) -> None:
        """Write the nodes that both sides need, then the sides."""
        alone = {id(one) for side in block.sides for one in side}
        for item in (*block.sides[0], *block.sides[1], *block.choices):
            for one in item.arguments:
                if id(one) not in alone:
                    self._write(one, indent)
        for choice in block.choices:
            self.lines.append(f"{indent}{self._precision.name} {self._new_variable(choice)};")
        for place, opening in ((1, f"if ({self.names[id(block.condition)]} != 0) {{"), (2, "} else {")):
            self.lines.append(indent + opening)
            for item in block.sides[place - 1]:
                self._write(item, indent + "    ")
            for choice in block.choices:
                value = self.names[id(choice.arguments[place])]
                self.lines.append(f"{indent}    {self.names[id(choice)]} = {value};")
        self.lines.append(f"{indent}}}")


def operations_of(outputs: Mapping[str, Expression]) -> Counter[str]:
    """Return the largest number of operations that a graph can take.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        Outputs, by name.

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
