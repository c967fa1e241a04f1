"""What `hydrostate motor-paper` does: the diaphragm-motor paper's tables, regression and linear models, checked."""

from dataclasses import asdict
from pathlib import Path

import pandas as pd
from rich.console import Console

from experiments.figures.motor_regression import REGRESSION_FIGURES
from experiments.figures.motor_sensing import SENSING_FIGURES
from experiments.figures.motor_vibration import VIBRATION_FIGURES
from experiments.figures.tables import figure_files
from experiments.report.motor_paper import render_motor_paper
from experiments.store import check_target, write_tables
from experiments.studies import (
    motor_hysteresis,
    motor_loop,
    motor_regression,
    motor_sensing,
    motor_tables,
    motor_vibration,
)
from plant.diaphragm_motor_parameters import DiaphragmMotorParameters
from plant.hysteresis_model import HysteresisParameters
from plant.vibration_model import VibrationParameters

MOTOR_PAPER_FIGURES = {**REGRESSION_FIGURES, **SENSING_FIGURES, **VIBRATION_FIGURES}
"""All figures of the study, by file name."""


def motor_paper_tables(seed: int) -> dict[str, pd.DataFrame]:
    """Return every table of the study.

    Parameters
    ----------
    seed : int
        Seed of every noise.

    Returns
    -------
    dict[str, pandas.DataFrame]
        By name.
    """
    p, diaphragm = VibrationParameters(), HysteresisParameters()
    motor = DiaphragmMotorParameters()
    points, spectra = motor_sensing.operating_points(motor, seed), motor_sensing.motor_spectra(motor)
    loops, runs = motor_hysteresis.hysteresis_loops(diaphragm), motor_loop.loop_runs(p, seed)
    return {
        "table 1": motor_tables.table_1(),
        "table 2": motor_tables.table_2(),
        "relations": motor_tables.relations(),
        "efficiency": motor_tables.efficiency_readings(),
        "table 4": motor_tables.table_4(),
        "table 5": motor_tables.table_5(),
        "published motor": motor_tables.published_motor(),
        "regression": motor_regression.anova_table(),
        "regression residuals": motor_regression.residual_table(),
        "decisions": motor_regression.decisions(),
        "circularity": motor_regression.circularity(),
        "sensing points": points,
        "sensing predictions": motor_sensing.sensing_predictions(points),
        "sensing regressions": motor_sensing.sensing_regressions(points),
        "sensing faults": motor_sensing.sensing_faults(motor, points),
        "motor spectra": spectra,
        "distortion": motor_sensing.distortion_table(spectra),
        "poles": motor_vibration.pole_table(p),
        "margins": motor_vibration.margin_table(p),
        "vibration responses": motor_vibration.response_table(p),
        "tuning": motor_vibration.tuning_table(p),
        "loop runs": runs,
        "loop": motor_loop.loop_table(runs),
        "loop spectra": motor_loop.spectrum_table(runs),
        "relay": motor_loop.relay_table(p),
        "hysteresis loops": loops,
        "hysteresis": motor_hysteresis.hysteresis_table(loops),
        "hysteresis response": motor_hysteresis.hysteresis_response(diaphragm),
        "impulse response": motor_hysteresis.impulse_table(diaphragm),
        "figures 7 to 9": motor_vibration.figures_7_to_9(),
        "fractional responses": motor_vibration.fractional_table(p),
    }


def motor_paper_command(out: Path, seed: int, console: Console) -> Path:
    """Check the paper's numbers and write tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    seed : int
        Seed of every noise.
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
    with console.status("computing the paper's numbers anew"):
        tables = motor_paper_tables(seed)
        figures = figure_files(MOTOR_PAPER_FIGURES, tables)
    files = {"report.html": render_motor_paper(tables, figures["svg"]).encode()}
    files |= {f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()}
    manifest = {
        "study": "motor-paper",
        "settings": {"seed": seed},
        "parameters": {
            "motor": asdict(DiaphragmMotorParameters()),
            "vibration": asdict(VibrationParameters()),
            "hysteresis": asdict(HysteresisParameters()),
        },
    }
    return write_tables(tables, manifest, out, files)
