"""Columns of the study's tables in the report, with units and words."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from platform import python_version
from typing import Any

import pandas as pd
from markupsafe import Markup

from estimation.finding import NORMAL_95
from experiments.nine_conditions.bulk_modulus import Experiment
from experiments.nine_conditions.findings import (
    bank_in_words,
    by_experiment,
    class_accuracies,
    experiment_in_words,
    recoveries,
)
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.transfer_functions import COEFFICIENTS
from experiments.page.frames import Rows, Tables, as_table
from experiments.page.numbers import MINUS, MISSING, exact, fixed, number, pretty_unit, shop_unit
from experiments.page.tables import Cell, Column, Columns, Row, decimals, exact_cell, name_in_words, right_aligned
from experiments.page.words import CONDITION, condition_in_words
from experiments.running.study import versions

MEGAPASCAL, _ = shop_unit("Pa")
"""From Pa to MPa."""


SCALAR_UNITS: Mapping[str, tuple[str, float]] = {"1": ("%", 100.0), "Hz": ("Hz", 1.0), "Pa": ("MPa", MEGAPASCAL)}
"""Unit and factor with which a scalar is shown, by its SI unit."""

SETTING_UNITS: Mapping[str, str] = {
    "starts": " [Pa]",
    "duration": " [s]",
    "sample_time": " [s]",
    "identification_duration": " [s]",
    "classification_sample_time": " [s]",
    "seeds": " [count]",
    "filterpy_samples": " [count]",
}


def report_frames(tables: Tables, settings: StudySettings) -> Tables:
    """Return the tables that only the report shows; each summarises several of the study's tables."""
    named = {f"{name_in_words(name)}{SETTING_UNITS.get(name, '')}": value for name, value in asdict(settings).items()}
    return {
        "filterpy by experiment": _filterpy_by_experiment(tables["filterpy"]),
        "recoveries": pd.DataFrame([asdict(entry) for entry in recoveries(tables["bulk_modulus"]).values()]),
        "estimates by condition": _estimates(tables["bulk_modulus"]),
        "models": _models(tables["transfer_functions"]),
        "class accuracies": pd.DataFrame([asdict(entry) for entry in class_accuracies(tables)]),
        "settings of this run": _pairs(named),
        "versions that ran it": _pairs({"python": python_version(), **versions()}),
    }


def _estimates(frame: pd.DataFrame) -> pd.DataFrame:
    rows: dict[str, dict[str, object]] = {}
    for key, found in by_experiment(frame):
        for condition, cell in found.groupby("condition", sort=False):
            row = rows.setdefault(str(condition), {"condition": str(condition)})
            row[experiment_in_words(key)] = _estimate_cell(cell, key)
    return pd.DataFrame(list(rows.values()), dtype=object)


def _filterpy_by_experiment(frame: pd.DataFrame) -> pd.DataFrame:
    """Return the final values of filterpy's filter and ours, one row per condition, one column per experiment."""
    rows: dict[str, dict[str, object]] = {}
    for key, found in by_experiment(frame):
        for entry in found.to_dict("records"):
            row = rows.setdefault(str(entry["condition"]), {"condition": str(entry["condition"])})
            row[experiment_in_words(key)] = _filterpy_cell(entry)
    return pd.DataFrame(list(rows.values()), dtype=object)


def _filterpy_cell(entry: Row) -> Cell:
    ours, its = (number(MEGAPASCAL * entry[name], 5) for name in ("ours_pa", "filterpy_pa"))
    apart = f"{entry['verdict']}, {number(entry['largest_difference'], 1)}"
    return Cell(f"{ours}; {its} ({apart})", "good" if entry["verdict"] == "equal" else "bad")


