"""The piezo-stack study: every table by name, and how the report shows them."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np
import pandas as pd

from experiments.page.frames import Tables, parameter_table
from experiments.page.numbers import number, pretty_unit
from experiments.page.tables import Cell, Column, Columns, interval, name_in_words, right_aligned
from experiments.papers.verdict import TONES
from experiments.piezo_stack import flow
from experiments.piezo_stack.card import identifiability_card
from experiments.piezo_stack.figures import STACK_FIGURES
from experiments.piezo_stack.hysteresis import hysteresis_table, loop_card
from experiments.piezo_stack.left_out import TURNS, figure_12_left_out
from experiments.piezo_stack.quoted import quoted_numbers
from experiments.running.progress import Track
from experiments.running.study import Study, StudyResult
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.units import LITRE_PER_MINUTE


@dataclass(frozen=True)
class StackSettings:
    """Settings of the piezo-stack study.

    Parameters
    ----------
    quick : bool
        Whether to use a small design map.
    voltage_limit_v : float
        Largest peak-to-peak voltage of the best operating points [V].
    power_limit_w : float
        Largest power of the stack at the best operating points [W].
    """

    seed: int
    quick: bool
    voltage_limit_v: float
    power_limit_w: float


def _find(settings: StackSettings, track: Track) -> StudyResult:
    wanted = {**flow.figure_points(), "design map": (flow.QUICK_GRID if settings.quick else flow.DESIGN_GRID).points()}
    points = list(dict.fromkeys(point for some in wanted.values() for point in some))
    rows = dict(zip(points, track(flow.sweep(RIG, points), len(points), description="operating points"), strict=True))
    tables = {name: pd.DataFrame([rows[point] for point in some]) for name, some in wanted.items()}
    tables["figure 10 loops"] = flow.stack_loops(RIG)
    tables["figure 10 loop widths"] = flow.loop_widths(tables["figure 10 loops"])
    tables["pump cycle"] = flow.pump_cycle(RIG, flow.OperatingPoint(50.0, flow.HIGH_VOLTAGE, flow.HIGH_BIAS, 20.0))
    tables["what limits the flow"] = flow.sensitivities(RIG)
    tables["best operating points"] = flow.best_points(
        tables["design map"], settings.voltage_limit_v, settings.power_limit_w
    )
    tables["hysteresis parameters"] = hysteresis_table(RIG, settings.seed)
    tables["what loops tell"] = loop_card(RIG)
    tables["identifiability"] = identifiability_card(replace(RIG, load_mass=10.0))
    tables["quoted numbers"] = quoted_numbers(tables)
    starts, turns = (1, 1) if settings.quick else (3, TURNS)
    tables["figure 12 left out"] = figure_12_left_out(RIG, settings.seed, starts, turns, track)
    return StudyResult(tables)


def _parameter(name: str) -> str:
    return name_in_words(name).replace(" a volt", " per volt")


def _percent_cell(percent: float) -> Cell:
    return right_aligned(number(percent, 2)) if np.isfinite(percent) else Cell("not determined", "bad")


RIG = PiezoStackParameters()

COLUMNS: Mapping[str, Columns] = {
    "quoted numbers": (
        *("where", "claim", "published", Column("ours", digits=3), "unit"),
        *("role", Column("verdict", words=lambda word: Cell(word, TONES[word])), "note"),
    ),
    "figure 12 left out": (
        "calibration",
        Column("flow_max_l_min", "largest flow", "L/min", digits=3),
        Column("flow_20kg_l_min", "flow with 20 kg", "L/min", digits=3),
        Column("best_high_hz", "best frequency at 1.0 MPa", "Hz", digits=3),
        Column("best_low_hz", "best frequency at 0.6 MPa", "Hz", digits=3),
        Column("ratio", "flow at 100 V over 140 V, predicted", "ratio", digits=3),
        Column("best_weak_hz", "best frequency at 100 V, predicted", "Hz", digits=3),
    ),
    "figure 10 loop widths": (
        "frequency_hz",
        Column("stroke_m", "stroke", "µm", 1e6),
        Column("width_percent", unit="% of stroke", digits=3),
    ),
    "best operating points": (
        *("bias_pressure_pa", "load_kg", "frequency_hz", "voltage_v"),
        Column("flow_m3_s", "flow", "L/min", 1.0 / LITRE_PER_MINUTE, 3),
        Column("stack_power_w", "stack's power", digits=3),
        Column("output_power_w", "lifting power", digits=3),
    ),
    "hysteresis parameters": (
        Column("parameter", words=_parameter),
        "truth",
        Column("printed", "as printed", digits=3),
        "fitted",
        Column("low", "95 % interval", of_row=interval("low", "high", 3)),
        Column("error_percent", digits=2),
        Column("covered", "covers"),
    ),
    "what loops tell": (
        "loop",
        Column("samples", "samples a cycle", words=lambda count: f"{count:,}"),
        lambda name: Column(name, _parameter(name), "%", words=_percent_cell),
    ),
    "identifiability": (Column("frequency_hz", "drive"), "sensors", lambda name: Column(name, unit="%", digits=2)),
    "rig": (
        Column("parameter", "name", words=_parameter),
        "value",
        Column("unit", words=pretty_unit),
        *("meaning", "source"),
    ),
}


def _facts(*_: object) -> Tables:
    return {"rig": parameter_table(RIG)}


PIEZO_STACK = Study("piezo-stack", "piezo_stack/report.html", _find, STACK_FIGURES, COLUMNS, asdict(RIG), _facts)
