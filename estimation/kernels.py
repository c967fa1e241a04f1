"""Compiled filters: a rule on a model for a set of channels, as straight lines that run for one filter or for 32 lanes.

One filter keeps its state in variables. Lanes keep theirs in one flat buffer with constant offsets, which the compiler
turns into vector instructions. Both call the same two inlined functions, in plain IEEE arithmetic, nothing reassociated
or contracted: a filter gives the same bits alone and in a batch.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import Outputs, Rule
from estimation.layout import Halves, halves_of, layout
from estimation.model import ProcessModel
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import assignments, symbols_in

Array = NDArray[np.float64]

LANES = 32
"""Filters side by side: as many as keep a vector unit busy; fewer leave it waiting, more do not help."""

FLUSH = 16
"""Samples between logarithms of the running product of innovation variances: it cannot overflow that fast."""

_PARTS = """# Generated: {name}.

import math

import numba
import numpy as np


@numba.njit(forceinline=True, error_model="numpy")
def prepare({prepare_takes}):
{prepare}


@numba.njit(forceinline=True, error_model="numpy")
def predict({predict_takes}):
{predict}


@numba.njit(forceinline=True, error_model="numpy")
def update({update_takes}):
{update}


"""

_ONE = """@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(state, rows, drives, measured, substeps, every, track, track_variance, residuals, residual_variances):
    n = measured.shape[0]
    keep = residuals.shape[0] == n
    logs = np.zeros({channels})
{load}
    {prepare_gives} = prepare({prepare_takes})
    for k in range(n):
        if k > 0:
{drive}
            for i in range(substeps):
                j = float(i)
                {predict_gives} = predict({predict_takes})
{sample}
        {update_gives} = update({update_takes})
        if k % every == 0:
{store}
        if keep:
{keep}
        if k % {flush} == {flush} - 1:
{flushed}
{finish}
    return logs
"""

_LANES = """@numba.njit(cache=True, nogil=True, error_model="numpy")
def prepare_all(rows, constants):
    for l in range({lanes}):
{prepare_load}
        {prepare_slots} = prepare({prepare_takes})


@numba.njit(cache=True, nogil=True, error_model="numpy")
def predict_all(state, constants, before, after, j):
    for l in range({lanes}):
{predict_load}
        {predict_slots} = predict({predict_takes})


@numba.njit(cache=True, nogil=True, error_model="numpy")
def update_all(state, constants, sample):
    for l in range({lanes}):
{update_load}
        {update_slots} = update({update_takes})


