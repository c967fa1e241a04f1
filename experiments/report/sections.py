"""The report's tables by name: which columns of the study's tables a reader sees, in which units."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import pandas as pd
from markupsafe import Markup

from experiments.report.errata import linked
from experiments.report.findings import (
    ExperimentKey,
    Recovery,
    by_experiment,
    class_accuracies,
    experiment_in_words,
    recoveries,
)
from experiments.report.tables import MINUS, MISSING, Cell, Column, exact, fixed, html_table, number, pretty_unit
from experiments.report.words import bank_in_words, in_words
from experiments.study import StudyResult

MILLI, KILO_PASCAL, TENTH_GIGA_PASCAL = 1e3, 1e-3, 1e-8
"""From m to mm, from Pa to kPa, from Pa to 1e8 Pa."""

CONDITION = Column("condition", "condition", words=lambda name: Cell(in_words(name), "name"))

SCALAR_UNITS: Mapping[str, tuple[str, float]] = {"1": ("%", 100.0), "Hz": ("Hz", 1.0), "Pa": ("Pa", 1.0)}
"""How a scalar is shown, by its SI unit."""

SETTING_UNITS: Mapping[str, str] = {
    "starts": " [Pa]",
    "duration": " [s]",
    "sample_time": " [s]",
    "identification_duration": " [s]",
    "classification_sample_time": " [s]",
    "seeds": " [count]",
}
"""Units of the study's settings."""

Tables = Mapping[str, pd.DataFrame]


def report_tables(result: StudyResult) -> Mapping[str, Markup]:
    """Return every table of the report as HTML.

    Parameters
    ----------
    result : StudyResult
        What a study found.

    Returns
    -------
    Mapping[str, Markup]
        By the name that the template uses.
    """
    makers: Mapping[str, Callable[[StudyResult], Markup]] = {
        "parameters": lambda found: _parameters(found.tables["parameters"]),
        "conditions": lambda found: _conditions(found.tables["conditions"]),
        "recoveries": lambda found: _recoveries(recoveries(found.tables["bulk_modulus"]).values()),
        "estimates": lambda found: _estimates(found.tables["bulk_modulus"]),
        "transfer_functions": lambda found: _transfer_functions(found.tables["transfer_functions"]),
        "filtering": lambda found: _filtering(found.tables["filtering"]),
        "rmse": lambda found: _rmse(found.tables["validation_rmse"]),
        "classification": lambda found: _classification(found.tables),
        "scalars": lambda found: _scalars(found.tables["scalars"]),
        "settings": lambda found: _settings(found.manifest["settings"]),
        "versions": lambda found: _pairs(
            {"python": found.manifest["python"], **found.manifest["versions"]}, "Versions that ran it"
        ),
    }
    return {name: make(result) for name, make in makers.items()}


def _parameters(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("meaning", "parameter"),
        Column("value", "value", words=lambda value: Cell(exact(float(value)), "number")),
        Column("unit", "unit", words=pretty_unit),
        Column("source", "source", words=linked),
        Column("parameter", "name in the code", words=lambda name: Markup("<code>{}</code>").format(name)),
    )
    return html_table(frame, columns, "The healthy actuator.")


def _conditions(frame: pd.DataFrame) -> Markup:
    exactly: Callable[[float], Cell] = lambda value: Cell(exact(value), "number")  # noqa: E731 - a shared cell writer
    columns = (
        CONDITION,
        Column("throttle_a_v", "throttle A", "V", words=exactly),
        Column("throttle_b_v", "throttle B", "V", words=exactly),
        Column("leakage_coefficient_m3_s_pa", "leakage", "m³/(s Pa)", words=exactly),
        Column("flow_bias_m3_s", "flow bias", "m³/s", words=exactly),
        Column("friction_quadratic_n_s2_m2", "friction a₁", "N s²/m²", words=exactly),
        Column("friction_linear_n_s_m", "friction a₂", "N s/m", words=exactly),
        Column("friction_coulomb_n", "friction a₃", "N", words=exactly),
        Column("steady_velocity_m_s", "velocity at 4 V", "mm/s", MILLI, 3),
        Column("velocity_percent_of_normal", "of normal", "%", digits=3),
        Column("steady_pressure_pa", "dp at 4 V", "kPa", KILO_PASCAL, 4),
        Column("pressure_percent_of_normal", "of normal", "%", digits=3),
    )
    return html_table(frame, columns, "The nine conditions, from Tables 1, 3 and 4, and where each settles at 4 V.")


