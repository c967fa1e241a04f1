"""A trend in the output of a plant: no pole at 1 follows it, and an integrating or slow plant keeps its pole."""

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.notes import IdentificationCode

N, SAMPLE_TIME, GAIN, SLOPE = 500, 0.01, 2.0, 0.8

pytestmark = pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")


def channels(seed: int, pole: float, slope: float, logs: int = 1) -> Channels:
    """Return logs of a first-order plant with a trend [output unit/s] and white noise on the output."""
    rng = np.random.default_rng(seed)
    u, y = list[Array](), list[Array]()
    for _ in range(logs):
        levels = 0.3 + np.repeat(rng.uniform(-1.0, 1.0, N // 10), 10)
        answer = lfilter([0.0, GAIN * (1.0 - min(pole, 0.95))], [1.0, -pole], levels)
        u.append(levels[:, None])
        y.append(answer + slope * SAMPLE_TIME * np.arange(N) + 0.02 * rng.normal(size=N))
    return channels_from(u, y, SAMPLE_TIME, ["u"], "y")


def told(found: Identified) -> bool:
    return IdentificationCode.TREND in [note.code for note in found.notes]


@pytest.mark.parametrize("logs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_trend_is_noted_and_does_not_bias_the_gain(logs: int) -> None:
    found = identify_channels(channels(0, 0.9, SLOPE, logs), order=2, delay=1)
    (note,) = (one for one in found.notes if one.code == IdentificationCode.TREND)
    assert note.data["slope"] == pytest.approx(SLOPE, rel=0.02)
    assert found.sound
    assert found.model.linear is not None
    assert found.model.linear.dc_gain == pytest.approx(GAIN, rel=0.02)
    assert found.quality.rmse == pytest.approx(0.02, rel=0.15)


def test_the_output_plotted_with_the_model_has_its_trend_removed() -> None:
    data = channels(1, 0.9, SLOPE)
    found = identify_channels(data, order=2, delay=1)
    flat = found.at_one_offset(data)
    left = flat.y[0] - found.model.simulate(flat.u[0], flat.y[0])
    assert left.std() < 0.03


@pytest.mark.parametrize(("pole", "slope"), [(1.0, 0.0), (0.998, 0.0), (0.9, 0.0), (1.0, -0.1)])
def test_no_trend_is_noted_for_an_integrating_or_slow_plant_or_one_without_trend(pole: float, slope: float) -> None:
    assert not told(identify_channels(channels(2, pole, slope), order=2, delay=1))


@pytest.mark.parametrize(("seed", "order"), [(0, None), (1, 2), (2, 2)])
def test_a_trend_too_small_to_cause_a_slow_pole_is_noted(seed: int, order: int | None) -> None:
    found = identify_channels(channels(seed, 0.9, 0.02), order=order, delay=1)
    (note,) = (one for one in found.notes if one.code == IdentificationCode.TREND)
    assert note.data["slope"] == pytest.approx(0.02, rel=0.15)
