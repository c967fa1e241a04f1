"""A filter, or a bank of interacting ones, in C99 for a controller: from the rule and the model that Python runs.

One header and one source, an example and a Makefile. Nothing is allocated, every loop is bounded, and a step takes at
most the number of operations stated in the header.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import log, pi

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem
from estimation.engine.lanes import LARGE
from estimation.engine.layout import upper_triangle
from estimation.engine.rule import Rule, Setting, chosen_settings, weighing
from estimation.engine.runner import constant_row
from estimation.export.bank_in_c import BankInC, bank_in_c
from estimation.export.rule_in_c import RuleInC, rule_in_c
from estimation.filters.ekf import EKF
from estimation.filters.imm import IMM_SETTINGS, bank_parameters, log_transitions
from estimation.filters.online import RULES
from estimation.trust.consistency import LARGEST_NIS, MISMATCH_NIS
from plant.compiled.c99.files import c_files, checked_name
from plant.compiled.c99.precision import Precision, precision_of
from plant.errors import require_known
from plant.log.record import CHANNELS
from plant.units import notes

EXPORTED = (*RULES, "imm")
"""Methods that can be exported."""

ROUNDED_TWICE = (("acceleration", "ekf"), ("pressure", "ekf"), ("pressure", "imm"))
"""Forms and methods that stay within 1e-12 of Python with separate rounding of products and sums, measured over 100,000
steps in nine conditions (`python -m benchmarks export_c`); all others use the library's fused multiply-add."""

LARGE_PRODUCT = {"double": LARGE, "float": 1e15}
"""If the product of innovation variances exceeds this, its logarithm is added to the sum [dimensionless]."""


@dataclass(frozen=True)
class Numbers:
    """Constants and initial belief of a filter, as tables of C.

    Parameters
    ----------
    rows : ndarray, shape (modes, rows)
        Parameters [SI], process noise [dimensionless per second], variances [SI squared], settings, step [s], its
        share.
    mean : ndarray, shape (states,)
        Belief before the first sample, in the filter's units [dimensionless].
    covariance : ndarray, shape (states (states + 1) / 2,)
        Its upper triangle, row by row, in the filter's units [dimensionless].
    transitions : ndarray, shape (modes, modes)
        Logarithms of the transition probabilities between modes [dimensionless].
    """

    rows: Array
    mean: Array
    covariance: Array
    transitions: Array


def filter_in_c(problem: FilterProblem, method: str = "ekf", *, name: str, precision: str = "double") -> dict[str, str]:
    """Write a filter as C99.

    Parameters
    ----------
    problem : FilterProblem
        The task, for its model, channels, numbers and sampling; its log is not used.
    method : str
        One of `EXPORTED`.
    name : str
        Name of its files, types and functions: a valid name in C.
    precision : str
        ``double`` or ``float``.

    Returns
    -------
    dict[str, str]
        Texts of ``NAME.h``, ``NAME.c``, ``example.c`` and ``Makefile``, by file name.

    Raises
    ------
    HydrostateError
        If method or precision is not known, a setting is not what it must be, or C does not allow the name.
    """
    require_known("a method that can be exported", method, EXPORTED)
    real, name = precision_of(precision), checked_name(name)
    rule, _, numbers = _rule_and_numbers(problem, method)
    written = rule_in_c(rule, problem.model, problem.channels, real, name, scored=method != "imm")
    bank = None
    if method == "imm":
        bank = bank_in_c(written, problem.model, len(problem.channels), len(numbers.rows), problem.substeps, real, name)
    facts = {
        **_shapes(problem, written, bank, len(numbers.rows)),
        **_names(problem, method),
        **_tables(numbers, real),
        **_judging(problem, real),
        "method": method,
        "robust": problem.robust,
        "exact": (problem.model.name, method) not in ROUNDED_TWICE or problem.robust != "none",
        "functions": written.text,
        "bank": bank,
        "operations": _operations(problem, written, bank),
        "form": problem.model.name,
        "sample_time": problem.sample_time,
        "scanned": "%f" if real.name == "float" else "%lf",
    }
    return c_files("estimation", "filter", name, real, facts)


def _rule_and_numbers(problem: FilterProblem, method: str) -> tuple[Rule, Sequence[Setting], Numbers]:
    rule = weighing(RULES.get(method, EKF), problem.robust)
    chosen = chosen_settings(problem, method, IMM_SETTINGS if method == "imm" else rule.settings)
    packed = problem.covariance[upper_triangle(problem.model.width)]
    if method != "imm":
        row = constant_row(problem, chosen)[None]
        return rule, rule.settings, Numbers(row, problem.mean, packed, np.zeros((1, 1)))
    rows = np.array([constant_row(replace(problem, parameters=one), {}) for one in bank_parameters(problem)])
    transitions = log_transitions([chosen["dwell_time"]] * len(rows), problem.sample_time)
    return rule, (), Numbers(rows, problem.mean, packed, transitions)


