"""Behaviour of Table 6's models and of ours within the first sample of a step."""

import numpy as np
import pytest

from estimation.identification.model.linear_model import LinearModel
from experiments.library.tables import published_model
from experiments.nine_conditions.transfer_functions import filtering_table, jump_ratio, printed_gain_interval
from faults.conditions import CONDITIONS


@pytest.mark.parametrize("b", [[0.5, 0.1, -0.3], [0.0, 0.2, 0.1], [0.3, 0.0, 0.0]])
def test_the_jump_ratio_is_the_first_sample_of_a_step_response_over_its_final_value(b: list[float]) -> None:
    model = LinearModel(np.array(b), np.array([1.0, -1.5, 0.6]), 1e-3, "motor_speed_rad_s", "velocity_m_s")
    step = model.simulate(np.ones(500))
    assert jump_ratio(model) == pytest.approx(step[0] / step[-1], abs=1e-12)


def test_eight_of_the_nine_models_of_table_6_jump_and_one_does_not() -> None:
    jumps = {name: jump_ratio(published_model(name)) for name in CONDITIONS}
    assert abs(jumps.pop("minor_leakage")) < 0.02
    assert all(0.79 < jump < 1.93 for jump in jumps.values())


def test_the_gain_interval_from_four_printed_digits_contains_the_printed_gain() -> None:
    low, high = printed_gain_interval(["0.2000", "0.1000", "0.1000", "-0.5000", "0.1000"])
    assert low < 0.4 / 0.6 < high
    assert high - low == pytest.approx(2.0 * 0.4 / 0.6 * (3 * 5e-5 / 0.4 + 2 * 5e-5 / 0.6), rel=1e-3)


def test_filtering_only_the_output_makes_a_plant_without_a_jump_appear_to_jump() -> None:
    table = filtering_table(np.random.default_rng(0), 20.0).set_index("variant")["jump_ratio"]
    assert table["truth"] == 0.0
    assert abs(table["output only, as in section 4"]) > 5.0 * abs(table["both filtered"])
