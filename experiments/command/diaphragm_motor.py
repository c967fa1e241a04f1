"""What `hydrostate diaphragm-motor` does: the diaphragm motor's study, as a folder with a report."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import track

from experiments.figures.diaphragm_motor import MOTOR_FIGURES
from experiments.figures.tables import figure_files
from experiments.report.diaphragm_motor import render_motor_report
from experiments.store import check_target, write_tables
from experiments.studies.diaphragm_motor import (
    best_frequencies,
    dry_modes,
    other_sets,
    pump_cycle,
    reversal,
    sensitivities,
    sweep_frequency,
    sweep_load,
    sweep_voltage,
)
from experiments.studies.diaphragm_motor_control import averaged_course, control_runs
from experiments.studies.diaphragm_motor_quoted import not_reproduced, reproduced
from plant.diaphragm_motor_parameters import DiaphragmMotorParameters

STUDIES: dict[str, Callable[[DiaphragmMotorParameters], pd.DataFrame]] = {
    "frequency sweep": sweep_frequency,
    "voltage sweep": sweep_voltage,
    "load sweep": sweep_load,
    "load and frequency": best_frequencies,
    "pump cycle": pump_cycle,
    "reversal": reversal,
    "sensitivity": sensitivities,
    "other sets": other_sets,
    "averaged": averaged_course,
}
"""The tables that are simulated, by name."""


def motor_study_command(out: Path, seed: int, console: Console) -> Path:
    """Run the study and write its tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
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
    p = DiaphragmMotorParameters()
    tables = {name: study(p) for name, study in track(STUDIES.items(), "studies", console=console)}
    tables["control courses"], tables["control"] = control_runs(p, seed)
    tables["dry modes"] = dry_modes()
    tables["reproduced"] = reproduced(tables)
    tables["not reproduced"] = not_reproduced(p, tables)
    figures = figure_files(MOTOR_FIGURES, tables)
    files = {"report.html": render_motor_report(tables, figures["svg"], p).encode()}
    files |= {f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()}
    manifest = {"study": "diaphragm-motor", "settings": {"seed": seed}, "parameters": asdict(p)}
    return write_tables(tables, manifest, out, files)
