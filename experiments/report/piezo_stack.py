"""The piezo-stack actuator's report: one HTML file that needs nothing beside it."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from markupsafe import Markup

from experiments.figures.piezo_stack import STACK_FIGURES
from experiments.report.sectioned import Section, render_sections
from experiments.report.tables import Cell, Column, html_table, number
from plant.piezo_stack_parameters import PiezoStackParameters
from plant.units import LITRE_PER_MINUTE, notes

INTRODUCTION = (
    "The piezo-stack actuator pumps oil by a stack that moves 46 micrometres, through two reeds, to a cylinder. Its "
    "paper's Table 1 and figures are lost (errata P17): below stand the numbers that its text quotes, those of this "
    "model beside them, and what is not reproduced."
)
"""The page's first paragraph."""

_PER_LITRE = 1.0 / LITRE_PER_MINUTE


def render_stack_report(
    tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes], parameters: PiezoStackParameters
) -> str:
    """Return the report as one HTML page with its figures inside.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What the study found, by the names of `hydrostate piezo-stack`.
    figures : Mapping[str, bytes]
        SVG files, by the names of `experiments.figures.piezo_stack.STACK_FIGURES`.
    parameters : PiezoStackParameters
        The actuator.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    quoted = html_table(
        tables["quoted numbers"],
        (
            Column("figure", "figure"),
            Column("claim", "claim"),
            Column("published", "published"),
            Column("ours", "ours", digits=3),
            Column("unit", "unit", words=lambda unit: "" if unit == "1" else str(unit)),
            Column("holds", "reproduced", words=lambda yes: Cell("yes", "good") if yes else Cell("no", "bad")),
        ),
        "Flows by the bench's rule: cylinder area times mean velocity over whole cycles.",
    )
    beside = {
        "figure_10": [_widths(tables["figure 10 loop widths"])],
        "design_maps": [_best(tables["best operating points"])],
    }
    sections = [
        Section("quoted", "Published numbers: beside ours", tables=(quoted,)),
        *(
            Section(name, kind.heading, figure=figures[name], caption=kind.caption, tables=beside.get(name, ()))
            for name, kind in STACK_FIGURES.items()
        ),
        Section(
            "hysteresis",
            "Hysteresis: what identifies it",
            (
                "One loop of 100 V at 0.1 Hz and 20 kHz, logged once it has closed, with 20 nm of noise. The paper's "
                "procedure measures the sum of two parameters twice and gets both wrong, and the rest cannot be solved "
                "for. Fitting all parameters together gives them back, with intervals (errata P14).",
                "Below stands what no estimate can beat. A closed loop shows all four signs of rate and hysteresis: "
                "from 200,000 samples it tells every parameter to half a percent; from 5,000 it cannot. A "
                "first loop from rest cannot tell the last four apart at any sampling: on it voltage never rises while "
                "hysteresis is negative.",
            ),
            tables=(_hysteresis(tables["hysteresis parameters"]), _loop_card(tables["what loops tell"])),
        ),
        Section(
            "identifiability",
            "Identifiability: what the sensors tell",
            (
                "Standard deviations that no estimate from 0.1 s at 20 kHz and 10 kg can beat, all quantities unknown "
                "together. The stack is the pressure sensor: its displacement tells nearly all that is told. The "
                "cylinder's position alone tells the air, and of leaks and friction thirty to three hundred times less "
                "than the stack. All this takes the model for granted: another line or reed misleads friction and "
                "leaks first, so calibrate on a healthy run.",
            ),
            tables=(_card(tables["identifiability"]),),
        ),
        Section(
            "parameters",
            "Parameters: where each comes from",
            ("Another set would fit the quoted numbers as well (errata P17).",),
            tables=(_parameter_table(parameters),),
        ),
    ]
    return render_sections("The piezo-stack actuator", "piezo-stack plant", INTRODUCTION, sections)


def _widths(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("frequency_hz", "frequency", "Hz"),
        Column("stroke_m", "stroke", "µm", 1e6),
        Column("width_percent", "width", "% of stroke", digits=3),
    )
    return html_table(frame, columns, "Loops of the free stack, 100 V peak to peak.")


def _best(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("bias_pressure_pa", "bias pressure", "MPa", 1e-6),
        Column("load_kg", "load", "kg"),
        Column("frequency_hz", "frequency", "Hz"),
        Column("voltage_v", "voltage", "V"),
        Column("flow_m3_s", "flow", "L/min", _PER_LITRE, digits=3),
        Column("stack_power_w", "stack's power", "W", digits=3),
        Column("output_power_w", "lifting power", "W", digits=3),
    )
    return html_table(frame, columns, "The setting of most flow within the limits of voltage and power, for each load.")


def _hysteresis(frame: pd.DataFrame) -> Markup:
    low, high = (pd.Series([number(value, 3) for value in frame[side].tolist()]) for side in ("low", "high"))
    columns = (
        Column("parameter", "parameter", words=lambda name: str(name).replace("_", " ")),
        Column("truth", "truth"),
        Column("printed", "as printed", digits=3),
        Column("fitted", "fitted", digits=4),
        Column("interval", "95 % interval"),
        Column("error_percent", "error", "%", digits=2),
        Column("covered", "covers", words=lambda yes: Cell("yes", "good") if yes else Cell("no", "bad")),
    )
    return html_table(frame.assign(interval=low + " to " + high), columns, "Parameters of equation 1 in SI units.")


def _loop_card(frame: pd.DataFrame) -> Markup:
    def told(value: object) -> Cell | str:
        percent = float(str(value))
        return number(percent, 2) if np.isfinite(percent) else Cell("not told", "bad")

    columns = (
        Column("loop", "loop"),
        Column("samples", "samples a cycle", words=lambda count: f"{int(str(count)):,}"),
        *(Column(name, f"{name.replace('_', ' ')} [%]", words=told) for name in frame.columns[2:].tolist()),
    )
    return html_table(
        frame, columns, "Standard deviation of each parameter at best (Cramér-Rao), 20 nm of white noise."
    )


def _card(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("frequency_hz", "drive", "Hz"),
        Column("sensors", "sensors"),
        *(Column(name, name.replace("_", " "), "%", digits=2) for name in frame.columns[2:].tolist()),
    )
    return html_table(frame, columns, "Leaks and friction in percent of a minor fault, the others of themselves.")


def _parameter_table(parameters: PiezoStackParameters) -> Markup:
    rows = [
        {
            "name": name.replace("_", " "),
            "value": number(getattr(parameters, name)),
            "unit": note.unit,
            "meaning": note.meaning,
            "source": note.source,
        }
        for name, note in notes(PiezoStackParameters).items()
    ]
    columns = tuple(Column(name, name) for name in ("name", "value", "unit", "meaning", "source"))
    return html_table(pd.DataFrame(rows), columns, "Values in SI units.")
