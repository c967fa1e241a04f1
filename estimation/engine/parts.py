"""A rule's halves as compiled functions, for kernels with their own loop: banks of models, smoothers, particles.

`estimation.engine.kernels` runs one filter, or many side by side. A kernel that steps several at once, or backwards,
has its own loop that calls these functions. In the loop's file they are keyword-only parameters
(`plant.compiled.paste`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from estimation.arrays import Array
from estimation.engine.kalman import belief_names
from estimation.engine.layout import halves_of, layout
from estimation.engine.rule import Rule
from estimation.models.model import ProcessModel
from plant.compiled.expression import Expression
from plant.compiled.paste import INLINED
from plant.compiled.source import lines_source, symbols_in

Prepare: TypeAlias = Callable[[Array, Array], None]
"""``prepare(rows, constants)``: compute all that does not change from sample to sample."""

Predict: TypeAlias = Callable[[Array, Array, Array, Array, float], None]
"""``predict(state, constants, before, after, j)``: take sub-step j between samples of the drives."""

Update: TypeAlias = Callable[[Array, Array, Array, Array], None]
"""``update(state, constants, sample, seen)``: update by a sample; store innovations and their variances in ``seen``."""


def function_source(
    name: str,
    arguments: str,
    reads: Mapping[str, str],
    outputs: Mapping[str, Expression],
    writes: Mapping[str, str] | None = None,
) -> str:
    """Write a function that reads symbols from arrays, computes, and writes results into arrays.

    Parameters
    ----------
    reads : Mapping[str, str]
        Location from which each symbol is read; only the needed ones are.
    outputs : Mapping[str, Expression]
        Expressions to compute, by name.
    writes : Mapping[str, str], optional
        Location to which each output is written, after all are computed. By default they are returned, as a tuple.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> print(function_source("twice", "x", {"a": "x[0]"}, {"b": 2.0 * symbol("a")}, {"b": "x[1]"}))
    def twice_lines(a):
        t0_ = 2.0 * a
        return {"b": t0_}
    <BLANKLINE>
    <BLANKLINE>
    _twice = function_of(twice_lines, 1)
    <BLANKLINE>
    <BLANKLINE>
    @inlined
    def twice(x):
        (x[1],) = _twice((x[0],))
    """
    wanted = {key: value for key, value in outputs.items() if writes is None or key in writes}
    begin = f"{INLINED}def {name}({arguments}):\n"
    if not wanted:
        return begin + "    return (0.0,)"
    places = [reads.get(symbol, symbol) for symbol in sorted(symbols_in(list(wanted.values())))]
    given = f"({', '.join(places)},)" if places else "()"
    targets = "return" if writes is None else f"({', '.join(writes[key] for key in wanted)},) ="
    lines = lines_source(f"{name}_lines", wanted)
    operation = f"_{name} = function_of({name}_lines, {len(wanted)})"
    return "\n\n\n".join([lines, operation, begin + f"    {targets} _{name}({given})"])


def places(array: str, names: Iterable[str]) -> dict[str, str]:
    """Return the array element that holds each number.

    Parameters
    ----------
    array : str
        Name of the array.
    names : iterable of str
        Names of its numbers, from the first on.

    Examples
    --------
    >>> places("theta", ["a", "b"])
    {'a': 'theta[0]', 'b': 'theta[1]'}
    """
    return {name: f"{array}[{i}]" for i, name in enumerate(names)}


def data_places(model: ProcessModel, channels: tuple[str, ...]) -> dict[str, str]:
    """Return the array elements that hold a step's drives and a sample's measurements.

    Returns
    -------
    dict[str, str]
        From the arrays ``before``, ``after`` and ``sample``, and the number ``j`` of the sub-step.
    """
    drives = {f"a{i}": f"before[{i}]" for i in range(len(model.drives))}
    drives |= {f"b{i}": f"after[{i}]" for i in range(len(model.drives))}
    return drives | {f"y{c}": f"sample[{c}]" for c in range(len(channels))}


@dataclass(frozen=True)
class RuleFunctions:
    """A rule on a model, as source text of functions.

    Parameters
    ----------
    source : str
        ``prepare``, ``predict`` and ``update``, see `Prepare`, `Predict` and `Update`; their names end with the suffix.
    constants : int
        Length of ``constants``.
    carried : tuple of str
        Contents of ``state``: belief, then the rule's memory.
    """

    source: str
    constants: int
    carried: tuple[str, ...]


def rule_functions(rule: Rule, model: ProcessModel, channels: tuple[str, ...], suffix: str = "") -> RuleFunctions:
    """Write a rule's halves as functions."""
    count = len(channels)
    carried = (*belief_names(model.width), *(f"{name}{c}" for name in rule.memory for c in range(count)))
    halves = halves_of(rule, model, channels, scored=False)
    state = {name: f"state[{i}]" for i, name in enumerate(carried)}
    constants = {name: f"constants[{i}]" for i, name in enumerate(halves.constants)}
    seen = {f"{x}{c}": f"seen[{i}, {c}]" for c in range(count) for i, x in enumerate("es")}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(rule, model, channels).rows)}
    reads = {**state, **constants, **data_places(model, channels)}
    written = {**state, **seen}
    parts = (
        function_source(f"prepare{suffix}", "rows, constants", rows, halves.constants, constants),
        function_source(f"predict{suffix}", "state, constants, before, after, j", reads, halves.predict, state),
        function_source(f"update{suffix}", "state, constants, sample, seen", reads, halves.update, written),
    )
    return RuleFunctions("\n\n\n".join(parts), len(constants), carried)
