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
    "log": "math.log({0})",
    "tanh": "math.tanh({0})",
    "where": "({1} if {0} else {2})",
}
"""How each operation is spelt; a new one needs a line here and one in `expression.local_derivatives`."""


def statements(outputs: Mapping[str, Expression], indent: str, temporary: str = "t") -> str:
    """Return assignments that compute the outputs from their symbols, one operation a line.

    All outputs are assigned at the end, so an output may have the name of an input.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by the variable that receives it.
    indent : str
        White space in front of every line.
    temporary : str
        Beginning of the temporaries' names. Parts of one function need different ones: Numba takes a time that grows
        with the square of the count of names assigned twice.

    Returns
    -------
    str
        The lines.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> x = symbol("x")
    >>> print(statements({"y": x * x + 1.0}, ""))
    t0_ = x * x
    t1_ = t0_ + 1.0
    y = t1_
    """
    return "\n".join(_assignments(outputs, ordered(outputs.values()), {}, temporary, indent))


def _assignments(
    outputs: Mapping[str, Expression], items: Sequence[Expression], names: dict[int, str], letter: str, indent: str
) -> list[str]:
    """Return one line an operation and one for the outputs; note the variable of each operation in `names`."""
    lines: list[str] = []
    for item in items:
        if item.operation == "symbol":
            names[id(item)] = str(item.value)
        elif item.operation == "constant":
            names[id(item)] = repr(item.value)
        else:
            operands = [names[id(argument)] for argument in item.arguments]
            # the underscore: Numba names a load of t7 at 2854 as it names one of t72 at 854
            name = f"{letter}{len(lines)}_"
            names[id(item)] = name
            lines.append(f"{indent}{name} = {_TEMPLATES[item.operation].format(*operands)}")
    targets = [(target, names[id(value)]) for target, value in outputs.items()]
    wanted = [(target, name) for target, name in targets if target != name]
    if wanted:
        left = ", ".join(target for target, _ in wanted)
        right = ", ".join(name for _, name in wanted)
        lines.append(f"{indent}{left} = {right}")
    return lines


def assignments(
    outputs: Mapping[str, Expression], known: Mapping[str, str], temporary: str, indent: str
) -> tuple[list[str], dict[str, str]]:
    """Return lines that compute the outputs and assign nothing twice, and the variable that holds each output.

    Numba takes a time that grows with the count of variables assigned twice times the length of the function.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        What is computed, by name.
    known : Mapping[str, str]
        Variables that hold symbols, where they are not named as the symbols are.
    temporary : str
        Beginning of the temporaries' names.
    indent : str
        White space in front of every line.

    Returns
    -------
    tuple of (list of str, dict[str, str])
        The lines, and the variable of each output by its name.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> x = symbol("x")
    >>> assignments({"x": x * x + 1.0, "y": x}, {"x": "old"}, "t", "")
    (['t0_ = old * old', 't1_ = t0_ + 1.0'], {'x': 't1_', 'y': 'old'})
    """
    names = {
        id(item): known.get(str(item.value), str(item.value))
        for item in ordered(outputs.values())
        if item.operation == "symbol"
    }
    items = [item for item in ordered(outputs.values()) if item.operation != "symbol"]
    lines = _assignments({}, items, names, temporary, indent)
    return lines, {name: names[id(value)] for name, value in outputs.items()}


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
