"""Shares the divider within one run: independent divisions and roots become one instruction.

A processor divides eight numbers in little more time than one, and one run of a plant needs dozens of quotients and
roots per step. Runs side by side fill the vectors without this.
"""

from collections.abc import Mapping

from plant.compiled.expression import Expression, ordered
from plant.compiled.source import function_source, leaf, operation_text

PACKED: Mapping[str, str] = {"/": "ratios", "sqrt": "roots"}
"""Operations that are packed, and the functions of `plant.compiled.native.lines` that compute them."""


def packed_source(name: str, outputs: Mapping[str, Expression]) -> str:
    """Write straight lines as `plant.compiled.source.lines_source` does, with divisions and roots side by side.

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
    >>> from plant.compiled.expression import symbol
    >>> x, y = symbol("x"), symbol("y")
    >>> print(packed_source("lines", {"a": x / y, "b": y / x, "c": (x / y) / (x + y)}))
    def lines(x, y):
        t0_ = x + y
        t1_, t2_ = ratios((x, y), (y, x))
        t3_ = t1_ / t0_
        return {"a": t1_, "b": t2_, "c": t3_}
    """
    order = ordered(outputs.values())
    turns: dict[int, int] = {}
    for item in order:
        waits = max((turns[id(a)] for a in item.arguments), default=0)
        turns[id(item)] = waits + (item.operation in PACKED)
    names: dict[int, str] = {}
    lines: list[str] = []
    count = 0
    for turn in range(max(turns.values(), default=0) + 1):
        here = [item for item in order if turns[id(item)] == turn]
        for operation, function in PACKED.items():
            group = [item for item in here if item.operation == operation]
            for item in group:
                names[id(item)] = f"t{count}_"
                count += 1
            if len(group) == 1:
                lines.append(f"{names[id(group[0])]} = {operation_text(group[0], names)}")
            elif group:
                columns = zip(*([names[id(a)] for a in item.arguments] for item in group), strict=True)
                given = ", ".join(f"({', '.join(column)})" for column in columns)
                lines.append(f"{', '.join(names[id(item)] for item in group)} = {function}({given})")
        for item in here:
            if not item.arguments:
                names[id(item)] = leaf(item)
            elif item.operation not in PACKED:
                names[id(item)] = f"t{count}_"
                count += 1
                lines.append(f"{names[id(item)]} = {operation_text(item, names)}")
    return function_source(name, outputs, lines, names)
