"""What `hydrostate piezo-stack` does: the piezo-stack actuator's flow study, as a folder with a report."""

from dataclasses import asdict, replace
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import track

from experiments.figures.piezo_stack import STACK_FIGURES
from experiments.figures.tables import figure_files
from experiments.report.piezo_stack import render_stack_report
from experiments.store import check_target, write_tables
from experiments.studies.piezo_stack import (
    DESIGN_GRID,
    HIGH_BIAS,
    HIGH_VOLTAGE,
    QUICK_GRID,
    OperatingPoint,
    best_points,
    figure_points,
    loop_widths,
    pump_cycle,
    sensitivities,
    stack_loops,
    sweep,
)
from experiments.studies.piezo_stack_card import identifiability_card
from experiments.studies.piezo_stack_hysteresis import hysteresis_table, loop_card
from experiments.studies.piezo_stack_quoted import quoted_numbers
from plant.piezo_stack_parameters import PiezoStackParameters


def stack_study_command(
    out: Path, quick: bool, voltage_limit: float, power_limit: float, seed: int, console: Console
) -> Path:
    """Run the flow study and write its tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    quick : bool
        Whether the design map is a small one.
    voltage_limit : float
        Largest swing of the best operating points [V].
    power_limit : float
        Largest power of the stack at the best operating points [W].
    seed : int
        Seed of the sensor noise.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    Path
        The manifest, ``manifest.json``; the report stands beside it as ``report.html``.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    check_target(out)
    p = PiezoStackParameters()
    wanted = {**figure_points(), "design map": (QUICK_GRID if quick else DESIGN_GRID).points()}
    points = [point for some in wanted.values() for point in some]
    rows = list(track(sweep(p, points), "operating points", total=len(points), console=console))
    tables: dict[str, pd.DataFrame] = {}
    for name, some in wanted.items():
        tables[name], rows = pd.DataFrame(rows[: len(some)]), rows[len(some) :]
    tables["figure 10 loops"] = stack_loops(p)
    tables["figure 10 loop widths"] = loop_widths(tables["figure 10 loops"])
    tables["pump cycle"] = pump_cycle(p, OperatingPoint(50.0, HIGH_VOLTAGE, HIGH_BIAS, 20.0))
    tables["what limits the flow"] = sensitivities(p)
    tables["best operating points"] = best_points(tables["design map"], voltage_limit, power_limit)
    tables["hysteresis parameters"] = hysteresis_table(p, seed)
    tables["what loops tell"] = loop_card(p)
    tables["identifiability"] = identifiability_card(replace(p, load_mass=10.0))
    tables["quoted numbers"] = quoted_numbers(tables)
    settings = {"quick": quick, "voltage_limit_v": voltage_limit, "power_limit_w": power_limit, "seed": seed}
    figures = figure_files(STACK_FIGURES, tables)
    files = {"report.html": render_stack_report(tables, figures["svg"], p).encode()}
    files |= {f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()}
    manifest = {"study": "piezo-stack", "settings": settings, "parameters": asdict(p)}
    return write_tables(tables, manifest, out, files)
