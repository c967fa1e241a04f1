"""Velocity from sensing voltages: the paper's regression fails, and one electrode with the drive voltage works."""

import pandas as pd
import pytest

from experiments.motor_paper.sensing import (
    MODELS,
    distortion_table,
    motor_spectra,
    operating_points,
    sensing_faults,
    sensing_predictions,
    sensing_regressions,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters

MOTOR = DiaphragmMotorParameters()
WANTED, WORKING = "A3, A4, A5, as the paper wants", "A4 and drive voltage"


@pytest.fixture(scope="module")
def points() -> pd.DataFrame:
    return operating_points(MOTOR, 2024)


@pytest.fixture(scope="module")
def spectra() -> pd.DataFrame:
    return motor_spectra(MOTOR)


def test_the_variance_inflation_of_the_middle_electrodes_exceeds_1000(points: pd.DataFrame) -> None:
    table = sensing_regressions(points).set_index("regressors")
    assert table.loc[WANTED, "largest_vif"] > 1000.0
    assert table.loc[WANTED, "smallest_coefficient"] < 0.0 < table.loc[WANTED, "largest_coefficient"]
    assert table.loc[WANTED, "r_square"] < 0.9


def test_one_electrode_and_the_drive_explain_velocity(points: pd.DataFrame) -> None:
    table = sensing_regressions(points).set_index("regressors")
    assert table.loc[WORKING, "predictive_r_square"] > 0.99
    assert table.loc[WORKING, "largest_vif"] < 10.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_paper_s_regression_predicts_poorly_for_every_seed(seed: int) -> None:
    table = sensing_regressions(operating_points(MOTOR, seed)).set_index("regressors")
    assert table.loc[WANTED, "predictive_r_square"] < 0.9 < table.loc[WORKING, "predictive_r_square"]


def test_a_low_electrode_shifts_the_paper_s_regression_by_more_than_the_velocity(points: pd.DataFrame) -> None:
    table = sensing_faults(MOTOR, points).set_index("fault")
    low = table.loc["A4 reads 20 % low"]
    assert abs(low[WANTED]) > low["velocity_m_s"] > abs(low[WORKING])
    assert abs(table.loc["none", WORKING]) < 0.1 * table.loc["none", "velocity_m_s"]


def test_predictions_average_to_the_velocity(points: pd.DataFrame) -> None:
    means = sensing_predictions(points).groupby("regressors")[["velocity_m_s", "fitted_m_s"]].mean()
    assert set(means.index) == set(MODELS)
    assert means["fitted_m_s"].tolist() == pytest.approx(means["velocity_m_s"].tolist())


def test_the_middle_electrode_has_odd_harmonics_and_the_outlet_flow_even_ones(spectra: pd.DataFrame) -> None:
    rows = spectra[spectra["peak_to_peak_v"] == 200.0].set_index(["signal", "harmonic"])["relative_percent"]
    assert rows["deflection of A4 [m]", 3] > 50.0 * rows["deflection of A4 [m]", 2]
    assert rows["outlet flow [m³/s]", 2] > 1.0


def test_the_zeroth_harmonic_of_the_outlet_flow_is_the_mean_flow(spectra: pd.DataFrame) -> None:
    rows = spectra[(spectra["signal"] == "outlet flow [m³/s]") & (spectra["harmonic"] == 0)]
    means = rows.set_index("peak_to_peak_v")["amplitude"]
    assert means.is_monotonic_increasing
    assert 6e7 * float(means.iloc[2]) == pytest.approx(6e7 * 3.7934e-4 * 4.09e-3, rel=0.01)


def test_distortion_of_the_outlet_s_flow_rises_with_the_drive(spectra: pd.DataFrame) -> None:
    flow = distortion_table(spectra).set_index("signal").loc["outlet flow [m³/s]"]
    assert flow.is_monotonic_increasing
