from typing import Any

import numpy as np
import pandas as pd
import pytest

import hydrostate as hs
from estimation.arrays import Array
from faults.own_classes.features import Recipe, channel_features
from plant.errors import HydrostateError


def table(values: Array, step: float = 0.01) -> pd.DataFrame:
    return pd.DataFrame({"p": values, "q": 2.0 * values + 1.0}, index=np.arange(values.size) * step)


def test_means_and_deviations_of_parts_ignore_the_order_within_a_part() -> None:
    cycles = np.random.default_rng(0).standard_normal((4, 3, 60))
    shuffled = cycles.copy()
    shuffled[:, :, :5] = cycles[:, :, 4::-1]
    one, other = (hs.features(x, bands=0) for x in (cycles, shuffled))
    pd.testing.assert_frame_equal(one, other)
    assert one.shape == (4, 3 * 28)


def test_power_is_in_the_band_of_the_tone_and_follows_its_amplitude() -> None:
    time = np.arange(1000) * 0.01
    rows = [table(size * np.sin(2.0 * np.pi * 12.0 * time)) for size in (1.0, 10.0)]
    found = hs.features(rows, parts=1, bands=[0.0, 5.0, 20.0, 50.0])
    power = found[[name for name in found if name.startswith("p power")]]
    assert power.iloc[0].idxmax() == "p power 5-20 Hz"
    assert float(power.iloc[1].max() - power.iloc[0].max()) == pytest.approx(np.log(100.0), abs=1e-3)


def test_a_long_log_is_cut_into_its_cycles() -> None:
    values = np.repeat([1.0, 2.0, 5.0], 100)
    found = hs.features(table(values), cycle=1.0, parts=2, bands=0)
    assert found["p mean 1/2"].tolist() == [1.0, 2.0, 5.0]
    assert found["q mean 2/2"].tolist() == [3.0, 5.0, 11.0]


def test_features_accept_logs_records_and_gaps() -> None:
    log = hs.simulate("normal", duration=1.0, sample_time=1e-3, seed=1)
    found = hs.features([log, log.record], channels=["position_m"], parts=4)
    np.testing.assert_array_equal(found.iloc[0], found.iloc[1])
    holed = table(np.arange(100.0))
    holed.iloc[50] = np.nan
    np.testing.assert_allclose(hs.features(holed, parts=4), hs.features(table(np.arange(100.0)), parts=4))


def test_a_constant_channel_has_finite_features() -> None:
    found = hs.features(np.concatenate([np.zeros((2, 1, 40)), np.full((2, 1, 40), 7.0)], axis=1))
    assert np.isfinite(found.to_numpy()).all()


def test_columns_of_a_run_do_not_depend_on_other_runs() -> None:
    short, long = table(np.random.default_rng(1).standard_normal(200)), table(np.arange(200.0))
    pd.testing.assert_series_equal(hs.features([short, long]).iloc[0], hs.features(short).iloc[0])


@pytest.mark.parametrize(
    ("runs", "options", "message"),
    [
        (np.zeros((4, 60)), {}, r"shape \(runs, channels, samples\) is needed"),
        (np.zeros((4, 2, 60)), {"channels": ["p"]}, "a name for each of 2 channels"),
        (np.zeros((4, 2, 60)), {"cycle": 1.0}, "without a cycle"),
        (np.zeros((4, 2, 6)), {}, "parts must lie between 1 and the samples of the shortest run, 6"),
        (np.full((1, 1, 60), np.inf), {}, "run 0 must hold finite values"),
        ([], {}, "at least one run"),
        ([table(np.arange(50.0))], {"channels": ["r"]}, "run 0 has no channel 'r', it has p, q"),
        ([table(np.arange(50.0)), table(np.arange(50.0), 0.02)], {}, "run 1 has a sample every 0.02 s"),
        ([table(np.arange(50.0))], {"cycle": 1.0}, "cycle must be as long as run 0 at most"),
        ([table(np.arange(50.0))], {"bands": [5.0, 1.0]}, "two rising frequencies"),
        ([table(np.arange(50.0))], {"bands": [5.0, 5.1]}, "the band 5 to 5.1 Hz holds no frequency"),
    ],
)
def test_invalid_runs_and_options_are_refused(runs: Any, options: dict[str, Any], message: str) -> None:
    with np.errstate(all="ignore"), pytest.raises(HydrostateError, match=message):
        hs.features(runs, **options)


