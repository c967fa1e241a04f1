"""Every table of `hydrostate motor-paper`, by name: the diaphragm-motor paper's numbers computed anew."""

import pandas as pd

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
