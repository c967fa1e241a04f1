"""Layout of a compiled filter: the names of its inputs and of the values carried from sample to sample."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache

import numpy as np
from numpy.typing import NDArray

from estimation.arrays import Array
from estimation.engine.kalman import Outputs, belief_names
from estimation.engine.rule import Rule
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, Expression, select, symbol, unary
from plant.compiled.hoist import hoisted
from plant.compiled.late_last import late_last
from plant.compiled.simplify import Nodes, fused, rewritten, simplified
from plant.compiled.source import CALLED_OPERATIONS, symbols_in
from plant.errors import HydrostateError

_NUMBERED = re.compile(r"[abykcdtw](?:0|[1-9]\d{0,3})")
"""Pattern of the numbered names that a kernel generates."""


@dataclass(frozen=True)
class Layout:
    """Layout of a kernel's carried values and constants.

    Parameters
    ----------
    carried : tuple of str
        Values carried from sample to sample: belief, the rule's memory, then the sums ``nis``, ``count`` and
        ``product`` of each channel.
    rows : tuple of str
        Constant inputs: parameters, process noise ``q``, measurement variances ``r``, settings, ``h``, ``share``.
    """

    carried: tuple[str, ...]
    rows: tuple[str, ...]
    channels: int

    def start(self, mean: Array, covariance: Array) -> Array:
        """Return the carried values before the first sample.

        Parameters
        ----------
        mean : ndarray, shape (n,) or (filters, n)
            Prior mean in the filter's units [dimensionless].
        covariance : ndarray, shape (n, n) or (filters, n, n)
            Prior covariance in the filter's units [dimensionless].

        Returns
        -------
        ndarray, shape (carried,) or (carried, filters)
            The carried values.
        """
        values = np.zeros((len(self.carried), *mean.shape[:-1]))
        n = mean.shape[-1]
        rows, columns = upper_triangle(n)
        values[:n] = mean.T
        values[n : n + len(rows)] = covariance[..., rows, columns].T
        values[-self.channels :] = 1.0
        return values

    def sums(self, carried: Array, name: str) -> Array:
        """Return one of the sums for every channel.

        Parameters
        ----------
        carried : ndarray, shape (carried, ...)
            Carried values of a kernel [dimensionless].
        name : str
            ``nis``, ``count`` or ``product``.

        Returns
        -------
        ndarray, shape (channels, ...)
            The sums.
        """
        place = ("nis", "count", "product").index(name) - 3
        return carried[place * self.channels : (place + 1) * self.channels or None]


@cache
def upper_triangle(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of a symmetric matrix's upper triangle, row by row.

    Returns
    -------
    tuple of ndarray, each shape (n (n + 1) / 2,)
        Rows and columns.
    """
    rows, columns = np.triu_indices(n)
    return rows, columns


@cache
def layout(rule: Rule, model: ProcessModel, channels: tuple[str, ...]) -> Layout:
    """Return the layout of the kernel of a rule on a model.

    Raises
    ------
    HydrostateError
        If a parameter of the model has the name of something inside the kernel.
    """
    each = (*rule.memory, "nis", "count", "product")
    carried = (*belief_names(model.width), *(f"{name}{c}" for name in each for c in range(len(channels))))
    parameters = tuple(field.name for field in fields(model.parameters))
    noise = tuple(f"q{i}" for i in range(model.width)) + tuple(f"r{c}" for c in range(len(channels)))
    settings = tuple(setting.name for setting in rule.settings)
    own = {*carried, *noise, *settings, *CALLED_OPERATIONS, "h", "share", "j"}
    if clash := [name for name in sorted(parameters) if name in own or _NUMBERED.fullmatch(name)]:
        raise HydrostateError(f"{model.name}: a parameter may not be named {clash[0]!r}, the kernel uses it")
    return Layout(carried, (*parameters, *noise, *settings, "h", "share"), len(channels))


@dataclass(frozen=True)
class Halves:
    """The two halves of a filter as expressions; terms that are constant over all steps are moved out of them.

    Parameters
    ----------
    constants : dict[str, Expression]
        Expressions that are computed once.
    predict, update : dict[str, Expression]
        Expressions that are computed at every step of the model and at every sample.
    """

    constants: Outputs
    predict: Outputs
    update: Outputs


