"""Figures 5 to 7, 10 and 11 come out of the circuit: linear around a mean, dead at small signals, second order."""

import numpy as np
import pandas as pd
import pytest

from experiments.studies.circuit_experiments import (
    AMPLITUDE_V,
    CIRCUIT_FORMS,
    bulk_modulus_on_circuit,
    etfe_over_amplitudes,
    etfe_over_means,
    low_frequency_gains,
    order_study,
    prbs_around,
    validation_input,
)
from experiments.studies.settings import StudySettings, quick_settings
from plant.circuit_parameters import CircuitParameters
from plant.errors import DriveError
from plant.signals import STEPS

RIG = CircuitParameters()
SEED = 1


def spread(gains: pd.Series) -> float:
    return float(gains.max() / gains.min())


@pytest.fixture(scope="module")
def means() -> pd.DataFrame:
    return etfe_over_means(RIG, SEED, means_v=(0.0, 2.0, 4.0, 7.0))


@pytest.fixture(scope="module")
def amplitudes() -> pd.DataFrame:
    return etfe_over_amplitudes(RIG, SEED)


@pytest.fixture(scope="module")
def estimates() -> pd.DataFrame:
    return bulk_modulus_on_circuit(RIG, quick_settings(SEED), ("minor_leakage", "minor_friction"))


def test_low_frequency_gains_agree_within_a_seventh_over_means_above_the_dead_zone(means: pd.DataFrame) -> None:
    gains = low_frequency_gains(means, "mean_v")
    assert spread(gains[gains.index > 0.0]) < 1.15
    assert gains[0.0] < gains[2.0] / 3.0


def test_the_gain_at_ten_hertz_falls_as_the_mean_rises(means: pd.DataFrame) -> None:
    moving = means[(means["mean_v"] > 0.0) & (means["frequency_hz"] == 10.0)]
    assert len(moving) == 3
    assert (moving["gain"].diff().dropna() < 0.0).all()


def test_a_moving_piston_is_explained_by_its_input(means: pd.DataFrame) -> None:
    moving = means[(means["mean_v"] > 0.0) & (means["frequency_hz"] <= 10.0)]
    assert moving["coherence"].min() > 0.9


def test_gains_agree_within_a_factor_of_two_from_2_v_of_amplitude_and_fall_apart_below_1_v(
    amplitudes: pd.DataFrame,
) -> None:
    gains = low_frequency_gains(amplitudes, "amplitude_v")
    assert spread(gains[gains.index >= 2.0]) < 2.0
    assert gains[0.5] < gains[2.0] / 10.0


def test_under_leakage_the_dead_zone_takes_every_amplitude_below_it() -> None:
    table = etfe_over_amplitudes(RIG, SEED, "minor_leakage", (0.5, 1.0, 4.0))
    gains = low_frequency_gains(table, "amplitude_v")
    assert (gains[gains.index < 1.2] < gains[4.0] / 50.0).all()


def test_around_a_mean_the_amplitude_does_not_matter() -> None:
    table = etfe_over_amplitudes(RIG, SEED, amplitudes_v=(0.5, 2.0), mean_v=4.0)
    assert spread(low_frequency_gains(table, "amplitude_v")) < 1.1


def test_a_mean_past_the_motors_limit_is_refused() -> None:
    with pytest.raises(DriveError, match="motor speed must stay within"):
        prbs_around(RIG, 8.0, AMPLITUDE_V, np.random.default_rng(SEED))


def test_a_test_depends_on_its_seed_alone() -> None:
    one, same, other = (
        prbs_around(RIG, 4.0, 1.0, np.random.default_rng(seed), 4.0)["velocity_m_s"] for seed in (1, 1, 2)
    )
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_the_circuit_is_second_order_with_minor_higher_dynamics() -> None:
    table = order_study(RIG, SEED)
    values, floor = table["projected"], table["projected_floor"]
    assert (table["suggested_order"] == 2).all()
    assert values[1] > floor[1]
    assert values[2] < floor[2]
    assert values[2] < 0.02 * values[0]


def test_the_validation_input_is_nine_steps_that_turn_round() -> None:
    table = validation_input(RIG, StudySettings())
    volts = table["motor_voltage_v"].to_numpy()
    steps = volts[np.concatenate([[True], np.diff(volts) != 0.0])]
    assert len(steps) == STEPS
    assert np.all(steps[1:] * steps[:-1] < 0.0)
    assert np.all((np.abs(steps) >= 2.5) & (np.abs(steps) <= 4.0))


@pytest.mark.parametrize(("form", "lowest", "highest"), [("flow", -5.0, 1.0), ("pressure", -7.0, -1.0)])
def test_the_lumped_forms_agree_from_every_start_and_miss_by_a_few_percent(
    estimates: pd.DataFrame, form: str, lowest: float, highest: float
) -> None:
    found = estimates[estimates["form"] == form]
    assert len(found) == 4
    assert (found["outcome"] == "ok").all()
    assert found["error_percent"].between(lowest, highest).all()
    assert found.groupby("condition")["value_pa"].agg(spread).max() < 1.001


def test_the_published_form_does_not_find_it_on_the_circuit(estimates: pd.DataFrame) -> None:
    found = estimates[estimates["form"] == "acceleration"]
    leaking, stiff = (found[found["condition"] == name] for name in ("minor_leakage", "minor_friction"))
    assert len(leaking) == len(stiff) == 2
    assert (leaking["outcome"] == "not_observable").all()
    assert leaking["value_pa"].isna().all()
    assert (stiff["error_percent"] < -90.0).all()


def test_the_truth_stands_beside_every_estimate(estimates: pd.DataFrame) -> None:
    assert set(estimates["form"]) == {experiment.form for experiment in CIRCUIT_FORMS}
    assert (estimates["truth_pa"] == RIG.bulk_modulus).all()
