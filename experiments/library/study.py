"""The library's study: builds the library, analyses it, and compares it with Table 6."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import pandas as pd

from estimation.finding import NORMAL_95
from estimation.identification.design.input_design import Limits
from experiments.library.figures import LIBRARY_FIGURES
from experiments.library.library import MEAN_V, build_library, library_text
from experiments.library.sentences import clock_sentences, order_sentences, structure_sentences
from experiments.library.structures import clock_table, order_and_bandwidth, structure_table
from experiments.library.tables import library_table, response_table, root_table
from experiments.page.frames import Rows, Tables, as_table
from experiments.page.numbers import decimals_of, fixed
from experiments.page.tables import Cell, Column, Columns, Row, right_aligned
from experiments.page.words import CONDITION
from experiments.published.library import library_models
from experiments.running.progress import Track, run_as_one_piece
from experiments.running.study import SeedSettings, Study, StudyResult
from plant.eha.circuit_parameters import CircuitParameters

RIG = CircuitParameters()


def _find(settings: SeedSettings, track: Track) -> StudyResult:
    built = run_as_one_piece(track, "identifying nine conditions", lambda: build_library(settings.seed))
    models, around = library_models(built), library_models(built, "around_mean")
    limits = Limits(RIG.rated_speed, stroke=RIG.stroke)
    makers = {
        "library": lambda: library_table(models),
        "roots": lambda: root_table(models),
        "responses": lambda: response_table(models),
        "structures": lambda: structure_table(RIG, around, settings.seed),
        "orders": lambda: order_and_bandwidth(RIG, around, settings.seed),
        "clocks": lambda: clock_table(around["major_leakage"], limits, settings.seed).reset_index(),
    }
    tables = {name: make() for name, make in track(makers.items(), description="looking at it")}
    return StudyResult(tables, files={"library.json": library_text(built).encode()})


def _facts(tables: Tables, _: SeedSettings) -> Mapping[str, Any]:
    """Return the report's sentences, and the roots with one row for each condition."""
    ours = tables["structures"].query("structure == 'output-error'")
    return {
        "best": int(ours["best"].sum()),
        "conditions": len(ours),
        "mean_v": f"{MEAN_V:g}",
        "structure_sentences": structure_sentences(tables["structures"]),
        "order_sentences": order_sentences(tables["orders"]),
        "clock_sentences": clock_sentences(tables["clocks"]),
        "roots by condition": _roots(tables["roots"]),
    }


@as_table
def _roots(frame: pd.DataFrame) -> Rows:
    for condition, of_one in frame.groupby("condition", sort=False):
        row = {"condition": str(condition)}
        for (kind, source), roots in of_one.groupby(["kind", "source"]):
            above = [root for root in roots.to_dict("records") if root["imag"] >= 0.0]  # one of each complex pair
            row[f"{kind}s, {source}"] = "; ".join(_root(root) for root in above)
        yield row


def _root(root: Row) -> str:
    text = _with_spread(root["real"], root["real_spread"])
    if not root["imag"] > 0.0:
        return text
    return f"pair: real {text}, imaginary {_with_spread(root['imag'], root['imag_spread'])}"


def _with_spread(value: float, spread: float) -> str:
    """Return a number with its uncertainty, both rounded to the first significant digit of the uncertainty."""
    decimals = decimals_of(0.0, 5.0 * spread, 5)
    return f"{fixed(value, decimals)} ± {fixed(spread, decimals)}"


def _gain(row: Row) -> Cell:
    return right_aligned(f"{fixed(1e3 * row['dc_gain'], 4)} ± {fixed(1e3 * NORMAL_95 * row['dc_gain_std'], 4)}")


def _printed_gain(row: Row) -> Cell:
    return right_aligned(f"{fixed(1e3 * row['published_gain_low'], 3)} to {fixed(1e3 * row['published_gain_high'], 3)}")


def _shortfall_cell(row: Row) -> Cell:
    if row["best"]:
        return Cell("best", "good")
    return right_aligned(f"{fixed(row['behind_percent'], 2)} ± {fixed(row['behind_std_percent'], 2)}")


def _at_frequency(name: str) -> Column | None:
    if not name.startswith("at_"):
        return None
    return Column(name, f"at {name.split('_')[1].removesuffix('.0')} Hz", "% of gain", 100.0, 2)


COLUMNS: Mapping[str, Columns] = {
    "library": (
        CONDITION,
        Column("dc_gain", "steady gain", "mm/s per rad/s, ± 95 %", of_row=_gain),
        Column("published_gain_low", "gain, Table 6", "mm/s per rad/s, by rounding", of_row=_printed_gain),
        Column("bandwidth_hz", "3 dB down", digits=3),
        Column("published_bandwidth_hz", "3 dB down, Table 6", digits=3),
        Column("jump_ratio", "b0 / gain", "ratio", digits=2),
        Column("published_jump_ratio", "b0 / gain, Table 6", "ratio", digits=2),
        Column("fit_percent", digits=3),
    ),
    "roots by condition": (CONDITION, "poles, library", "poles, Table 6", "zeros, library", "zeros, Table 6"),
    "structures": (
        *(CONDITION, "order", "structure", Column("fit_percent", "free run")),
        Column("behind_percent", "behind the best", "points ± standard error", of_row=_shortfall_cell),
        Column("one_step_percent", "one step ahead"),
        Column("weight_above_percent", "weight above 25 Hz", digits=2),
        Column("dc_gain", "steady gain", "mm/s per rad/s", 1e3),
    ),
    "orders": (
        CONDITION,
        Column("order_by_values", "order by singular values"),
        Column("order_by_bic", "order by BIC"),
        Column("order_of_library", "order kept"),
        *(Column(f"value_{k}_over_floor", f"value {k}", "over floor", digits=2) for k in (1, 2, 3)),
        *(Column(f"fit_{order}_percent", f"fit, order {order}") for order in (1, 2, 3, 4)),
        Column("bandwidth_hz", "3 dB down", digits=3),
        Column("bandwidth_std_hz", "± one standard deviation", digits=1),
    ),
    "clocks": (
        *(Column("input", "test"), _at_frequency),
        Column("steady_state", "steady", "% of gain", 100.0, 2),
        Column("violations", "limits exceeded", words=lambda text: text or "none"),
    ),
}

LIBRARY = Study("library", "library/report.html", _find, LIBRARY_FIGURES, COLUMNS, asdict(RIG), _facts)