@numba.njit(cache=True, nogil=True, error_model="numpy")
def both_all(state, constants, before, after, j, sample):
    for l in range({lanes}):
{both_load}
        {predict_gives} = predict({predict_takes})
        {update_slots} = update({update_takes})
{both_store}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(state, rows, drives, measured, begin, substeps, every, track, track_variance, logs):
    constants = np.empty({kept} * {lanes})
    prepare_all(rows, constants)
    for i in range(measured.shape[0]):
        k = begin + i
        if k == 0:
            update_all(state, constants, measured[0])
        elif i == 0:
            continue
        else:
            for j in range(substeps - 1):
                predict_all(state, constants, drives[i - 1], drives[i], float(j))
            both_all(state, constants, drives[i - 1], drives[i], float(substeps - 1), measured[i])
        if k % every == 0:
            for l in range({lanes}):
{store}
        if k % {flush} == {flush} - 1:
            for l in range({lanes}):
{flushed}
"""


def _block(lines: Sequence[str], indent: int) -> str:
    return "\n".join(" " * indent + line for line in lines or ["pass"])


def _takes(outputs: Outputs) -> list[str]:
    return sorted(symbols_in(list(outputs.values())))


def _tuple(names: Sequence[str]) -> str:
    return "".join(f"{name}, " for name in names).rstrip()


def _parts(halves: Halves) -> dict[str, str]:
    """Return, for each of the three functions, its body, what it takes and what it gives."""
    texts: dict[str, str] = {}
    functions = {"prepare": halves.constants, "predict": halves.predict, "update": halves.update}
    for name, outputs in functions.items():
        lines, results = assignments(outputs, {}, "t", "")
        given = _tuple([results[output] for output in outputs])
        texts[name] = _block([*lines, f"return ({given})" if outputs else "return ()"], 4)
        texts[f"{name}_takes"] = ", ".join(_takes(outputs))
        texts[f"{name}_gives"] = f"({_tuple(list(outputs))})"
    return texts


def one_source(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> str:
    """Write the kernel that runs one filter.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    str
        Source of a module with ``run``.
    """
    halves, places = halves_of(rule, model, channels), layout(rule, model, channels)
    n, m, d = range(model.width), range(len(channels)), range(len(model.drives))
    used = _takes(halves.constants)
    load = [f"{name} = rows[{i}]" for i, name in enumerate(places.rows) if name in used]
    load += [f"{name} = state[{i}]" for i, name in enumerate(places.carried)]
    store = [f"track[k // every, {i}] = z{i}" for i in n] + [f"track_variance[k // every, {i}] = P{i}_{i}" for i in n]
    kept = [f"residuals[k, {c}] = e{c}" for c in m] + [f"residual_variances[k, {c}] = s{c}" for c in m]
    flushed = [f"logs[{c}] += math.log(product{c})" for c in m] + [f"product{c} = 1.0" for c in m]
    return (_PARTS + _ONE).format(
        name=f"{rule.name} on the {model.name} form",
        channels=len(channels),
        flush=FLUSH,
        load=_block(load, 4),
        drive=_block([f"{x}{i} = drives[k{at}, {i}]" for i in d for x, at in (("a", " - 1"), ("b", ""))], 12),
        sample=_block([f"y{c} = measured[k, {c}]" for c in m], 8),
        store=_block(store, 12),
        keep=_block(kept, 12),
        flushed=_block(flushed, 12),
        finish=_block([f"state[{i}] = {name}" for i, name in enumerate(places.carried)], 4),
        **_parts(halves),
    )


def lanes_source(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> str:
    """Write the kernel that runs 32 filters side by side, over one stretch of their logs at a time.

    The stretch that begins after the first sample repeats the last one before it.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    str
        Source of a module with ``run``.
    """
    halves, places = halves_of(rule, model, channels), layout(rule, model, channels)
    n, m, d = range(model.width), range(len(channels)), range(len(model.drives))
    state = {name: f"state[{i * LANES} + l]" for i, name in enumerate(places.carried)}
    constants = {name: f"constants[{i * LANES} + l]" for i, name in enumerate(halves.constants)}
    sources = {**state, **constants, **{f"y{c}": f"sample[{c}, l]" for c in m}}
    sources |= {f"{x}{i}": f"{array}[{i}, l]" for i in d for x, array in (("a", "before"), ("b", "after"))}
    rows = {name: f"rows[{i * LANES} + l]" for i, name in enumerate(places.rows)}
    both = {**halves.update, **halves.predict}
    unchanged = [name for name in halves.predict if name not in halves.update]
    return (_PARTS + _LANES).format(
        name=f"{rule.name} on the {model.name} form, {LANES} side by side",
        lanes=LANES,
        kept=len(constants),
        channels=len(channels),
        flush=FLUSH,
        prepare_load=_loads(halves.constants, rows),
        prepare_slots=f"({_tuple(list(constants.values()))})",
        predict_load=_loads(halves.predict, sources),
        predict_slots=f"({_slots(halves.predict, state)})",
        update_load=_loads(halves.update, sources),
        update_slots=f"({_slots(halves.update, state)})",
        both_load=_loads(both, sources, [*_takes(halves.predict), *_takes(halves.update)]),
        both_store=_block([f"{state[name]} = {name}" for name in unchanged], 8),
        store=_block(
            [f"track[k // every, {i}, l] = {state[f'z{i}']}" for i in n]
            + [f"track_variance[k // every, {i}, l] = {state[f'P{i}_{i}']}" for i in n],
            16,
        ),
        flushed=_block(
            [f"logs[{c}, l] += math.log({state[f'product{c}']})" for c in m]
            + [f"{state[f'product{c}']} = 1.0" for c in m],
            16,
        ),
        **_parts(halves),
    )


def _loads(outputs: Outputs, sources: Mapping[str, str], names: Sequence[str] | None = None) -> str:
    taken = dict.fromkeys(names if names is not None else _takes(outputs))
    return _block([f"{name} = {sources[name]}" for name in taken if name in sources], 8)


def _slots(outputs: Outputs, state: Mapping[str, str]) -> str:
    """Return where a function's results go; what is not carried goes to a variable that nobody reads."""
    return _tuple([state.get(name, name) for name in outputs])


@cache
def compile_filter(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> Callable[..., Array]:
    """Generate and load the kernel that runs one filter.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    callable
        The kernel's ``run``; `estimation.compiled` calls it.
    """
    return load_kernel(f"{rule.name}_{model.name}", one_source(rule, model, channels)).run


@cache
def compile_lanes(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> Callable[..., Array]:
    """Generate and load the kernel that runs 32 filters side by side.

    Parameters
    ----------
    rule : Rule
        The filter.
    model : ProcessModel
        The model.
    channels : tuple of str
        Measured channels.

    Returns
    -------
    callable
        The kernel's ``run``; `estimation.batch` calls it.
    """
    return load_kernel(f"{rule.name}_{model.name}_lanes", lanes_source(rule, model, channels)).run
