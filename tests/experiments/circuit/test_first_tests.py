"""The first tests of section 4, on the circuit, give what Tables 2 to 4 and errata E8 imply."""

import numpy as np
import pandas as pd
import pytest

from experiments.circuit.first_tests import (
    BREAK_MEANS_V,
    UNCERTAIN_BREAK_ROWS,
    break_frequency,
    dead_time,
    dead_zone,
    first_tests,
)
from experiments.circuit.passes import in_condition
from experiments.page.frames import cell
from plant.eha.around_mean import break_frequency_about
from plant.eha.circuit_parameters import CircuitParameters
from plant.errors import HydrostateError

RIG = CircuitParameters()


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return first_tests(RIG, 1, levels_v=(2.0, 4.0, 8.0))


def of(table: pd.DataFrame, test: str) -> pd.DataFrame:
    return table[table["test"] == test].set_index("at")


def test_the_dead_zones_have_the_values_of_errata_e8(table: pd.DataFrame) -> None:
    zones = of(table, "dead zone")
    assert cell(zones, "minor_leakage", "value") == pytest.approx(1.20, abs=0.01)
    assert cell(zones, "major_leakage", "value") == pytest.approx(1.82, abs=0.01)
    assert (abs(zones["value"] - zones["expected"]) < 0.01).all()


def test_the_steady_gain_at_2_to_8_v_agrees_with_the_tables_and_rises(table: pd.DataFrame) -> None:
    gains = of(table, "steady-state gain")
    assert list(gains.index) == ["2 V", "4 V", "8 V"]
    assert (abs(gains["value"] / gains["expected"] - 1.0) < 0.01).all()
    assert (gains["value"].diff().dropna() > 0.0).all()


def test_figure_5_is_not_reproduced_since_the_break_frequency_falls_with_the_mean(table: pd.DataFrame) -> None:
    found = of(table, "break frequency")
    assert (found["published"] == 25.0).all()
    assert (found["value"].diff().dropna() < 0.0).all()
    assert found["value"].max() < 0.9 * 25.0


def test_no_parameters_within_their_uncertainty_give_figure_5(table: pd.DataFrame) -> None:
    found, measured = of(table, UNCERTAIN_BREAK_ROWS)["value"], of(table, "break frequency")["value"]
    assert measured["mean 7 V"] < found["mean 7 V, highest"] < 0.9 * 25.0
    assert 1.5 < found["mean 2 V over mean 7 V, least"] < measured["mean 2 V"] / measured["mean 7 V"] + 0.2


@pytest.mark.parametrize("mean_v", BREAK_MEANS_V)
def test_the_linearised_break_frequency_is_near_the_one_that_is_measured(table: pd.DataFrame, mean_v: float) -> None:
    measured = cell(of(table, "break frequency"), f"mean {mean_v:g} V", "value")
    linear = break_frequency_about(mean_v * RIG.motor_speed_per_volt, RIG)
    assert linear == pytest.approx(measured, rel=0.2)


def test_the_dead_time_is_longer_from_rest_than_in_motion(table: pd.DataFrame) -> None:
    at_rest, moving = (cell(of(table, "dead time"), step, "value") for step in ("0 V to 4 V", "2 V to 4 V"))
    assert 0.0 < moving < at_rest < 0.02


def test_the_low_frequency_gain_depends_less_on_the_mean_than_on_the_amplitude(table: pd.DataFrame) -> None:
    spreads = of(table, "gain spread")
    over_means, over_amplitudes, with_small_signals = (
        cell(spreads, at, "value") for at in ("means from 2 V", "amplitudes from 2 V", "amplitudes from 0.5 V")
    )
    assert over_means < over_amplitudes < with_small_signals


def test_a_voltage_inside_the_dead_zone_is_refused() -> None:
    p = in_condition(RIG, "major_leakage")
    with pytest.raises(HydrostateError, match="highest_v must move the piston, got 1 V"):
        dead_zone(p, np.random.default_rng(1), 1.0)


def test_a_step_inside_the_dead_zone_is_refused() -> None:
    p = in_condition(RIG, "major_leakage")
    with pytest.raises(HydrostateError, match="a step must move the piston"):
        dead_time(p, 0.0, 0.0, np.random.default_rng(1))


def test_a_flat_response_has_no_break_frequency() -> None:
    flat = pd.DataFrame({"frequency_hz": [1.0, 2.0], "gain": [1.0, 0.8]})
    assert np.isnan(break_frequency(flat))
