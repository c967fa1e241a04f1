"""Sums and products that take in their latest operand last.

Each step of a filter waits for the previous one along a chain of operations. If a sum takes in the latest quantity
first, every further term makes the chain one operation longer; if it takes it in last, the sum adds only one.
"""

from collections import Counter
from collections.abc import Mapping
from math import inf

from plant.compiled.expression import ZERO, Expression, node, ordered
from plant.compiled.hoist import COMPARISONS

LATENCY: Mapping[str, float] = {"+": 3.0, "-": 3.0, "*": 4.0, "/": 14.0, "sqrt": 18.0, "abs": 1.0, "where": 0.0}
"""Latency of a result [cycles]: x86-64 processors of 2021 to 2024, choices predicted; others as `CALL_LATENCY`."""

CALL_LATENCY = 40.0
"""Latency of a call of exp, log or the like [cycles]: judged."""

SUMS = ("+", "-")


def late_last(
    outputs: Mapping[str, Expression], arrival: Mapping[str, float]
) -> tuple[dict[str, Expression], dict[str, float]]:
    """Order sums and products by the times at which their terms and factors become available.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        Outputs, by name.
    arrival : Mapping[str, float]
        Times at which symbols become available [cycles]; all others are available long before.

    Returns
    -------
    tuple of (dict[str, Expression], dict[str, float])
        The same values to rounding, by the same names, and the time of each [cycles].

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> x, y, z = symbol("x"), symbol("y"), symbol("z")
    >>> _, times = late_last({"product": (z * y) * x}, {"z": 0.0})
    >>> times["product"]  # z waits for no product but the last
    4.0
    """
    return _LateLast(outputs, arrival).outputs()


class _LateLast:
    def __init__(self, outputs: Mapping[str, Expression], arrival: Mapping[str, float]) -> None:
        self._given, self._order, self._arrival = outputs, ordered(outputs.values()), arrival
        uses = Counter(id(one) for item in self._order for one in item.arguments)
        uses.update(id(output) for output in outputs.values())
        user = {id(one): item for item in self._order for one in item.arguments}
        kept = {id(output) for output in outputs.values()}
        single = [item for item in self._order if uses[id(item)] == 1 and id(item) not in kept]
        self._lone = {id(item) for item in single if item.operation == "*"}
        self._inner = {id(item) for item in single if _kind(item) and _kind(item) == _kind(user[id(item)])}
        self._new: dict[int, Expression] = {}
        self._times: dict[int, float] = {}

    def outputs(self) -> tuple[dict[str, Expression], dict[str, float]]:
        """Process all nodes, operands first."""
        for item in self._order:
            if id(item) not in self._inner:
                self._new[id(item)] = self._reordered(item)
        made = {name: self._new[id(output)] for name, output in self._given.items()}
        return made, {name: self._time(item) for name, item in made.items()}

    def _time(self, item: Expression) -> float:
        return self._times.get(id(item), -inf)

    def _with_time(self, item: Expression, time: float) -> Expression:
        self._times[id(item)] = time
        return item

    def _reordered(self, item: Expression) -> Expression:
        if item.operation == "*":
            return self._product(self._leaves(item))
        if item.operation in SUMS:
            return self._sum(self._terms(item, 1))
        if not item.arguments:
            return self._with_time(
                item, self._arrival.get(str(item.value), -inf) if item.operation == "symbol" else -inf
            )
        operands = [self._new[id(one)] for one in item.arguments]
        waits = [] if item.operation in COMPARISONS else operands[1:] if item.operation == "where" else operands
        made = node(item.operation, *operands, value=item.value)
        return self._with_time(
            made, max(map(self._time, waits), default=-inf) + LATENCY.get(item.operation, CALL_LATENCY)
        )

    def _leaves(self, item: Expression) -> list[Expression]:
        """Return the factors of a product."""
        inside = [self._leaves(one) if id(one) in self._inner else [self._new[id(one)]] for one in item.arguments]
        return [factor for factors in inside for factor in factors]

    def _product(self, factors: list[Expression]) -> Expression:
        first, *others = sorted(factors, key=self._time)
        for one in others:
            first = self._with_time(node("*", first, one), max(self._time(first), self._time(one)) + LATENCY["*"])
        return first

    def _terms(self, item: Expression, sign: int) -> list[tuple[int, Expression]]:
        """Return the terms of a sum with their signs; a term that is added and subtracted again is dropped."""
        found: list[tuple[int, Expression]] = []
        for one, its in zip(item.arguments, (sign, sign if item.operation == "+" else -sign), strict=True):
            for term in self._terms(one, its) if id(one) in self._inner else [(its, one)]:
                opposite = next((i for i, (s, other) in enumerate(found) if s == -term[0] and other is term[1]), None)
                if opposite is None:
                    found.append(term)
                else:
                    del found[opposite]
        return found

    def _sum(self, terms: list[tuple[int, Expression]]) -> Expression:
        """Add up; a product with no other use is rounded with the sum, so the sum waits for its factors."""
        if not terms:
            return ZERO
        timed: list[tuple[float, int, Expression, float]] = []
        for sign, term in terms:
            made = self._new[id(term)]
            lone = id(term) in self._lone
            begins = max(map(self._time, made.arguments)) if lone else self._time(made)
            timed.append((begins, sign, made, LATENCY["*" if lone else "+"]))
        (_, sign, total, _), *others = sorted(timed, key=lambda one: one[0])
        for begins, its, one, latency in others:
            time = max(begins, self._time(total)) + latency
            if its == sign:
                total = self._with_time(node("+", one, total), time)
            else:
                total = self._with_time(node("-", *((total, one) if sign > 0 else (one, total))), time)
                sign = 1
        return total if sign > 0 else self._with_time(-total, self._time(total) + LATENCY["-"])


def _kind(item: Expression) -> str:
    """Return the operator that joins an expression's operands: ``+``, ``*`` or none."""
    return "+" if item.operation in SUMS else "*" if item.operation == "*" else ""
