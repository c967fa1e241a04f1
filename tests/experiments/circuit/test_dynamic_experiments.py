"""The circuit shows figures 5 to 7, 10 and 11: linear around a mean, a dead zone at small signals, second order."""

import numpy as np
import pandas as pd
import pytest

from experiments.circuit.dynamic_experiments import (
    AMPLITUDE_INPUTS,
    AMPLITUDE_V,
    CIRCUIT_FORMS,
    LAG_TIME,
    TEST_TIME,
    bulk_modulus_on_circuit,
    frequency_responses,
    low_frequency_gains,
    order_study,
    prbs_around,
    validation_input,
)
from experiments.nine_conditions.settings import StudySettings, quick_settings
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import STEPS
from plant.eha.steady_state import steady_state
from plant.errors import DriveError

RIG = CircuitParameters()
SEED = 1


def spread(gains: pd.Series) -> float:
    return float(gains.max() / gains.min())


@pytest.fixture(scope="module")
def means() -> pd.DataFrame:
    return frequency_responses(RIG, SEED, [(mean, AMPLITUDE_V) for mean in (0.0, 2.0, 4.0, 7.0)])


@pytest.fixture(scope="module")
def amplitudes() -> pd.DataFrame:
    return frequency_responses(RIG, SEED, AMPLITUDE_INPUTS)


@pytest.fixture(scope="module")
def estimates() -> pd.DataFrame:
    return bulk_modulus_on_circuit(RIG, quick_settings(SEED), ("minor_leakage",))


@pytest.mark.parametrize("mean", [2.0, 4.0])
def test_around_a_mean_the_low_frequency_gain_is_the_slope_of_the_steady_state(
    means: pd.DataFrame, mean: float
) -> None:
    """A lag lowers the gain by the cosine of its phase; the coherence gives the uncertainty of an estimate.

    At 7 V the response falls within the 2 Hz over which the estimate averages.
    """
    lowest = means[means["mean_v"] == mean].iloc[0]
    above, below = (steady_state((mean + side) * RIG.motor_speed_per_volt, RIG)[0] for side in (1.0, -1.0))
    slope = (above - below) / (2.0 * RIG.motor_speed_per_volt)
    expected = slope * np.cos(np.radians(lowest["phase_deg"]))
    windows = TEST_TIME / LAG_TIME
    deviation = np.sqrt((1.0 - lowest["coherence"]) / (2.0 * lowest["coherence"] * windows))
    assert abs(lowest["gain"] / expected - 1.0) < 3.0 * deviation


def test_with_a_zero_mean_the_dead_zone_lowers_the_gain(means: pd.DataFrame) -> None:
    at_rest = means[means["mean_v"] == 0.0].iloc[0]
    dead = RIG.flow_bias + RIG.leakage_coefficient * RIG.friction_coulomb / RIG.piston_area
    left = 1.0 - dead / (RIG.pump_displacement * AMPLITUDE_V * RIG.motor_speed_per_volt)
    assert at_rest["gain"] < left * RIG.pump_displacement / RIG.piston_area


def test_the_gain_at_ten_hertz_falls_as_the_mean_rises(means: pd.DataFrame) -> None:
    moving = means[(means["mean_v"] > 0.0) & (means["frequency_hz"] == 10.0)]
    assert len(moving) == 3
    assert (moving["gain"].diff().dropna() < 0.0).all()


def test_the_coherence_of_a_moving_piston_is_high(means: pd.DataFrame) -> None:
    moving = means[(means["mean_v"] > 0.0) & (means["frequency_hz"] <= 10.0)]
    assert moving["coherence"].min() > 0.9


def test_the_gain_rises_with_the_amplitude_towards_that_of_the_steady_state(amplitudes: pd.DataFrame) -> None:
    gains = low_frequency_gains(amplitudes, "amplitude_v")
    speeds = gains.index.to_numpy() * RIG.motor_speed_per_volt
    shares = gains.to_numpy() * speeds / np.array([steady_state(speed, RIG)[0] for speed in speeds])
    assert np.all(np.diff(shares) > 0.0)
    assert np.all(shares < 1.0)


def test_under_leakage_amplitudes_within_the_dead_zone_hardly_move_the_piston() -> None:
    table = frequency_responses(RIG, SEED, [(0.0, v) for v in (0.5, 1.0, 4.0)], "minor_leakage")
    gains = low_frequency_gains(table, "amplitude_v")
    assert (gains[gains.index < 1.2] < gains[4.0] / 50.0).all()


def test_around_a_mean_the_amplitude_does_not_matter() -> None:
    table = frequency_responses(RIG, SEED, [(4.0, 0.5), (4.0, 2.0)])
    assert spread(low_frequency_gains(table, "amplitude_v")) < 1.1


def test_a_mean_past_the_motors_limit_is_refused() -> None:
    with pytest.raises(DriveError, match="motor speed must stay within"):
        prbs_around(RIG, 8.0, AMPLITUDE_V, np.random.default_rng(SEED))


def test_a_prbs_test_depends_on_its_seed_alone() -> None:
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


def test_the_validation_input_has_nine_steps_of_alternating_sign() -> None:
    table = validation_input(RIG, StudySettings())
    volts = table["motor_voltage_v"].to_numpy()
    steps = volts[np.concatenate([[True], np.diff(volts) != 0.0])]
    assert len(steps) == STEPS
    assert np.all(steps[1:] * steps[:-1] < 0.0)
    assert np.all((np.abs(steps) >= 2.5) & (np.abs(steps) <= 4.0))


@pytest.mark.slow
def test_the_flow_form_finds_bulk_modulus_from_every_first_guess(estimates: pd.DataFrame) -> None:
    found = estimates[estimates["form"] == "flow"]
    assert len(found) == 2
    assert (found["outcome"] == "ok").all()
    assert (found["error_percent"].abs() < 0.5).all()
    assert found.groupby("condition")["value_pa"].agg(spread).max() < 1.001


def test_the_interval_of_the_pressure_form_covers_its_error_on_the_circuit(estimates: pd.DataFrame) -> None:
    found = estimates[estimates["form"] == "pressure"]
    assert len(found) == 2
    assert (found["outcome"] == "ok").all()
    assert found["covered"].all()
    assert (found["error_percent"] < 0.0).all()


def test_the_published_form_does_not_observe_bulk_modulus_on_the_circuit(estimates: pd.DataFrame) -> None:
    found = estimates[estimates["form"] == "acceleration"]
    assert len(found) == 2
    assert (found["outcome"] == "not_observable").all()
    assert found["value_pa"].isna().all()
    assert (found["bound_percent"] > 20.0).all()
    assert not found["gate_passed"].any()


def test_every_estimate_of_bulk_modulus_is_listed_with_its_true_value(estimates: pd.DataFrame) -> None:
    assert set(estimates["form"]) == {experiment.form for experiment in CIRCUIT_FORMS}
    assert (estimates["truth_pa"] == RIG.bulk_modulus).all()
