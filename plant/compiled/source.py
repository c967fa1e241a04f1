"""Writes an expression graph as straight-line Python that Numba compiles."""

from collections.abc import Mapping, Sequence

from plant.compiled.expression import Expression, ordered

_TEMPLATES: Mapping[str, str] = {
    "+": "{0} + {1}",
    "-": "{0} - {1}",
    "*": "{0} * {1}",
    "/": "{0} / {1}",
    "<": "{0} < {1}",
    "<=": "{0} <= {1}",
    ">": "{0} > {1}",
    ">=": "{0} >= {1}",
    "present": "{0} == {0}",
    "abs": "abs({0})",
    "sign": "(1.0 if {0} > 0.0 else (-1.0 if {0} < 0.0 else 0.0))",
    "sqrt": "math.sqrt({0})",
    "exp": "math.exp({0})",
    "tanh": "math.tanh({0})",
    "where": "({1} if {0} else {2})",
}
"""How each operation is spelt; a new one needs a line here and one in `expression._local_derivatives`."""


def statements(outputs: Mapping[str, Expression], indent: str) -> str:
    """Return assignments that compute the outputs from their symbols, one operation a line.

    All outputs are assigned at the end, so an output may have the name of an input.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by the variable that receives it.
    indent : str
        White space in front of every line.

    Returns
    -------
    str
        The lines.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> x = symbol("x")
    >>> print(statements({"y": x * x + 1.0}, ""))
    t0 = x * x
    t1 = t0 + 1.0
    y = t1
    """
    names: dict[int, str] = {}
    lines: list[str] = []
    for item in ordered(outputs.values()):
        if item.operation == "symbol":
            names[id(item)] = str(item.value)
        elif item.operation == "constant":
            names[id(item)] = repr(item.value)
        else:
            operands = [names[id(argument)] for argument in item.arguments]
            names[id(item)] = f"t{len(lines)}"
            lines.append(f"{indent}t{len(lines)} = {_TEMPLATES[item.operation].format(*operands)}")
    targets = [(target, names[id(value)]) for target, value in outputs.items()]
    wanted = [(target, name) for target, name in targets if target != name]
    if wanted:
        left = ", ".join(target for target, _ in wanted)
        right = ", ".join(name for _, name in wanted)
        lines.append(f"{indent}{left} = {right}")
    return "\n".join(lines)


def symbols_in(outputs: Sequence[Expression]) -> set[str]:
    """Return the names of the symbols that the outputs depend on.

    Parameters
    ----------
    outputs : sequence of Expression
        The graph's ends.

    Returns
    -------
    set of str
        Symbol names.
    """
    return {str(item.value) for item in ordered(outputs) if item.operation == "symbol"}
