"""Every table of `hydrostate motor-paper`, by name: the diaphragm-motor paper's numbers recomputed."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

import pandas as pd

from experiments.motor_paper import hysteresis, loop, regression, sensing, tables, vibration
from experiments.motor_paper.columns import COLUMNS
from experiments.motor_paper.regression_figure import REGRESSION_FIGURES
from experiments.motor_paper.sensing_figure import SENSING_FIGURES
from experiments.motor_paper.vibration_figure import VIBRATION_FIGURES
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables
from experiments.running.progress import Track
from experiments.running.study import SeedSettings, Study, StudyResult
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.motor_paper.hysteresis_model import HysteresisParameters
from plant.motor_paper.vibration_model import VibrationParameters

MOTOR, LINEAR, DIAPHRAGM = DiaphragmMotorParameters(), VibrationParameters(), HysteresisParameters()

TABLES: Mapping[str, Callable[[Tables, int], pd.DataFrame]] = {
    "table 1": lambda _, __: tables.table_1(),
    "table 2": lambda _, __: tables.table_2(),
    "relations": lambda _, __: tables.relations(),
    "efficiency": lambda _, __: tables.efficiency_readings(),
    "table 4": lambda _, __: tables.table_4(),
    "table 5": lambda _, __: tables.table_5(),
    "published motor": lambda _, __: tables.published_motor(),
    "regression": lambda _, __: regression.anova_table(),
    "regression limits": lambda _, __: regression.limits_table(),
    "regression residuals": lambda _, __: regression.residual_table(),
    "decisions": lambda _, __: regression.decisions(),
    "circularity": lambda _, __: regression.circularity(),
    "sensing points": lambda _, seed: sensing.operating_points(MOTOR, seed),
    "sensing predictions": lambda made, _: sensing.sensing_predictions(made["sensing points"]),
    "sensing regressions": lambda made, _: sensing.sensing_regressions(made["sensing points"]),
    "sensing faults": lambda made, _: sensing.sensing_faults(MOTOR, made["sensing points"]),
    "motor spectra": lambda _, __: sensing.motor_spectra(MOTOR),
    "distortion": lambda made, _: sensing.distortion_table(made["motor spectra"]),
    "poles": lambda _, __: vibration.pole_table(LINEAR),
    "margins": lambda _, __: vibration.margin_table(LINEAR),
    "vibration responses": lambda _, __: vibration.response_table(LINEAR),
    "tuning": lambda _, __: vibration.tuning_table(LINEAR),
    "loop runs": lambda _, seed: loop.loop_runs(LINEAR, seed),
    "loop": lambda made, _: loop.loop_table(made["loop runs"]),
    "loop spectra": lambda made, _: loop.spectrum_table(made["loop runs"]),
    "relay": lambda _, __: loop.relay_table(LINEAR),
    "hysteresis loops": lambda _, __: hysteresis.hysteresis_loops(DIAPHRAGM),
    "hysteresis": lambda made, _: hysteresis.hysteresis_table(made["hysteresis loops"]),
    "hysteresis response": lambda _, __: hysteresis.hysteresis_response(DIAPHRAGM),
    "impulse response": lambda _, __: hysteresis.impulse_table(DIAPHRAGM),
    "figures 7 to 9": lambda _, __: vibration.figures_7_to_9(),
    "fractional responses": lambda _, __: vibration.fractional_table(LINEAR),
}


def _find(settings: SeedSettings, track: Track) -> StudyResult:
    made: dict[str, pd.DataFrame] = {}
    for name, make in track(TABLES.items(), description="computing the paper's numbers anew"):
        made[name] = make(made, settings.seed)
    return StudyResult(made)


MOTOR_PAPER_FIGURES: Drawings = {**REGRESSION_FIGURES, **SENSING_FIGURES, **VIBRATION_FIGURES}

PARAMETERS = {"motor": asdict(MOTOR), "vibration": asdict(LINEAR), "hysteresis": asdict(DIAPHRAGM)}

MOTOR_PAPER = Study("motor-paper", "motor_paper/report.html", _find, MOTOR_PAPER_FIGURES, COLUMNS, PARAMETERS)