def score_expressions(outputs: Mapping[str, Expression], channels: Sequence[str]) -> Outputs:
    """Return the running sums by which a filter is judged.

    Parameters
    ----------
    outputs : Mapping[str, Expression]
        Results of an update: for each channel the innovation ``e``, its variance ``s`` and, if available, one over
        that, ``w``.

    Returns
    -------
    dict[str, Expression]
        Sums of squared normalised innovations ``nis`` and of samples present ``count``, and the product ``product`` of
        the innovations' variances over the sensors' own, whose logarithm is part of the likelihood.
    """
    sums: Outputs = {}
    for c in range(len(channels)):
        present, e, s = unary("present", symbol(f"y{c}")), outputs[f"e{c}"], outputs[f"s{c}"]
        weight = select(present, outputs.get(f"w{c}", 1.0 / s), ZERO)
        clean = select(present, e, ZERO)
        sums[f"nis{c}"] = symbol(f"nis{c}") + clean * clean * weight
        sums[f"count{c}"] = symbol(f"count{c}") + select(present, ONE, ZERO)
        sums[f"product{c}"] = symbol(f"product{c}") * select(present, s * (1.0 / symbol(f"r{c}")), ONE)
    return sums


@cache
def halves_of(rule: Rule, model: ProcessModel, channels: tuple[str, ...], *, scored: bool = True) -> Halves:
    """Trace a rule on a model.

    Parameters
    ----------
    scored : bool
        Whether the update includes the score's expressions.
    """
    update = rule.update(model, channels)
    if scored:
        update |= score_expressions(update, channels)
    update = {name: value for name, value in update.items() if name not in {f"w{c}" for c in range(len(channels))}}
    data = {f"{x}{i}" for i in range(len(model.drives)) for x in "ab"} | {f"y{c}" for c in range(len(channels))}
    predict = rule.predict(model)
    varying = {*layout(rule, model, channels).carried, *data, "j"}
    fixed = symbols_in([*predict.values(), *update.values()]) - varying
    before, predict = hoisted(simplified(predict, fixed), varying, "c")
    after, update = hoisted(simplified(update, fixed), varying, "d")
    predict, times = late_last(predict, dict.fromkeys(belief_names(model.width), 0.0))
    update, _ = late_last(update, times)
    return Halves(before | after, fused(predict), fused(update))


def with_missing_counted(update: Outputs) -> Outputs:
    """Return an update that subtracts missing samples from the sums ``count``; the caller adds all samples.

    So the sums stay untouched if no sample is missing.

    Parameters
    ----------
    update : dict[str, Expression]
        As in `Halves`.
    """

    def counted(name: str) -> Expression:
        present = unary("present", symbol(name.replace("count", "y")))
        return symbol(name) - select(present, ZERO, ONE)

    return {name: counted(name) if name.startswith("count") else value for name, value in update.items()}


def full_sample_update(update: Outputs) -> Outputs:
    """Return the update for a sample without missing channels, bit-identical to the general one.

    Parameters
    ----------
    update : dict[str, Expression]
        As from `with_missing_counted`; rounding was fixed before (`plant.compiled.simplify.fused`).
    """

    def chosen(item: Expression, new: Nodes) -> Expression | None:
        if item.operation == "where" and item.arguments[0].operation == "present":
            return new[id(item.arguments[1])]
        return None

    return rewritten({name: value for name, value in update.items() if not name.startswith("count")}, chosen)


def step_at_sample(predict: Outputs) -> Outputs:
    """Return the model step that begins at a sample, with sub-step ``j`` 0, for finite drives.

    Parameters
    ----------
    predict : dict[str, Expression]
        As in `Halves`.
    """

    def begun(item: Expression, new: Nodes) -> Expression | None:
        given = [new[id(argument)] for argument in item.arguments]
        match item.operation, given:
            case "symbol", _ if item.value == "j":
                return ZERO
            case "*", [a, b] if a is ZERO or b is ZERO:
                return ZERO
            case "fma", [a, b, c] if a is ZERO or b is ZERO:
                return c
            case _:
                return None

    return rewritten(predict, begun)