def _estimate_cell(rows: pd.DataFrame, key: Experiment) -> Cell:
    values = rows["value_pa"].astype(float).dropna()
    if values.empty:
        bound = float(rows["bound_percent"].min())
        outcome = name_in_words(str(rows["outcome"].iloc[0]))
        least = f"{number(bound, 2)} %" if bound < 100.0 else "over 100 %"
        return Cell(f"{outcome} (bound {least})" if math.isfinite(bound) else outcome, "none")
    digits = 4 if key.form in {"pressure", "flow"} or key.plant == "reduced" else 2
    low, high = (number(MEGAPASCAL * value, digits) for value in (values.min(), values.max()))
    error = float(rows["error_percent"].astype(float).abs().max())
    worst = "< 0.001" if error < 1e-3 else number(error, 2)
    spread = low if low == high else f"{low} to {high}"
    return Cell(f"{spread}, {worst} %", "" if bool(rows["gate_passed"].all()) else "bad")


@as_table
def _models(frame: pd.DataFrame) -> Rows:
    """Return two rows for each condition: our model, and the model printed in Table 6."""
    for row in frame.to_dict("records"):
        gain, std = 1e3 * row["dc_gain"], 1e3 * NORMAL_95 * row["dc_gain_std"]
        low, high = 1e3 * row["published_dc_gain_low"], 1e3 * row["published_dc_gain_high"]
        ours: dict[str, object] = {"condition": condition_in_words(str(row["condition"])), "source": "ours"}
        ours |= {name: number(row[name]) for name in COEFFICIENTS}
        ours |= {"gain": f"{fixed(gain, 4)} ± {fixed(std, 4)}", "bandwidth": fixed(row["bandwidth_hz"], 1)}
        ours |= {"fit": fixed(row["fit_percent"], 1), "jump": fixed(row["jump_ratio"], 2)}
        printed: dict[str, object] = {"condition": "", "source": "Table 6"}
        printed |= {name: exact(row[f"published_{name}"]) for name in COEFFICIENTS}
        printed |= {
            "gain": f"{fixed(low, 3)} to {fixed(high, 3)}",
            **dict.fromkeys(("bandwidth", "fit", "jump"), MISSING),
        }
        yield from [ours, printed]


def _pairs(values: Mapping[str, Any]) -> pd.DataFrame:
    return pd.DataFrame([{"name": name, "value": _plain_text(value)} for name, value in values.items()], dtype=object)


def _plain_text(value: object) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(_plain_text(entry) for entry in value)
    return exact(value) if isinstance(value, float) else str(value)


def _recovered_cell(row: Row) -> Cell:
    text = f"{row['recovered']} of {row['conditions']}"
    return Cell(text, "good" if row["recovered"] == row["conditions"] else "bad" if row["missed"] else "none")


def _count_of_estimates(name: str) -> Callable[[Row], Cell]:
    return lambda row: right_aligned(f"{row[name]} of {row['estimates']}")


def _published_cell(row: Row) -> Cell:
    return right_aligned(exact(float(f"{SCALAR_UNITS[row['unit']][1] * row['published']:.6g}")))


def _ours_cell(row: Row) -> Cell:
    return right_aligned(number(SCALAR_UNITS[row["unit"]][1] * row["ours"]))


def _difference_cell(row: Row) -> Cell:
    return right_aligned(number(100.0 * (row["ours"] / row["published"] - 1.0), 2))


_exact_column = partial(Column, words=exact_cell)

