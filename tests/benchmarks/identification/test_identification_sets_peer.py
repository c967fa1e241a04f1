"""A peer's state that grows over the test follows the outputs; its growth is computed from the model alone."""

import numpy as np
import pytest

from benchmarks.identification.identification_sets import LOOKAHEAD_GROWTH
from benchmarks.identification.identification_sets_peer import growth, state_space_run


def test_growth_is_the_largest_pole_magnitude_to_the_power_of_the_longest_test() -> None:
    tests = [(np.zeros((n, 1)), np.zeros(n)) for n in (100, 500)]
    assert growth(np.diag([0.5, 1.02]), tests) == pytest.approx(1.02**500)
    assert growth(np.array([[0.0, 1.0], [-0.81, 0.0]]), tests) == pytest.approx(0.9**500)


def test_a_model_with_a_growing_state_follows_an_output_that_its_input_did_not_cause() -> None:
    rng = np.random.default_rng(1)
    y = 0.5 * rng.normal(size=400) + np.exp(0.02 * np.arange(400)) * 0.01
    u, b, c, d = np.zeros((400, 1)), np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1))
    left = {}
    for radius in (0.98, 1.02):
        poles = np.diag([radius, 0.5])
        left[growth(poles, [(u, y)])] = float(np.std(state_space_run(poles, b, c, d, u, y) - y) / np.std(y))
    stable, growing = sorted(left)
    assert stable < LOOKAHEAD_GROWTH < growing
    assert left[growing] < 0.2 < left[stable]