def _recoveries(found: Iterable[Recovery]) -> Markup:
    rows = [
        {
            "experiment": experiment_in_words(entry.key),
            "claim": entry.claim,
            "recovered": _recovered(entry),
            "wanted": MISSING if entry.wanted_percent is None else f"{entry.wanted_percent:g}",
            "worst": entry.worst_error_percent,
            "mean": entry.mean_pa,
            "missed": "; ".join(entry.missed) or "none",
            "unobservable": len(entry.unobservable),
        }
        for entry in found
    ]
    columns = (
        Column("experiment", "experiment"),
        Column("claim", "what it shows", words=linked),
        Column("recovered", "conditions recovered"),
        Column("mean", "mean estimate", "1e8 Pa", TENTH_GIGA_PASCAL),
        Column("worst", "worst error", "%", digits=2),
        Column("wanted", "error allowed", "%", words=lambda text: Cell(text, "number")),
        Column("unobservable", "conditions not observable", words=lambda count: Cell(str(count), "number")),
        Column("missed", "conditions missed"),
    )
    return html_table(
        pd.DataFrame(rows, dtype=object), columns, "The experiments, over all conditions and first guesses."
    )


def _recovered(entry: Recovery) -> Cell:
    text = f"{entry.recovered} of {entry.conditions}"
    return Cell(text, "good" if entry.recovered == entry.conditions else "bad" if entry.missed else "none")


def _estimates(frame: pd.DataFrame) -> Markup:
    rows: dict[str, dict[str, object]] = {}
    columns = [CONDITION]
    for key, found in by_experiment(frame):
        name = experiment_in_words(key)
        columns.append(Column(name, name, "1e8 Pa, worst error"))
        for condition, cell in found.groupby("condition", sort=False):
            rows.setdefault(str(condition), {"condition": str(condition)})[name] = _estimate(cell, key)
    return html_table(
        pd.DataFrame(list(rows.values()), dtype=object),
        columns,
        "Final estimates: lowest and highest over all first guesses. A number in red is refused by the filter's own "
        "check of its residuals.",
    )


def _estimate(rows: pd.DataFrame, key: ExperimentKey) -> Cell:
    values = rows["value_pa"].astype(float).dropna()
    if values.empty:
        bound = float(rows["bound_percent"].min())
        outcome = str(rows["outcome"].iloc[0]).replace("_", " ")
        return Cell(f"{outcome} (bound {number(bound, 2)} %)" if math.isfinite(bound) else outcome, "none")
    digits = 4 if key.form in {"pressure", "flow"} or key.plant == "reduced" else 2
    low, high = (number(TENTH_GIGA_PASCAL * value, digits) for value in (values.min(), values.max()))
    worst = number(float(rows["error_percent"].astype(float).abs().max()), 2)
    spread = low if low == high else f"{low} to {high}"
    return Cell(f"{spread}, {worst} %", "" if bool(rows["gate_passed"].all()) else "bad")


def _transfer_functions(frame: pd.DataFrame) -> Markup:
    names = ("b0", "b1", "b2", "a1", "a2")
    rows: list[dict[str, object]] = []
    for row in frame.to_dict("records"):
        ours: dict[str, object] = {"condition": in_words(str(row["condition"])), "source": "ours"}
        ours |= {name: number(row[name]) for name in names}
        ours |= {
            "gain": f"{fixed(MILLI * row['dc_gain'], 4)} ± {fixed(1.96 * MILLI * row['dc_gain_std'], 4)}",
            "bandwidth": fixed(row["bandwidth_hz"], 1),
            "fit": fixed(row["fit_percent"], 1),
            "jump": fixed(row["jump_ratio"], 2),
        }
        printed: dict[str, object] = {"condition": "", "source": "Table 6"}
        printed |= {name: exact(row[f"published_{name}"]) for name in names}
        low, high = MILLI * row["published_dc_gain_low"], MILLI * row["published_dc_gain_high"]
        printed |= {"gain": f"{fixed(low, 3)} to {fixed(high, 3)}"}
        printed |= dict.fromkeys(("bandwidth", "fit", "jump"), MISSING)
        rows += [ours, printed]
    right: Callable[[str], Cell] = lambda text: Cell(text, "number")  # noqa: E731 - a shared cell writer
    columns = (
        Column("condition", "condition", words=lambda name: Cell(name, "name")),
        Column("source", "model", words=lambda source: Cell(source, "name")),
        *(Column(name, name, words=right) for name in names),
        Column("gain", "steady gain", "mm/s per rad/s, 95 %", words=right),
        Column("bandwidth", f"{MINUS}3 dB", "Hz", words=right),
        Column("fit", "fit", "%", words=right),
        Column("jump", "b0 / gain", "ratio", words=right),
    )
    caption = "(b0 z² + b1 z + b2) / (z² + a1 z + a2), from motor speed in rad/s to velocity in m/s, beside Table 6."
    return html_table(pd.DataFrame(rows), columns, caption)


