"""A channel that stays at an end of its range is distinguished from one that turns there."""

import numpy as np
import pytest

from estimation.equations.stops import standing_ends

TIME = 0.01 * np.arange(2000)
RNG = np.random.default_rng(0)
NOISE = 0.003 * RNG.standard_normal(2000)


@pytest.mark.parametrize(
    ("values", "noise", "wanted"),
    [
        (np.clip(np.sin(TIME), -0.7, 0.5), 0.0, {"least": -0.7, "largest": 0.5}),
        (np.clip(np.sin(TIME), -0.7, 2.0) + NOISE, 0.003, {"least": -0.7}),
        (np.sin(TIME), 0.0, {}),
        (np.sin(5.0 * TIME) + NOISE, 0.003, {}),
        (np.sign(np.sin(TIME)), 0.0, {}),
        (RNG.standard_normal(2000), 1.0, {}),
        (np.cumsum(RNG.standard_normal(2000)), 0.0, {}),
        (np.full(2000, np.nan), 0.0, {}),
    ],
    ids=["clipped", "stopped", "sine", "noisy-sine", "square", "noise", "walk", "missing"],
)
def test_limits_are_found_at_the_ends_where_a_channel_stays(
    values: np.ndarray,  # type: ignore[type-arg]
    noise: float,
    wanted: dict[str, float],
) -> None:
    found = {one.end: one.value for one in standing_ends([values], noise)}
    assert found == {end: pytest.approx(value, abs=0.005) for end, value in wanted.items()}


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e9])
def test_the_limits_of_a_channel_do_not_depend_on_its_unit(unit: float) -> None:
    values = unit * np.clip(np.sin(TIME), -0.7, 0.5)
    ends = {(one.end, round(one.value / unit, 9)) for one in standing_ends([values], 0.0)}
    assert ends == {("least", -0.7), ("largest", 0.5)}
    # from 0.04 on, three deviations of noise are a tenth of the range and hide its ends
    assert [one.end for one in standing_ends([values], 0.039 * unit)] == ["largest"]
    assert list(standing_ends([values], 0.041 * unit)) == []


def test_the_samples_at_a_limit_and_their_share_are_returned() -> None:
    values = np.sin(TIME)
    values[values > 0.5] = 0.5
    (found,) = standing_ends([values], 0.0)
    np.testing.assert_array_equal(found.where[0], values == 0.5)
    assert found.share == pytest.approx(np.mean(values == 0.5))
