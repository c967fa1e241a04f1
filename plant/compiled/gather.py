"""Moves numbers and slowly changing factors to the front of a product, where they are computed once."""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isfinite

from plant.compiled.expression import ONE, ZERO, Expression, constant, node, ordered, select, unary
from plant.compiled.hoist import settled_nodes


@dataclass(frozen=True, eq=False)
class _Product:
    """A number times slowly changing factors times fast changing factors."""

    number: Fraction
    seldom: Expression
    often: Expression

    def as_node(self) -> Expression:
        """Return the product as one node."""
        if self.number == 0:
            return ZERO
        if self.number == -1 and self.seldom is ONE and self.often is not ONE:
            return -self.often
        number = ONE if self.number == 1 else constant(float(self.number))
        return (number * self.seldom) * self.often

    def times(self, number: Fraction) -> "_Product":
        """Return a multiple."""
        return replace(self, number=number * self.number)


def gather_factors(outputs: Mapping[str, Expression], fixed: Collection[str]) -> dict[str, Expression]:
    """Gather numbers and slowly changing factors in front of products, and make one node of ``a * b`` and ``b * a``.

    Numbers are multiplied exactly, so a scale and its inverse cancel. A product with several uses is one node, with its
    factors gathered inside; only the number of an output stays separate, so that other outputs can do without it.
    `fixed` are symbols that seldom change; values stay the same to rounding.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> from plant.compiled.source import lines_source
    >>> x, y, k = symbol("x"), symbol("y"), symbol("k")
    >>> print(lines_source("lines", gather_factors({"a": 0.01 * x * k / 0.001, "b": k * (y - 0.1 * x) / 10.0}, {"k"})))
    def lines(k, x, y):
        t0_ = 10.0 * k
        t1_ = t0_ * x
        t2_ = 0.1 * k
        t3_ = 0.1 * x
        t4_ = y - t3_
        t5_ = t2_ * t4_
        return {"a": t1_, "b": t5_}
    """
    return _Gathering(outputs, fixed).outputs()


class _Gathering:
    def __init__(self, outputs: Mapping[str, Expression], fixed: Collection[str]) -> None:
        self._given = outputs
        self._order = ordered(outputs.values())
        self._seldom = settled_nodes(self._order, fixed)
        self._products: dict[int, _Product] = {}
        self._twins: dict[tuple[str, int, int], Expression] = {}

    def outputs(self) -> dict[str, Expression]:
        """Process all nodes, operands first."""
        users = Counter(argument for item in self._order for argument in {id(one) for one in item.arguments})
        ends = {id(output) for output in self._given.values()}
        for item in self._order:
            found = self._product_of(item)
            if id(item) in self._seldom:
                found = _Product(found.number, found.seldom * found.often, ONE)
            elif users[id(item)] > 1 and found.number != 0:
                number = found.number if id(item) in ends else Fraction(1)
                found = _Product(number, ONE, found.times(1 / number).as_node())
            self._products[id(item)] = found
        return {name: self._products[id(output)].as_node() for name, output in self._given.items()}

    def _product_of(self, item: Expression) -> _Product:
        given = [self._products[id(argument)] for argument in item.arguments]
        match item.operation:
            case "constant" if isfinite(float(item.value)):
                return _Product(Fraction(float(item.value)), ONE, ONE)
            case "*":
                a, b = given
                return _Product(a.number * b.number, self._times(a.seldom, b.seldom), self._times(a.often, b.often))
            case "/" if given[1].number != 0:
                a, b = given
                return _Product(a.number / b.number, a.seldom / b.seldom, a.often / b.often)
            case "+":
                return self._sum(*given)
            case "-":
                return self._sum(given[0], given[1].times(Fraction(-1)))
            case "where":
                return self._choice(*given)
            case "abs":
                inner = given[0].times(1 / given[0].number) if given[0].number else given[0]
                return _single_factor(unary("abs", inner.as_node())).times(abs(given[0].number))
            case _:
                return _single_factor(node(item.operation, *(one.as_node() for one in given), value=item.value))

    def _times(self, a: Expression, b: Expression) -> Expression:
        return a * b if a is ONE or b is ONE else self._twin("*", a, b, a * b)

    def _twin(self, operation: str, a: Expression, b: Expression, result: Expression) -> Expression:
        """Return the result of the same operation on b and a, if it exists already."""
        twin = self._twins.get((operation, id(b), id(a)))
        return self._twins.setdefault((operation, id(a), id(b)), result) if twin is None else twin

    def _sum(self, a: _Product, b: _Product) -> _Product:
        if a.number == 0 or b.number == 0:
            return b if a.number == 0 else a
        if a.seldom is b.seldom and a.often is b.often:
            return replace(a, number=a.number + b.number)
        if a.seldom is b.seldom and a.number == b.number:
            return replace(a, often=self._twin("+", a.often, b.often, a.often + b.often))
        if a.seldom is b.seldom and a.number == -b.number:
            return replace(a, often=a.often - b.often)
        if b.number < 0:
            return _single_factor(a.as_node() - b.times(Fraction(-1)).as_node())
        if a.number < 0:
            return _single_factor(b.as_node() - a.times(Fraction(-1)).as_node())
        return _single_factor(self._twin("+", a.as_node(), b.as_node(), a.as_node() + b.as_node()))

    def _choice(self, condition: _Product, a: _Product, b: _Product) -> _Product:
        """Factor out a number that both branches share; zero shares every number."""
        number = a.number or b.number
        if number and a.number in (0, number) and b.number in (0, number):
            inner = [one.times(1 / number).as_node() for one in (a, b)]
            return _single_factor(select(condition.as_node(), *inner)).times(number)
        return _single_factor(select(condition.as_node(), a.as_node(), b.as_node()))


def _single_factor(item: Expression) -> _Product:
    return _Product(Fraction(1), ONE, item)
