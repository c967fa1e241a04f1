"""The diaphragm-motor paper's report: what holds in its tables, its regression and its linear models.

`paper_sections`, `sensing_sections` and `vibration_sections` return sections, so that another report can hold them too.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import pandas as pd
from markupsafe import Markup

from experiments.figures.motor_regression import READING_WORDS, REGRESSION_FIGURES
from experiments.figures.motor_sensing import SENSING_FIGURES
from experiments.figures.motor_vibration import VIBRATION_FIGURES
from experiments.figures.tables import TableFigure
from experiments.report.motor_sensing import sensing_sections
from experiments.report.motor_vibration import vibration_sections
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Cell, Column, exact, fixed, html_table, yes_or_no

INTRODUCTION = (
    "The paper of the hydraulic motor with seven piezo diaphragms prints tables, a regression, and linear models with "
    "signs. Here each number is computed anew from what is printed beside it: what holds, what holds only in one "
    "reading, and what does not."
)
"""The page's first paragraph."""

MOTOR_PAPER_FIGURES: Mapping[str, TableFigure] = MappingProxyType(
    {**REGRESSION_FIGURES, **SENSING_FIGURES, **VIBRATION_FIGURES}
)
"""All figures of the report, by file name."""

Tables = Mapping[str, pd.DataFrame]


def _as_printed(value: float) -> Cell:
    return Cell(exact(float(value)), "number")