COLUMNS: Mapping[str, Columns] = {
    "parameters": (
        Column("meaning", "parameter"),
        Column("value", words=exact_cell),
        Column("unit", words=pretty_unit),
        "source",
        Column("parameter", "name in the code", words=lambda name: Markup("<code>{}</code>").format(name)),
    ),
    "conditions": (
        CONDITION,
        _exact_column("throttle_a_v", "throttle A"),
        _exact_column("throttle_b_v", "throttle B"),
        _exact_column("leakage_coefficient_m3_s_pa", "leakage", "m³/(s Pa)"),
        _exact_column("flow_bias_m3_s", "flow bias", "m³/s"),
        _exact_column("friction_quadratic_n_s2_m2", "friction a₁", "N s²/m²"),
        _exact_column("friction_linear_n_s_m", "friction a₂", "N s/m"),
        _exact_column("friction_coulomb_n", "friction a₃"),
        Column("steady_velocity_m_s", "velocity at 4 V", digits=3),
        Column("velocity_percent_of_normal", "of normal", "%", digits=3),
        Column("steady_pressure_pa", "dp at 4 V", "kPa", 1e-3),
        Column("pressure_percent_of_normal", "of normal", "%", digits=3),
    ),
    "recoveries": (
        Column("key", "experiment", words=experiment_in_words),
        Column("claim", "what it shows"),
        Column("recovered", "conditions recovered", of_row=_recovered_cell),
        Column("passed", "gate passes", "estimates", of_row=_count_of_estimates("passed")),
        Column("covered", "interval holds the truth", "estimates", of_row=_count_of_estimates("covered")),
        Column("mean_pa", "mean estimate"),
        Column("worst_error_percent", digits=2),
        Column("wanted_percent", "error allowed", digits=1),
        Column("unobservable", "conditions not observable", words=lambda names: right_aligned(str(len(names)))),
        Column("missed", "conditions missed", words=lambda names: "; ".join(names) or "none"),
    ),
    "filterpy by experiment": (CONDITION, lambda name: Column(name, name, "MPa: ours; filterpy")),
    "estimates by condition": (CONDITION, lambda name: Column(name, name, "MPa, worst error")),
    "models": (
        Column("condition", words=lambda name: Cell(name, "name")),
        Column("source", "model", words=lambda source: Cell(source, "name")),
        *(Column(name, words=right_aligned) for name in COEFFICIENTS),
        Column("gain", "steady gain", "mm/s per rad/s, 95 %", words=right_aligned),
        Column("bandwidth", f"{MINUS}3 dB", "Hz", words=right_aligned),
        Column("fit", unit="%", words=right_aligned),
        Column("jump", "b0 / gain", "ratio", words=right_aligned),
    ),
    "filtering": (
        Column("variant", "zero-phase filter"),
        Column("pole_frequency_hz", digits=3),
        Column("damping", unit="ratio", digits=3),
        Column("dc_gain", "steady gain", "ratio"),
        Column("jump_ratio", "b0 / gain", "ratio", words=decimals(3)),
    ),
    "printed_test": (
        CONDITION,
        *(Column(name, words=number) for name in COEFFICIENTS),
        Column("dc_gain", "steady gain", "m/rad", digits=3),
        Column("bandwidth_hz", f"{MINUS}3 dB", "Hz", digits=3),
        Column("fit_percent", "fit", "%", digits=3),
        Column("held", "cells of Table 6 held", "of 5"),
    ),
    "validation_rmse": (
        CONDITION,
        Column("rmse_transfer_function_m_s", "transfer function, ours", digits=3),
        Column("rmse_mathematical_m_s", "mathematical model, ours", digits=3),
        Column("published_rmse_transfer_function_m_s", "transfer function, Table 5", digits=2),
        Column("published_rmse_mathematical_m_s", "mathematical model, Table 5", digits=2),
        Column("mathematical_is_better", "mathematical model better, ours"),
    ),
    "validation_on_circuit": (
        CONDITION,
        Column("rmse_transfer_function_m_s", "transfer function", digits=3),
        Column("least_transfer_function_m_s", "best circuit", digits=3),
        Column("largest_transfer_function_m_s", "worst circuit", digits=3),
        Column("rmse_mathematical_m_s", "mathematical model", digits=3),
        Column("least_mathematical_m_s", "best circuit", digits=3),
        Column("largest_mathematical_m_s", "worst circuit", digits=3),
    ),
    "class accuracies": (
        Column("bank", "models", words=bank_in_words),
        Column("variant", "parameters"),
        Column("runs", unit="count"),
        Column("percent", "class right", "%"),
        Column("likeliest_error", "most frequent error", words=lambda error: error or "none"),
    ),
    "scalars": (
        "quantity",
        Column("published", of_row=_published_cell),
        Column("ours", of_row=_ours_cell),
        Column("unit", words=lambda unit: SCALAR_UNITS[unit][0]),
        Column("ours", "difference", "% of published", of_row=_difference_cell),
        Column("where", "where in the paper"),
        Column("note", "what differs and why"),
    ),
    "settings of this run": ("name", "value"),
    "versions that ran it": ("name", "value"),
}
