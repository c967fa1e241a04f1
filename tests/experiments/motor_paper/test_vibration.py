"""The motor paper's linear models: their stability, their peaks, and the effect of a loop around them."""

import numpy as np
import pandas as pd
import pytest

from experiments.motor_paper.hysteresis import hysteresis_loops, hysteresis_table, impulse_table
from experiments.motor_paper.loop import loop_runs, loop_table, relay_table, spectrum_table
from experiments.motor_paper.vibration import (
    figures_7_to_9,
    fractional_table,
    margin_table,
    pole_table,
    response_table,
    tuning_table,
)
from plant.motor_paper.hysteresis_model import HysteresisParameters
from plant.motor_paper.vibration_model import VibrationParameters

MODEL, DIAPHRAGM = VibrationParameters(), HysteresisParameters()


def test_only_the_equations_with_the_printed_signs_are_unstable() -> None:
    stable = pole_table(MODEL).groupby("model")["stable"].all()
    assert stable[~stable].index.tolist() == ["equations 1 and 2, as printed"]


def test_the_nyquist_count_equals_the_number_of_unstable_closed_loop_poles() -> None:
    table = margin_table(MODEL)
    assert (table["turns"] + table["open_unstable_poles"]).tolist() == table["closed_unstable_poles"].tolist()


def test_equation_4_peaks_near_480_hz() -> None:
    rows = response_table(MODEL)
    rows = rows[rows["model"] == "equation 4, signs mended"].set_index("frequency_hz")["gain"]
    assert rows.idxmax() == pytest.approx(475.0, rel=0.01)
    assert rows.max() == pytest.approx(5.03, rel=0.01)


def test_damping_halves_the_peak_and_stiffness_moves_it() -> None:
    table = tuning_table(MODEL).set_index(["changed", "factor"])
    assert table.loc[("damping", 2.0), "peak_gain"] < 0.55 * table.loc[("damping", 1.0), "peak_gain"]
    assert table.loc[("load_stiffness", 2.0), "frequency_hz"] > table.loc[("load_stiffness", 1.0), "frequency_hz"]


def test_sampled_orders_in_figures_7_to_9_agree_with_the_exact_ones() -> None:
    last = figures_7_to_9().groupby("order").last()
    assert last["sampled_integral"].tolist() == pytest.approx(last["integral"].tolist(), rel=3e-3)
    assert last["sampled_derivative"].tolist() == pytest.approx(last["derivative"].tolist(), rel=1e-3)


def test_the_oustaloup_approximation_has_the_exact_gain() -> None:
    table = fractional_table(MODEL)
    assert (table["imitated_gain"] / table["gain"] - 1.0).abs().max() < 6e-3


def test_the_width_of_the_mended_hysteresis_loop_does_not_depend_on_frequency() -> None:
    table = hysteresis_table(hysteresis_loops(DIAPHRAGM)).groupby("law")["width_percent"]
    assert table.max()["mended"] == pytest.approx(table.min()["mended"], rel=1e-9)
    assert table.max()["mended"] == pytest.approx(10.55, abs=0.01)
    assert table.max()["printed"] > 400.0 * table.min()["printed"]


def test_the_impulse_response_dies_out() -> None:
    moved = impulse_table(DIAPHRAGM)["displacement_m_per_v_s"].abs()
    assert moved.iloc[-100:].max() < 0.2 * moved.max()


@pytest.fixture(scope="module")
def runs() -> pd.DataFrame:
    return loop_runs(MODEL, 2024)


def test_integral_action_removes_the_steady_error_and_derivative_action_settles_sooner(runs: pd.DataFrame) -> None:
    table = loop_table(runs).set_index("controller")
    assert table.loc["P", "error_percent"] > 50.0
    assert table.loc[["PI", "PID"], "error_percent"].abs().max() < 0.5
    assert table.loc["PID", "settling_time_s"] < 0.3 * table.loc["PI", "settling_time_s"]


def test_derivative_action_amplifies_noise_above_1_khz(runs: pd.DataFrame) -> None:
    table = spectrum_table(runs)
    loudest = table[table["frequency_hz"] > 1e3].groupby("controller")["amplitude_n"].max()
    assert loudest["PID"] > 3.0 * loudest["PI"]


def test_a_relay_test_finds_the_ultimate_gain_and_frequency_of_the_model() -> None:
    table = relay_table(MODEL).set_index("quantity")
    assert np.abs(table["relay"] / table["model"] - 1.0).max() < 0.03