def _shapes(problem: FilterProblem, written: RuleInC, bank: BankInC | None, modes: int) -> dict[str, int]:
    states, count = problem.model.width, len(problem.channels)
    belief = states + states * (states + 1) // 2
    sums = len(written.carried) - 3 * count
    return {
        "states": states,
        "channels": count,
        "drives": len(problem.model.drives),
        "rows": len(written.rows),
        "modes": modes,
        "carried": len(written.carried),
        "constants": max(1, written.constants),
        "belief": belief,
        "substeps": problem.substeps,
        "nis_at": sums,
        "count_at": sums + count,
        "product_at": sums + 2 * count,
        "variance_row": len(fields(problem.model.parameters)) + states,
        "probabilities": 0 if bank is None else modes,
    }


def numbers_of(problem: FilterProblem, method: str) -> Array:
    """Return the constants of a filter.

    Parameters
    ----------
    method : str
        One of `EXPORTED`.

    Returns
    -------
    ndarray, shape (modes, rows)
        Its values, named by `row_notes`.
    """
    return _rule_and_numbers(problem, method)[2].rows


def row_notes(problem: FilterProblem, method: str) -> list[tuple[str, str, str]]:
    """Return name, unit and meaning of the constants of a filter, in their order.

    Parameters
    ----------
    method : str
        One of `EXPORTED`.

    Returns
    -------
    list of (str, str, str)
        One for each row of `numbers_of`.
    """
    model, settings = problem.model, _rule_and_numbers(problem, method)[1]
    told = [(name, note.unit, note.meaning) for name, note in notes(model.parameters).items()]
    for state in model.states:
        size = "" if state.logarithmic else f" over ({state.scale:g} {state.unit})^2"
        kind = "the logarithm of " if state.logarithmic else ""
        told.append((f"noise_{state.name}", "1/s", f"process-noise density of {kind}{state.name}{size}"))
    told += [(f"variance_{one}", _squared_unit(CHANNELS[one]), f"variance of {one}") for one in problem.channels]
    told += [(setting.name, "1", "setting of the filter") for setting in settings]
    return [*told, ("step", "s", "step of the model"), ("share", "1", "its share of a sample")]


def _squared_unit(unit: str) -> str:
    return "/".join(f"{part}^2" for part in unit.split("/"))


def _names(problem: FilterProblem, method: str) -> dict[str, object]:
    """Return every name with the text of its comment."""
    return {
        "row_names": [(name, f"{unit}, {meaning}") for name, unit, meaning in row_notes(problem, method)],
        "state_names": [(state.name, _state_note(problem, i)) for i, state in enumerate(problem.model.states)],
        "channel_names": problem.channels,
        "drive_names": problem.model.drives,
    }


def _state_note(problem: FilterProblem, i: int) -> str:
    state = problem.model.states[i]
    inside = f"logarithm over {state.scale:g}" if state.logarithmic else f"over {state.scale:g}"
    return f"{state.unit}; inside the filter its {inside}" if state.logarithmic else f"{state.unit}; inside {inside}"


def _tables(numbers: Numbers, real: Precision) -> dict[str, object]:
    return {
        "row_values": [[real.literal(value) for value in row] for row in numbers.rows.tolist()],
        "mean_values": [real.literal(value) for value in numbers.mean.tolist()],
        "covariance_values": [real.literal(value) for value in numbers.covariance.tolist()],
        "transition_values": [real.literal(value) for value in numbers.transitions.ravel().tolist()],
        "equal_probability": real.literal(-log(len(numbers.rows))),
    }


def _judging(problem: FilterProblem, real: Precision) -> dict[str, object]:
    bounds = [state.scaled_bounds for state in problem.model.states]
    return {
        "scales": [real.literal(state.scale) for state in problem.model.states],
        "rising": [int(state.logarithmic) for state in problem.model.states],
        "lower": [real.literal(low + 1e-3 if low > -np.inf else low) for low, _ in bounds],
        "upper": [real.literal(high * 0.999 if high > 0.0 else high) for _, high in bounds],
        "largest_nis": real.literal(LARGEST_NIS),
        "mismatch_nis": real.literal(MISMATCH_NIS),
        "large_product": real.literal(LARGE_PRODUCT[real.name]),
        "two_pi": real.literal(2.0 * pi),
    }


def _operations(problem: FilterProblem, written: RuleInC, bank: BankInC | None) -> list[tuple[str, int]]:
    if bank is not None:
        return sorted(bank.operations.items())
    total = Counter(written.operations["update"])
    total.update({kind: problem.substeps * count for kind, count in written.operations["predict"].items()})
    total.update({"calls of exp, log, tanh": len(problem.channels), "choices and comparisons": len(problem.channels)})
    return sorted(total.items())
