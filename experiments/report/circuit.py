"""The circuit's report: one HTML file that needs nothing beside it."""

from collections.abc import Callable, Mapping

import pandas as pd
from markupsafe import Markup

from experiments.figures.circuit import CIRCUIT_FIGURES
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import MISSING, Cell, Column, html_table, number

TABLES_OF: Mapping[str, tuple[str, ...]] = {
    "figures_3_and_4": ("figure 3 velocity against leakage throttle", "figure 4 pressure against friction throttle"),
    "figures_8_and_9": ("figure 8 leakage flow refitted", "figure 9 friction refitted"),
}
"""Which tables stand under which figure."""

INTRODUCTION = (
    "The circuit plant is the whole actuator of the paper's Figures 1 and 2: two chambers, gear pump, accumulator, "
    "check valves, relief valve, two throttles and seals that give before they slide. No filter here assumes it. "
    "Below, the experiments of Figures 3 to 11 are repeated on it, seen through the rig's sensors, each beside its "
    "published counterpart where one is printed."
)
"""The page's first paragraph."""


def render_circuit_report(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes], seed: int) -> str:
    """Return the circuit's report as one HTML page with its figures inside.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What the experiments found, by the names of `hydrostate circuit`.
    figures : Mapping[str, bytes]
        SVG files, by the names of `experiments.figures.circuit.CIRCUIT_FIGURES`.
    seed : int
        Seed of the run.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    first = html_table(
        tables["section 4 first tests"],
        (
            Column("test", "test"),
            Column("at", "at"),
            Column("value", "circuit", digits=4),
            Column("expected", "implied by Tables 2 to 4", digits=4),
            Column("published", "published", digits=4),
            Column("unit", "unit"),
        ),
        "Section 4's first tests, as a user of the rig would run them.",
    )
    sections = [
        Section("first-tests", "First tests", tables=(first,)),
        *(
            Section(
                name,
                kind.heading,
                figure=figures[name],
                caption=kind.caption,
                tables=[_TABLES[table](tables[table]) for table in TABLES_OF.get(name, ())],
            )
            for name, kind in CIRCUIT_FIGURES.items()
        ),
    ]
    return render_sections(
        "The paper's experiments on the circuit plant", f"circuit plant, seed {seed}", INTRODUCTION, sections
    )


def _percent_table(
    axis: str, header: str, quantity: str, unit: str, scale: float, caption: str
) -> Callable[[pd.DataFrame], Markup]:
    def table(frame: pd.DataFrame) -> Markup:
        columns = (
            Column(axis, header, "V"),
            Column(quantity, "settles at", unit, scale),
            Column("percent_of_normal", "circuit", "% of normal", digits=3),
            Column("published_percent", "published", "% of normal", digits=3),
        )
        return html_table(frame, columns, caption)

    return table


def _refit_table(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("level", "level"),
        Column("coefficient", "coefficient", words=lambda name: str(name).replace("_", " ")),
        Column("published", "published"),
        Column("went_in", "went in"),
        Column("refitted", "refitted"),
        Column("interval", "95 % interval"),
        Column("covered", "covers", words=lambda yes: Cell("yes", "good") if yes else Cell("no", "bad")),
    )
    low, high = (frame[side].map(number) for side in ("low", "high"))
    return html_table(frame.assign(interval=low + f" {MISSING} " + high), columns, "Coefficients in SI units.")


_TABLES = {
    "figure 3 velocity against leakage throttle": _percent_table(
        "throttle_a_v", "throttle A", "velocity_m_s", "mm/s", 1e3, "Velocity at 4 V of motor, throttle B open."
    ),
    "figure 4 pressure against friction throttle": _percent_table(
        "throttle_b_v",
        "throttle B",
        "differential_pressure_pa",
        "MPa",
        1e-6,
        "Differential pressure at 4 V of motor, throttle A shut.",
    ),
    "figure 8 leakage flow refitted": _refit_table,
    "figure 9 friction refitted": _refit_table,
}
