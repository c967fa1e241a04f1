import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from plant.errors import LogError, LogWarning
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.units import unit_registry

RAMP = np.arange(20.0)


def moving(**columns: object) -> pd.DataFrame:
    log = {
        "time_s": 1e-3 * RAMP,
        "motor_speed_rad_s": 100.0 * np.sin(RAMP),
        "velocity_m_s": 0.03 * np.sin(RAMP),
    }
    return pd.DataFrame({**log, **columns})


def test_a_record_comes_back_from_its_frame() -> None:
    record = Record(1e-3, {"motor_speed_rad_s": np.sin(RAMP), "position_m": 0.02 * np.cos(RAMP)}, start_time=2.0)
    back = Record.from_frame(record.to_frame())
    assert back.sample_time == pytest.approx(1e-3, rel=1e-12)
    assert back.start_time == 2.0
    assert list(back) == list(record)
    for name in record:
        np.testing.assert_array_equal(back[name], record[name])


def test_a_frame_in_other_units_and_names_becomes_si() -> None:
    frame = pd.DataFrame({"time_ms": RAMP, "RPM": 600.0 * np.sin(RAMP), "POS": 3.0 * np.sin(RAMP)})
    record = Record.from_frame(frame, {"motor_speed_rad_s": "RPM:rpm", "position_m": "POS:mm"})
    np.testing.assert_allclose(record["motor_speed_rad_s"], 20.0 * np.pi * np.sin(RAMP))
    np.testing.assert_allclose(record["position_m"], 3e-3 * np.sin(RAMP))


def test_text_in_a_frame_is_refused_with_its_row() -> None:
    cells: list[object] = list(np.sin(RAMP))
    cells[6] = "abc"
    with pytest.raises(LogError, match=r"bench: column 'velocity_m_s' must hold numbers, got 'abc' in row 7"):
        Record.from_frame(moving(velocity_m_s=cells), source="bench")


def test_a_nullable_column_without_a_gap_is_accepted_and_one_with_a_gap_is_masked() -> None:
    time, speed = 1e-3 * np.arange(40.0), np.sin(np.arange(40.0))
    velocity = pd.array(3e-4 * speed, dtype="Float64")
    frame = pd.DataFrame({"time_s": time, "motor_speed_rad_s": speed, "velocity_m_s": velocity})
    assert np.isfinite(Record.from_frame(frame)["velocity_m_s"]).all()
    frame.loc[3, "velocity_m_s"] = pd.NA
    with pytest.warns(LogWarning) as caught:
        record = Record.from_frame(frame)
    masked = LogCode.SAMPLES_MASKED.note(channel="velocity_m_s", count=1, total=40, percent=2.5)
    assert [one.message.note for one in caught] == [masked]
    assert np.flatnonzero(np.isnan(record["velocity_m_s"])).tolist() == [3]


def test_dates_and_complex_numbers_in_a_frame_are_refused() -> None:
    with pytest.raises(LogError, match="must hold numbers"):
        Record.from_frame(moving(velocity_m_s=pd.date_range("2024-01-01", periods=20)))
    with pytest.raises(LogError, match="must hold numbers"):
        Record.from_frame(moving(velocity_m_s=RAMP + 1j))


def test_channels_cannot_be_changed_in_place() -> None:
    record = Record(1e-3, {"position_m": RAMP})
    with pytest.raises(ValueError, match="read-only"):
        record["position_m"][0] = 1.0
    with pytest.raises(TypeError):
        record.channels["position_m"] = RAMP  # pyright: ignore[reportIndexIssue]


def test_replace_sets_and_drops_channels_and_leaves_the_original() -> None:
    record = Record(1e-3, {"position_m": RAMP, "velocity_m_s": RAMP})
    changed = record.replace(position_m=2.0 * RAMP, velocity_m_s=None)
    assert list(changed) == ["position_m"]
    assert changed["position_m"][1] == 2.0
    assert record["position_m"][1] == 1.0


def test_slice_moves_the_start_time_and_multiplies_the_sample_time() -> None:
    part = Record(1e-3, {"position_m": RAMP}, start_time=1.0).slice(4, 15, 5)
    assert part["position_m"].tolist() == [4.0, 9.0, 14.0]
    np.testing.assert_allclose(part.time, [1.004, 1.009, 1.014])


@pytest.mark.parametrize(("start", "step"), [(-3, 1), (0, 0), (0, -1)])
def test_a_slice_from_a_negative_start_or_without_a_positive_step_is_refused(start: int, step: int) -> None:
    with pytest.raises(LogError, match="slice"):
        Record(1e-3, {"position_m": RAMP}).slice(start, None, step)