def _filtering(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("variant", "zero-phase filter"),
        Column("pole_frequency_hz", "pole frequency", "Hz", digits=3),
        Column("damping", "damping", "ratio", digits=3),
        Column("dc_gain", "steady gain", "ratio", digits=4),
        Column("jump_ratio", "b0 / gain", "ratio", words=lambda value: Cell(fixed(value, 3), "number")),
    )
    return html_table(frame, columns, "What filtering does to a fit, on a known 30 Hz resonance that does not jump.")


def _rmse(frame: pd.DataFrame) -> Markup:
    columns = (
        CONDITION,
        Column("rmse_transfer_function_m_s", "transfer function, ours", "mm/s", MILLI, 3),
        Column("rmse_mathematical_m_s", "mathematical model, ours", "mm/s", MILLI, 3),
        Column("published_rmse_transfer_function_m_s", "transfer function, Table 5", "mm/s", MILLI, 2),
        Column("published_rmse_mathematical_m_s", "mathematical model, Table 5", "mm/s", MILLI, 2),
        Column(
            "mathematical_is_better",
            "mathematical model better, ours",
            words=lambda better: Cell("yes", "good") if better else Cell("no", "bad"),
        ),
    )
    return html_table(frame, columns, "Root-mean-square error in velocity on the nine steps, beside Table 5.")


def _classification(tables: Tables) -> Markup:
    rows = [
        {
            "bank": bank_in_words(entry.bank),
            "variant": entry.variant,
            "runs": str(entry.runs),
            "percent": entry.percent,
            "error": entry.likeliest_error or "none",
        }
        for entry in class_accuracies(tables)
    ]
    columns = (
        Column("bank", "models"),
        Column("variant", "parameters"),
        Column("runs", "runs", "count", words=lambda text: Cell(text, "number")),
        Column("percent", "class right", "%"),
        Column("error", "most frequent error"),
    )
    return html_table(pd.DataFrame(rows), columns, "Nine classes, the smallest error names the class.")


def _scalars(frame: pd.DataFrame) -> Markup:
    rows: Sequence[dict[str, Any]] = [
        {
            "quantity": row["quantity"],
            "unit": SCALAR_UNITS[str(row["unit"])][0],
            "published": exact(float(f"{SCALAR_UNITS[str(row['unit'])][1] * row['published']:.6g}")),
            "ours": number(SCALAR_UNITS[str(row["unit"])][1] * row["ours"]),
            "difference": 100.0 * (row["ours"] / row["published"] - 1.0),
            "where": row["where"],
            "note": row["note"],
        }
        for row in frame.to_dict("records")
    ]
    columns = (
        Column("quantity", "quantity"),
        Column("published", "published", words=lambda text: Cell(text, "number")),
        Column("ours", "ours", words=lambda text: Cell(text, "number")),
        Column("unit", "unit"),
        Column("difference", "difference", "% of published", digits=2),
        Column("where", "where in the paper", words=linked),
        Column("note", "what differs and why", words=linked),
    )
    return html_table(pd.DataFrame(rows), columns, "The scalars of the paper's text, beside ours.")


def _settings(values: Mapping[str, Any]) -> Markup:
    with_units = {f"{name.replace('_', ' ')}{SETTING_UNITS.get(name, '')}": value for name, value in values.items()}
    return _pairs(with_units, "Settings of this run")


def _pairs(values: Mapping[str, Any], caption: str) -> Markup:
    rows = [{"name": name, "value": _plainly(value)} for name, value in values.items()]
    columns = (Column("name", "name"), Column("value", "value"))
    return html_table(pd.DataFrame(rows, dtype=object), columns, caption)


def _plainly(value: object) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(_plainly(entry) for entry in value)
    return exact(value) if isinstance(value, float) else str(value)
