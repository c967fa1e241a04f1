"""A rule's halves as compiled functions, for kernels with a loop of their own: banks of models, smoothers, particles.

`estimation.kernels` writes the loop of one filter; what steps several at once, or backwards, writes its own around
these.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from estimation.algebra import Rule, belief_names
from estimation.layout import halves_of, layout
from estimation.model import ProcessModel
from plant.compiled.expression import Expression
from plant.compiled.source import INTRINSICS, lines_source, symbols_in

HEADER = '''"""Generated: {title}."""

import math

import numpy as np

''' + INTRINSICS.replace("{", "{{").replace("}", "}}")

_FUNCTION = """

{lines}


_{name} = function_of({name}_lines, {results})


@numba.njit(cache=True, nogil=True, error_model="numpy")
def {name}({arguments}):
    ({targets},) = _{name}(({places},))
"""


def function_source(
    name: str,
    arguments: str,
    reads: Mapping[str, str],
    outputs: Mapping[str, Expression],
    writes: Mapping[str, str],
) -> str:
    """Write a function that reads symbols from arrays, computes, and writes results into arrays.

    Parameters
    ----------
    name : str
        Of the function.
    arguments : str
        Its arguments, as in Python.
    reads : Mapping[str, str]
        Where each symbol is read from; only those needed are.
    outputs : Mapping[str, Expression]
        What is computed, by name.
    writes : Mapping[str, str]
        Where each output goes; all are written after all are computed.

    Returns
    -------
    str
        Its source.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> print(function_source("twice", "x", {"a": "x[0]"}, {"b": 2.0 * symbol("a")}, {"b": "x[1]"}).strip())
    def twice_lines(a):
        t0_ = 2.0 * a
        return {"b": t0_}
    <BLANKLINE>
    <BLANKLINE>
    _twice = function_of(twice_lines, 1)
    <BLANKLINE>
    <BLANKLINE>
    @numba.njit(cache=True, nogil=True, error_model="numpy")
    def twice(x):
        (x[1],) = _twice((x[0],))
    """
    wanted = {key: value for key, value in outputs.items() if key in writes}
    if not wanted:
        return f"\n\n@numba.njit(cache=True)\ndef {name}({arguments}):\n    pass\n"
    places = [reads.get(symbol, symbol) for symbol in sorted(symbols_in(list(wanted.values())))]
    return _FUNCTION.format(
        name=name,
        arguments=arguments,
        lines=lines_source(f"{name}_lines", wanted),
        results=len(wanted),
        targets=", ".join(writes[key] for key in wanted),
        places=", ".join(places),
    )


def data_places(model: ProcessModel, channels: tuple[str, ...]) -> dict[str, str]:
    """Return where a step's drives and a sample's measurements are read from.

    Parameters
    ----------
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

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
    """A rule on a model, as source of functions.

    Parameters
    ----------
    source : str
        ``prepare_x(rows, constants)``, ``predict_x(state, constants, before, after, j)`` and ``update_x(state,
        constants, sample, seen)``, which puts innovations and their variances in ``seen``; x is the suffix.
    constants : int
        Length of ``constants``.
    carried : tuple of str
        What ``state`` holds: belief, then the rule's memory.
    """

    source: str
    constants: int
    carried: tuple[str, ...]


def rule_functions(rule: Rule, model: ProcessModel, channels: tuple[str, ...], suffix: str) -> RuleFunctions:
    """Write a rule's halves as functions.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.
    suffix : str
        End of the functions' names.

    Returns
    -------
    RuleFunctions
        Their source, and what they read and write.
    """
    count = len(channels)
    carried = (*belief_names(model.width), *(f"{name}{c}" for name in rule.memory for c in range(count)))
    halves = halves_of(rule, model, channels, scored=False)
    state = {name: f"state[{i}]" for i, name in enumerate(carried)}
    constants = {name: f"constants[{i}]" for i, name in enumerate(halves.constants)}
    seen = {f"{x}{c}": f"seen[{i}, {c}]" for c in range(count) for i, x in enumerate("es")}
    rows = {name: f"rows[{i}]" for i, name in enumerate(layout(rule, model, channels).rows)}
    reads = {**state, **constants, **data_places(model, channels)}
    source = function_source(f"prepare_{suffix}", "rows, constants", rows, halves.constants, constants)
    source += function_source(f"predict_{suffix}", "state, constants, before, after, j", reads, halves.predict, state)
    source += function_source(
        f"update_{suffix}", "state, constants, sample, seen", reads, halves.update, {**state, **seen}
    )
    return RuleFunctions(source, len(constants), carried)
