"""A rule on a model as functions of C: one computed once, one at each step of the model, one at each sample."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from estimation.engine.kalman import Outputs, belief_names
from estimation.engine.layout import halves_of, layout
from estimation.engine.parts import data_places
from estimation.engine.rule import Rule
from estimation.models.model import ProcessModel
from plant.compiled.c99.lines import c_lines, operations_of
from plant.compiled.c99.precision import Precision

ARGUMENTS: Mapping[str, tuple[str, ...]] = {
    "prepare": ("const {real} *restrict rows", "{real} *restrict constants"),
    "predict": (
        "{real} *restrict state",
        "const {real} *restrict constants",
        "const {real} *restrict before",
        "const {real} *restrict after",
        "{real} j",
    ),
    "update": (
        "{real} *restrict state",
        "const {real} *restrict constants",
        "const {real} *restrict sample",
        "{real} *restrict seen",
    ),
}
"""Arguments of each function; ``before`` and ``after`` are drives, ``j`` counts steps of the model since the sample."""

ABOUT: Mapping[str, str] = {
    "prepare": "Compute what stays the same from sample to sample.",
    "predict": "Take the belief one step of the model further.",
    "update": "Correct the belief by a sample; NAN is missing. seen: innovations, then their variances.",
}


@dataclass(frozen=True)
class RuleInC:
    """A rule on a model, as functions of C.

    Parameters
    ----------
    text : str
        Definitions of ``PREFIX_prepare``, ``PREFIX_predict`` and ``PREFIX_update``.
    constants : int
        Length of ``constants``.
    carried, rows : tuple of str
        Contents of ``state`` and ``rows``, by name.
    operations : Mapping[str, Counter]
        Largest number of operations in a call of each function [operations].
    """

    text: str
    constants: int
    carried: tuple[str, ...]
    rows: tuple[str, ...]
    operations: Mapping[str, Counter[str]]


def rule_in_c(
    rule: Rule, model: ProcessModel, channels: tuple[str, ...], precision: Precision, prefix: str, *, scored: bool
) -> RuleInC:
    """Write a rule's halves as functions of C.

    Parameters
    ----------
    channels : tuple of str
        Measured channels.
    prefix : str
        Prefix of their names.
    scored : bool
        Whether sums by which the filter is judged are carried along with the belief.
    """
    places, count = layout(rule, model, channels), len(channels)
    memory = tuple(f"{name}{c}" for name in rule.memory for c in range(count))
    carried = places.carried if scored else (*belief_names(model.width), *memory)
    halves = halves_of(rule, model, channels, scored=scored)
    state = {name: f"state[{i}]" for i, name in enumerate(carried)}
    constants = {name: f"constants[{i}]" for i, name in enumerate(halves.constants)}
    seen = {f"{x}{c}": f"seen[{i * count + c}]" for c in range(count) for i, x in enumerate("es")}
    rows = {name: f"rows[{i}]" for i, name in enumerate(places.rows)}
    reads = {**state, **constants, **data_places(model, channels), "j": "j"}
    work: Mapping[str, tuple[Outputs, Mapping[str, str], Mapping[str, str]]] = {
        "prepare": (halves.constants, rows, constants),
        "predict": (halves.predict, reads, state),
        "update": (halves.update, reads, {**state, **seen}),
    }
    texts = [_function(f"{prefix}_{name}", name, c_lines(*parts, precision), precision) for name, parts in work.items()]
    operations = {name: operations_of(parts[0]) for name, parts in work.items()}
    return RuleInC("\n\n".join(texts), len(halves.constants), carried, places.rows, operations)


def _function(name: str, part: str, lines: list[str], precision: Precision) -> str:
    arguments = [argument.format(real=precision.name) for argument in ARGUMENTS[part]]
    body = "\n".join(f"    {line}" for line in lines)
    words = set(body.replace("[", " ").replace(";", " ").split())
    unused = [one for one in (argument.split()[-1].lstrip("*") for argument in arguments) if one not in words]
    silent = "".join(f"    (void){one};\n" for one in unused)
    return f"/* {ABOUT[part]} */\nstatic void {name}({', '.join(arguments)})\n{{\n{silent}{body}\n}}"
