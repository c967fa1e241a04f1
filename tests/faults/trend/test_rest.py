"""Evidence of growth against a level that rests or jumps, against runs of the whole filter."""

from dataclasses import fields

import numpy as np
import pytest

from faults.trend.kalman import JUMP_PRIOR, Settings, beliefs, settings
from faults.trend.rest import growth_evidence, jumped_share, rest_evidence
from plant.arrays import Array


def test_evidence_of_growth_is_positive_for_a_slope_and_negative_at_rest() -> None:
    grid, times, stds = settings(), np.arange(40.0), np.full(40, 0.03)
    noise = 0.03 * np.random.default_rng(3).standard_normal(40)

    def odds(values: Array) -> float:
        *_, last = beliefs(times, values, stds, grid)
        return growth_evidence(last, grid, rest_evidence(times, values, stds, grid)[-1])

    assert odds(0.02 * times + noise) > 10.0
    assert odds(noise) < 0.0
    assert odds(0.6 * (times > 30.0) + noise) < 0.0  # a jump is not growth


def rest_by_hand(times: Array, values: Array, stds: Array) -> float:
    """Return the evidence of rest from runs of the whole filter, one for each log at which the level may jump."""
    grid = settings()
    still = Settings(*(getattr(grid, each.name)[~grid.growing] for each in fields(Settings)))

    def run(part: slice) -> float:
        *_, last = beliefs(times[part], values[part], stds[part], still)
        return float(np.logaddexp.reduce(last.evidence) - np.log(len(still.slope)))

    count = len(times)
    chances = -np.expm1(-JUMP_PRIOR * np.maximum(np.diff(times), 1.0))
    jumped = [run(slice(0, k)) + float(np.log(chances[k - 1])) + run(slice(k, count)) for k in range(1, count)]
    return float(np.logaddexp.reduce([run(slice(0, count)), *jumped]) - np.log(2.0))


@pytest.mark.parametrize("jump", [0.0, 0.7])
def test_rest_is_weighed_over_each_log_at_which_the_level_may_jump(jump: float) -> None:
    rng = np.random.default_rng(8)
    times, stds = np.cumsum(rng.uniform(0.2, 2.0, 12)), rng.uniform(0.02, 0.05, 12)
    values = stds * rng.standard_normal(12) + jump * (np.arange(12) > 6)
    found = rest_evidence(times, values, stds, settings())
    for count in (1, 2, 7, 12):
        expected = rest_by_hand(times[:count], values[:count], stds[:count])
        assert found[count - 1] == pytest.approx(expected, abs=1e-9)


def test_of_many_logs_the_likeliest_jumps_are_followed() -> None:
    rng = np.random.default_rng(9)
    times, stds = np.arange(90.0), np.full(90, 0.03)
    values = stds * rng.standard_normal(90) + 0.5 * (times > 20.0)
    found = rest_evidence(times, values, stds, settings())
    assert found[-1] == pytest.approx(rest_by_hand(times, values, stds), abs=0.01)


def test_the_share_of_a_jump_is_what_it_adds_to_the_evidence() -> None:
    grid, times, stds = settings(), np.arange(4.0), np.full(4, 0.03)
    for values, least, most in ((np.array([0.0, 0.6, 0.6, 0.6]), 0.5, 1.0), (0.02 * times, 0.0, 0.02)):
        *_, last = beliefs(times, values, stds, grid)
        rest = float(rest_evidence(times, values, stds, grid)[-1])
        assert least <= jumped_share(last, grid, rest) <= most