def test_features_without_a_run_or_a_sample_time_are_refused() -> None:
    with pytest.raises(HydrostateError, match="features of at least one run are needed, got none"):
        channel_features(["p"], [], 1.0, Recipe())
    for wrong in (0.0, np.nan):
        with pytest.raises(HydrostateError, match="sample_time must be positive and finite"):
            channel_features(["p"], [np.ones((1, 64))], wrong, Recipe())


def bands_of(samples: int, octaves: int, sample_time: float = 0.01) -> list[str]:
    found = channel_features(
        ["p"], [np.random.default_rng(0).normal(size=(1, samples))], sample_time, Recipe(1, octaves)
    )
    return [name.removeprefix("p power ") for name in found if "power" in name]


def test_bands_are_octaves_below_the_nyquist_frequency_that_contain_spectral_lines() -> None:
    assert bands_of(200, 3) == ["6.25-12.5 Hz", "12.5-25 Hz", "25-50 Hz"]
    assert bands_of(200, 0) == []
    # 16 samples of 10 ms: spectral lines are 6.25 Hz apart, and no band edge is below half of that
    assert bands_of(16, 10) == ["3.125-6.25 Hz", "6.25-12.5 Hz", "12.5-25 Hz", "25-50 Hz"]


def test_features_are_the_moments_of_a_run_and_the_power_of_its_spectrum() -> None:
    rng = np.random.default_rng(1)
    run = 5.0 + 2.0 * rng.exponential(size=400)
    row = channel_features(["p"], [run[None]], 0.01, Recipe(2, octaves=1)).loc[0]
    left = run - run.mean()
    floor = 1e-4 * np.sqrt(np.mean(run**2))  # what counts as rounding error
    deviation = run.std() + floor
    wanted = {
        "mean 1/2": run[:200].mean(),
        "deviation 2/2": run[200:].std(),
        "skewness": np.mean(left**3) / deviation**3,
        "kurtosis": np.mean(left**4) / deviation**4,
        "crest": np.abs(left).max() / deviation,
        "log deviation": np.log(deviation),
    }
    windowed = left * (0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(400) / 399))
    lines = [np.sum(windowed * np.exp(-2j * np.pi * k * np.arange(400) / 400)) for k in range(101, 201)]
    wanted["power 25-50 Hz"] = np.log(
        np.mean(np.abs(lines) ** 2) / 400 + floor**2
    )  # lines are 0.25 Hz apart, the first above 25 Hz
    assert {name: row[f"p {name}"] for name in wanted} == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"parts": 1.5}, r"parts must be a whole number, got 1\.5"),
        ({"parts": True}, "parts must be a whole number, got True"),
        ({"bands": "octaves"}, r"bands must be a number of octaves or frequencies \[Hz\], got 'octaves'"),
        ({"bands": 0.5}, r"bands must be a number of octaves or frequencies \[Hz\], got 0\.5"),
    ],
)
def test_parts_and_bands_of_another_type_are_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        hs.features(np.ones((3, 2, 60)), **options)


def test_numbers_of_numpy_are_parts_and_bands() -> None:
    runs = np.random.default_rng(1).standard_normal((3, 2, 60))
    one, other = hs.features(runs, parts=np.int64(3), bands=np.int64(2)), hs.features(runs, parts=3, bands=2)  # type: ignore[arg-type]
    pd.testing.assert_frame_equal(one, other)