def test_annotate_adds_to_the_metadata() -> None:
    record = Record(1e-3, {"position_m": RAMP}, {"plant": "lumped"}).annotate(seed=3)
    assert dict(record.metadata) == {"plant": "lumped", "seed": 3}


def test_a_record_survives_pickling() -> None:
    record = Record(1e-3, {"position_m": RAMP}, {"plant": "lumped", "seed": 3}, 0.5)
    back = pickle.loads(pickle.dumps(record))  # noqa: S301 (our own bytes)
    assert (back.sample_time, back.start_time, dict(back.metadata)) == (
        1e-3,
        0.5,
        {"plant": "lumped", "seed": 3},
    )
    np.testing.assert_array_equal(back["position_m"], RAMP)


@pytest.mark.parametrize("sample_time", [0.0, -1e-3, np.nan, np.inf])
def test_a_record_refuses_a_sample_time_that_is_not_positive(sample_time: float) -> None:
    with pytest.raises(LogError, match="sample_time must be positive"):
        Record(sample_time, {"position_m": RAMP})


def test_a_record_refuses_channels_of_different_lengths() -> None:
    with pytest.raises(LogError, match="one length"):
        Record(1e-3, {"position_m": RAMP, "velocity_m_s": RAMP[1:]})


def test_a_missing_channel_is_named_with_those_that_are_there() -> None:
    with pytest.raises(LogError, match="'position_m' is needed; the record has velocity_m_s"):
        Record(1e-3, {"velocity_m_s": RAMP})["position_m"]


def test_writing_a_frame_and_reading_it_with_pandas_keeps_the_columns(tmp_path: Path) -> None:
    moving().to_csv(tmp_path / "log.csv", index=False)
    assert list(Record.from_frame(pd.read_csv(tmp_path / "log.csv"))) == ["motor_speed_rad_s", "velocity_m_s"]


def test_a_record_without_a_valid_sample_time_or_equally_long_channels_is_refused() -> None:
    for wrong in (0.0, np.inf, np.nan):
        with pytest.raises(LogError, match="sample_time must be positive and finite"):
            Record(wrong, {"position_m": np.zeros(3)})
    with pytest.raises(LogError, match="a record needs at least one channel, got none"):
        Record(1e-3, {})
    for other in (np.zeros(4), np.zeros((3, 1))):
        with pytest.raises(LogError, match="one-dimensional and of one length"):
            Record(1e-3, {"position_m": np.zeros(3), "velocity_m_s": other})


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((1e-3, {"a": [[1.0, 2.0], [3.0]]}), "column 'a' must be one-dimensional, got rows of several lengths"),
        ((1e-3, {"a": ["x", "y"]}), "column 'a' must hold numbers, got 'x' in row 1"),
        ((1e-3, {"a": np.array([1j, 2.0])}), "column 'a' must hold numbers, got '1j' in row 1"),
        ((1e-3, {"a": np.array(["2026-01-01"], "M8[s]")}), "column 'a' must hold numbers, got '2026-01-01"),
        ((1e-3, {"a": unit_registry().Quantity(RAMP, "mm")}), "channel 'a' must be plain numbers in SI"),
        ((1e-3, [RAMP]), "channels must be a mapping by name"),
        ((1e-3, {"a": RAMP}, 3), "metadata must be a mapping by name, got 3"),
        (("x", {"a": RAMP}), "sample_time must be positive and finite, got 'x'"),
        ((1e-3, {"a": RAMP}, {}, float("nan")), "start_time must be a finite number of seconds, got nan"),
    ],
)
def test_invalid_arguments_of_a_record_are_refused(arguments: tuple[Any, ...], said: str) -> None:
    with pytest.raises(LogError, match=re.escape(said)):
        Record(*arguments)


def test_a_record_takes_lists_and_masked_arrays_and_prints_itself_in_a_line() -> None:
    record = Record(0.01, {"a": [1, 2, 3], "b": np.ma.masked_array([1.0, 2.0, 3.0], mask=[0, 1, 0])})
    np.testing.assert_array_equal(record["b"], [1.0, np.nan, 3.0])
    assert repr(record) == "Record(0.01 s, 3 samples from 0 s: a, b)"
    with pytest.raises(LogError, match=r"whole numbers, got 0\.5, None and 1"):
        record.slice(0.5)  # type: ignore[arg-type]
    with pytest.raises(LogError, match=r"a pandas\.DataFrame is needed, got dict"):
        Record.from_frame({"a": [1.0]})  # type: ignore[arg-type]
