"""A log is split where an input is missing, so that no model is fitted to the effect of an unknown input."""

import numpy as np
import pytest

from estimation.identification.free_run.from_records import MOST_GAPS, channels_of, pieces
from estimation.identification.free_run.identify import identify_channels
from plant.arrays import Array
from plant.errors import HydrostateError, LogWarning
from plant.log.record import Record

T, N = 0.01, 3000


def binary(seed: int = 0) -> Array:
    return np.repeat(np.random.default_rng(seed).choice([-1.0, 1.0], N // 15), 15)


def slow() -> Array:
    return np.sin(2.0 * np.pi * 0.1 * T * np.arange(N))


def answered(u: Array) -> Array:
    y = np.zeros(N)
    for k in range(2, N):
        y[k] = 1.85 * y[k - 1] - 0.87 * y[k - 2] + 0.02 * u[k - 1]
    return y + 0.01 * np.random.default_rng(1).normal(size=N)


def log(u: Array, *lost: slice) -> Record:
    seen = u.copy()
    for part in lost:
        seen[part] = np.nan
    return Record(T, {"u": seen, "y": answered(u)})


def test_a_gap_bridged_by_a_line_does_not_split_the_log() -> None:
    record = log(slow(), slice(1000, 1005))
    assert pieces(record, ["u"]) == [record]


def test_a_log_is_split_at_gaps_of_a_binary_input_and_gaps_at_its_ends_are_cut_off() -> None:
    record = log(binary(), slice(0, 40), slice(1000, 1010), slice(2000, 2010), slice(2990, 3000))
    with pytest.warns(LogWarning) as said:
        parts = pieces(record, ["u"])
    assert [len(part) for part in parts] == [960, 990, 980]
    assert "the log was split there (experiments: 3," in str(said[0].message)
    assert all(np.isfinite(part["u"]).all() for part in parts)
    np.testing.assert_array_equal(parts[1]["y"], record["y"][1010:2000])


def test_an_input_logged_at_a_third_of_the_rate_has_no_gaps() -> None:
    seen = binary()
    seen[np.arange(N) % 3 > 0] = np.nan
    record = Record(T, {"u": seen, "y": answered(binary())})
    assert [len(part) for part in pieces(record.slice(0, N - 2), ["u"])] == [N - 2]


def test_a_log_is_split_into_a_limited_number_of_parts() -> None:
    lost = [slice(start, start + 10) for start in range(20, N - 20, 30)]
    with pytest.warns(LogWarning):
        parts = pieces(log(binary(), *lost), ["u"])
    assert 1 < len(parts) <= MOST_GAPS + 1


def test_outputs_after_a_gap_of_the_input_are_left_out() -> None:
    with pytest.warns(LogWarning) as said:
        data = channels_of([log(binary(), slice(1000, 1010))], ["u"], "y", split=True)
    assert {one.filename for one in said} == {__file__}  # it points at the caller
    assert [int(np.isnan(y).sum()) for y in data.y] == [0, 20]
    assert np.isnan(data.y[1][:20]).all()


def test_a_model_of_a_log_with_gaps_is_as_accurate_as_without_them() -> None:
    whole = identify_channels(channels_of([log(binary())], ["u"], "y"), order=2, delay=1).model
    with pytest.warns(LogWarning):
        data = channels_of([log(binary(), slice(1000, 1010), slice(2000, 2060))], ["u"], "y", split=True)
    found = identify_channels(data, order=2, delay=1).model
    tested = channels_of([log(binary(7))], ["u"], "y")
    off = [one.simulate(tested.u[0], tested.y[0]) - tested.y[0] for one in (whole, found)]
    assert np.std(off[1]) == pytest.approx(np.std(off[0]), rel=0.02)


def test_one_channel_as_input_and_output_is_refused() -> None:
    with pytest.raises(HydrostateError, match="input and output must be different channels, got 'u' for both"):
        channels_of([log(binary())], ["u"], "u")
    with pytest.raises(HydrostateError, match="each input must be named once, got u, u"):
        channels_of([log(binary())], ["u", "u"], "y")


def test_a_log_with_one_known_input_sample_is_not_split_and_one_with_a_constant_input_is() -> None:
    empty = Record(T, {"u": np.where(np.arange(N) == 5, 1.0, np.nan), "y": answered(binary())})
    assert pieces(empty, ["u"]) == [empty]
    level = Record(T, {"u": np.where(np.arange(N) // 10 == 100, np.nan, 3.0), "y": answered(binary())})
    with pytest.warns(LogWarning):
        assert [len(one) for one in pieces(level, ["u"])] == [1000, N - 1010]


def test_parts_shorter_than_a_two_hundredth_of_a_log_are_left_out() -> None:
    u = np.repeat(np.random.default_rng(0).choice([-1.0, 1.0], 600), 15)
    for length, kept in ((44, [8940]), (45, [45, 8940])):
        seen = u.copy()
        seen[length:60] = np.nan
        with pytest.warns(LogWarning):
            parts = pieces(Record(T, {"u": seen, "y": u}), ["u"])
        assert [len(part) for part in parts] == kept


def test_bridged_samples_of_all_parts_are_reported_in_one_warning() -> None:
    record = log(binary(), *(slice(start, start + 2) for start in range(52, N - 40, 60)))  # 49 gaps: 30 split the log
    with pytest.warns(LogWarning) as said:
        channels_of([record], ["u"], "y", split=True)
    told = [str(one.message) for one in said if "interpolated linearly" in str(one.message)]
    assert len(told) == 1
    assert "lacks 38 of 2940 samples" in told[0]


def test_a_log_sampled_more_slowly_than_the_model_is_interpolated_with_a_warning() -> None:
    record = log(binary())
    half = Record(2.0 * T, {name: record[name][::2] for name in ("u", "y")})
    with pytest.warns(LogWarning, match="interpolated from 0.02 s to 0.01 s per sample") as said:
        data = channels_of([half], ["u"], "y", T)
    assert {one.filename for one in said} == {__file__}
    assert data.y[0].size == pytest.approx(N, abs=1)