def render_motor_paper(tables: Tables, figures: Mapping[str, bytes]) -> str:
    """Return the report as one HTML page with its figures inside.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What the study found, by the names of `hydrostate motor-paper`.
    figures : Mapping[str, bytes]
        SVG files, by the names of `MOTOR_PAPER_FIGURES`.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    makers = (paper_sections, sensing_sections, vibration_sections)
    sections = [section for make in makers for section in make(tables, figures)]
    return render_sections("The diaphragm-motor paper, checked", "published numbers", INTRODUCTION, sections)


def paper_sections(tables: Tables, figures: Mapping[str, bytes]) -> Sequence[Section]:
    """Return the sections on the paper's tables and its regression.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.
    figures : Mapping[str, bytes]
        SVG files, by name.

    Returns
    -------
    sequence of Section
        Tables 1, 2, 4 and 5, and Figures 10 to 16.
    """
    regression = Section(
        "regression",
        "Regression: Figure 12 and its verdict",
        (
            "Figure 12 fits flow to deformation and velocity. All its figures come back if row 6's flow is 0.0868 "
            "and row 3's velocity 0.002585, and not as Table 2 has them (errata M24). Equations 17 and 18 want row 6's "
            "flow to be 0.0568, as in Table 2, and row 3's velocity 0.002585: that is the physical reading.",
            "The verdict: the regression is circular. Table 2's flow is computed from its deformation, voltage and "
            "frequency by equation 17 and its velocity from that flow by equation 18, so a fit of one on the others "
            "measures the table's rounding and misprints, not a motor. There is no sensing voltage in it, although its "
            "caption speaks of one. Six rows leave three degrees of freedom. By Table 3's own third rule deformation "
            "would have to be removed where Figure 12 was made. It is no model for control.",
        ),
        tables=(_anova(tables["regression"]), _decisions(tables["decisions"])),
    )
    return [
        *_table_sections(tables),
        regression,
        *(
            Section(name, kind.heading, figure=figures[name], caption=kind.caption)
            for name, kind in REGRESSION_FIGURES.items()
        ),
    ]


def _table_sections(tables: Tables) -> Sequence[Section]:
    return [
        Section(
            "table_1",
            "Table 1: the geometry",
            ("Sizes and materials; nothing of valves, ports, clamping or liquid (errata M22).",),
            tables=(
                html_table(
                    tables["table 1"],
                    (
                        Column("item", "item"),
                        Column("value", "value", words=_as_printed),
                        Column("unit", "unit"),
                        Column("remark", "remark"),
                    ),
                    "As printed, with what follows from it.",
                ),
            ),
        ),
        Section(
            "table_2",
            "Table 2: which equations it obeys",
            (
                "Flow and velocity follow from the other columns by equations 17 and 18, to three digits or more, in "
                "one reading only: h₃₁ is deformation over sensing voltage (equation 15 turned "
                "round), √5 although there are seven chambers, a factor 1000 for the units, row 1's diameter from its "
                "area (26.10 mm, printed 26.17), row 6's flow 0.0568 and row 3's velocity 0.002585 (errata M17, M18, "
                "M23). Equation 14 holds for no one ceramic.",
            ),
            tables=(_relations(tables["relations"]), _rows(tables["table 2"]), _efficiency(tables["efficiency"])),
        ),
        Section(
            "table_4",
            "Table 4: its errors",
            (
                "All five errors come back as theory less flow meter, over flow meter. Theory is a 38 mm piston whose "
                "displacement is in micrometres; row 1's should be 25.11. At 1 to 5 Hz it is a piston pump, not this "
                "motor (errata M29).",
            ),
            tables=(_flow(tables["table 4"]),),
        ),
        Section(
            "table_5",
            "Table 5: the actuators",
            ("The proposed actuator's velocity and force do not belong to its flow (errata M26).",),
            tables=(_actuators(tables["table 5"]), _claims(tables["published motor"])),
        ),
    ]


def _anova(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("quantity", "quantity", words=lambda name: str(name).replace("_", " ")),
        Column("published", "published", digits=9),
        *(Column(name, words, digits=9) for name, words in READING_WORDS.items()),
        Column("relative_difference", "relative difference", digits=2),
    )
    return html_table(
        frame,
        columns,
        "Analysis of variance and coefficients: published, in three readings, and how far Figure 12's is off.",
    )


def _decisions(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("reading", "reading", words=lambda name: READING_WORDS[str(name)]),
        Column("rule", "rule"),
        Column("quantity", "quantity"),
        Column("value", "value"),
        Column("limit", "limit"),
        Column("met", "met", words=yes_or_no),
        Column("decision", "decision"),
    )
    return html_table(frame, columns, "Table 3's rules, applied.")


def _relations(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("relation", "relation"),
        Column("constant", "constant (median)"),
        Column("worst_percent", "furthest off", "%", words=lambda value: Cell(fixed(value, 2), "number")),
        Column("worst_row", "in row", digits=1),
        Column("holds", "holds within 0.5 %", words=yes_or_no),
    )
    return html_table(frame, columns, "Relations between Table 2's columns, physical reading.")


def _rows(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("row", "row", digits=1),
        Column("area_ratio", "area over π d²/4"),
        Column("displacement_ratio", "column 5 over column 4"),
        Column("d31_pm_v", "d₃₁ by equation 14", "pm/V", digits=3),
        Column("calibration_v_um", "h₃₁ by equation 15", "V/µm", digits=3),
        Column("efficiency", "efficiency by 17"),
        Column("piston_area_cm2", "piston by 18", "cm²", digits=5),
        Column("force_ratio", "Table 5's force over Table 2's", digits=3),
    )
    return html_table(frame, columns, "What each row implies.")


def _efficiency(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("reading", "reading of equation 17"),
        Column("mean", "mean efficiency"),
        Column("variation_percent", "variation over rows", "%", digits=2),
    )
    return html_table(frame, columns, "The first reading, and the same with one part read otherwise.")


def _flow(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("frequency_hz", "frequency", "Hz", digits=2),
        Column("pumping_displacement_mm", "displacement", "printed mm"),
        Column("theoretical_flow_ml_per_min", "theory", "mL/min", digits=5),
        Column("theory_ml_per_min", "theory anew", "mL/min", digits=5),
        Column("flowmeter_ml_per_min", "flow meter", "mL/min"),
        Column("error_percent", "error, published", "%", digits=3),
        Column("error_by_flowmeter_percent", "by the flow meter", "%", digits=3),
        Column("error_by_theory_percent", "by theory", "%", digits=3),
    )
    return html_table(frame, columns, "Table 4 with theory and errors computed anew.")


def _actuators(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("actuator", "actuator"),
        Column("voltage_vpp", "voltage", "V", words=_as_printed),
        Column("frequency_hz", "frequency", "Hz", words=_as_printed),
        Column("no_load_velocity_mm_per_s", "velocity without load", "mm/s", words=_as_printed),
        Column("blocking_force_n", "blocking force", "N", words=_as_printed),
        Column("most_power_w", "most power", "W", digits=3),
    )
    return html_table(frame, columns, "As printed; power is a quarter of velocity times force, on a straight line.")


def _claims(frame: pd.DataFrame) -> Markup:
    columns = (Column("claim", "what follows"), Column("value", "value", digits=3), Column("unit", "unit"))
    return html_table(frame, columns, "From 110.11 mL/min, 168.1 mm/s and 141 N.")
