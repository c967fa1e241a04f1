"""The diaphragm motor's report: one HTML file that needs nothing beside it."""

from collections.abc import Mapping

import pandas as pd
from markupsafe import Markup

from experiments.figures.diaphragm_motor import MOTOR_FIGURES
from experiments.report.errata import linked
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Cell, Column, html_table, number
from plant.diaphragm_motor_parameters import ROWS, DiaphragmMotorParameters
from plant.units import notes

INTRODUCTION = (
    "Seven piezo diaphragms in series pump water through eight check valves to a double-acting cylinder. The paper "
    "prints sizes, materials and one flow; many of its other numbers are entries of a table of other devices. Below "
    "stands what a plant built from the physics gives: first the claims that such a motor can bear, then those that "
    "it cannot."
)
"""The page's first paragraph."""

_ML_MIN = 6e7


def render_motor_report(
    tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes], parameters: DiaphragmMotorParameters
) -> str:
    """Return the report as one HTML page with its figures inside.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What the study found, by the names of `hydrostate diaphragm-motor`.
    figures : Mapping[str, bytes]
        SVG files, by the names of `experiments.figures.diaphragm_motor.MOTOR_FIGURES`.
    parameters : DiaphragmMotorParameters
        The motor.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    beside = {"load": [_blocking(tables["load sweep"])], "control": [_control(tables["control"])]}
    sections = [
        Section("reproduced", "Reproduced: what the physics can bear", tables=(_claims(tables["reproduced"]),)),
        Section(
            "not-reproduced",
            "Not reproduced: claims that do not hold",
            ("Each of these stands in the paper, and none follows from its motor.",),
            tables=(_denied(tables["not reproduced"]),),
        ),
        *(
            Section(name, kind.heading, figure=figures[name], caption=kind.caption, tables=beside.get(name, ()))
            for name, kind in MOTOR_FIGURES.items()
        ),
        Section(
            "sensitivity",
            "Sensitivity: what sets the peak",
            (
                "Bulk modulus cannot be told from this motor: the diaphragms give some four hundred times more than "
                "the liquid. Gas content can.",
            ),
            tables=(_sensitivity(tables["sensitivity"]),),
        ),
        Section(
            "plate",
            "Diaphragm: the composite plate",
            (
                "Compliance, volume and deflection a volt follow from Table 1 by plate theory, but for the clamp's "
                "radius, which is calibrated. The first six modes without liquid stand in place of the paper's finite "
                "elements: far above the drive, so that the diaphragm's own mass plays no part.",
            ),
            tables=(_modes(tables["dry modes"]),),
        ),
        Section(
            "parameters",
            "Parameters: where each comes from",
            (
                "The set is not the only one. With another ceramic or clamp, ports and valves can be chosen so that "
                "the peak is the same; the blocking force tells them apart (errata M22).",
            ),
            tables=(_sets(tables["other sets"]), _parameter_table(parameters)),
        ),
    ]
    return render_sections("The diaphragm motor", "diaphragm-motor plant", INTRODUCTION, sections)


def _claims(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("section", "section"),
        Column("claim", "claim"),
        Column("published", "published"),
        Column("ours", "ours"),
        Column("holds", "holds", words=lambda yes: Cell("yes", "good") if yes else Cell("no", "bad")),
    )
    return html_table(frame, columns, "Flow is the pump's alone, running freely to tank; velocity the piston's.")


def _denied(frame: pd.DataFrame) -> Markup:
    plain = (Column(name, name) for name in ("section", "claim", "published", "ours"))
    columns = (*plain, Column("why", "why", words=linked))
    return html_table(frame, columns, "What the paper says, what the plant gives, and why.")


def _blocking(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("voltage_v", "voltage", "V"),
        Column("blocking_n", "blocking force", "N", digits=3),
        Column("velocity_m_s", "velocity without load", "mm/s", 1e3, digits=3),
    )
    return html_table(frame[frame["load_n"] == 0.0], columns, "At 480 Hz; the cylinder's own friction is overcome.")


def _control(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("run", "run"),
        Column("settling_s", "to 2 mm/s", "s", digits=2, words=_seconds),
        Column("rise_s", "to 3.5 mm/s", "s", digits=2, words=_seconds),
        Column("recovery_s", "after the load", "s", digits=2, words=_seconds),
        Column("velocity_m_s", "true velocity", "mm/s", 1e3, digits=3),
        Column("measured_m_s", "reported velocity", "mm/s", 1e3, digits=3),
    )
    return html_table(frame, columns, "Times until the true velocity stays within 5 %; velocities at the end.")


def _seconds(value: float) -> str:
    return "never" if value == float("inf") else f"{value:.2f}"


def _sensitivity(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("part", "part"),
        Column("change", "change"),
        Column("frequency_hz", "best frequency moves", "Hz", words=lambda value: f"{value:+.1f}"),
        Column("flow_percent", "flow changes", "%", words=lambda value: f"{value:+.1f}"),
    )
    return html_table(frame, columns, "Pump alone at 200 V.")


def _modes(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("diameters", "nodal diameters", words=str),
        Column("circles", "nodal circles", words=str),
        Column("root", "λ²"),
        Column("frequency_hz", "frequency", "Hz"),
    )
    return html_table(frame, columns, "A uniform clamped plate of the diaphragm's static stiffness and mean mass.")


def _sets(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("set", "set"),
        Column("frequency_hz", "best frequency", "Hz", digits=3),
        Column("flow_m3_s", "peak flow", "ml/min", _ML_MIN),
        Column("blocking_n", "blocking force at 480 Hz", "N", digits=3),
    )
    return html_table(
        frame,
        columns,
        "Three sets, 200 V: inertance and valve area calibrated anew to 110.11 ml/min at 480 Hz for each other plate.",
    )


def _parameter_table(parameters: DiaphragmMotorParameters) -> Markup:
    rows = [
        {
            "name": name.replace("_", " "),
            "value": _value(name, getattr(parameters, name)),
            "unit": note.unit,
            "meaning": note.meaning,
            "source": note.source,
        }
        for name, note in notes(DiaphragmMotorParameters).items()
    ]
    columns = tuple(Column(name, name) for name in ("name", "value", "unit", "meaning", "source"))
    return html_table(pd.DataFrame(rows), columns, "Values in SI units.")


def _value(name: str, value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f"{number(value[0])}, each of {ROWS[name]}"
    return number(value)
