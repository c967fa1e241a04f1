"""Any log can be read as it is, whatever its columns are called."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.any_columns import read_any


def written(path: Path, header: str, *columns: object) -> Path:
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


RAMP = np.arange(20.0)


def test_columns_are_read_in_their_own_units_and_time_is_converted_to_seconds(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "Time [ms],Valve (%),bar", 2.0 * RAMP, RAMP, RAMP**2)
    record = read_any(path, ["Valve (%)", "bar"])
    assert record.sample_time == pytest.approx(2e-3)
    assert list(record) == ["Valve (%)", "bar"]
    assert record["bar"][-1] == 361.0


def test_every_column_of_numbers_is_read_if_none_is_requested(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t_s,u,note,y\n" + "".join(f"{k},{k * k},text,{-k}\n" for k in range(15)))
    assert list(read_any(path)) == ["u", "y"]


def test_a_log_without_time_takes_the_given_sample_time_or_assumes_one_second_with_a_warning(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "u,y", RAMP % 3, RAMP % 4)
    assert read_any(path, sample_time=4.0).sample_time == 4.0
    with pytest.warns(LogWarning, match="no time column"):
        assert read_any(path).sample_time == 1.0


def test_a_column_that_may_be_the_time_is_pointed_out_unless_it_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "u,n,y", RAMP % 3, 0.1 * RAMP, RAMP**2)
    with pytest.warns(LogWarning) as said:
        read_any(path, ["u", "y"])
    hint = "column 'n' rises by about 0.1 from row to row, as a time does: if it is the time, name it and its unit, "
    assert [str(one.message).removeprefix(f"{path}: ") for one in said][1:] == [hint + "--columns 'time_s=n:s'"]
    with pytest.warns(LogWarning) as said:
        read_any(path, ["u", "n"])
    assert len(said) == 1


def test_the_column_of_time_may_be_named_with_its_unit(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    path = written(tmp_path / "a.csv", "n,y", 5.0 * RAMP, RAMP)
    record = read_any(path, ["y"], time="n:ms")
    assert record.sample_time == pytest.approx(5e-3)
    assert len(recwarn) == 0
    for time, said in (("m:ms", "'m'"), ("n:bar", "'n' cannot become time_s")):
        with pytest.raises(LogError, match=said):
            read_any(path, ["y"], time=time)
    with pytest.raises(LogError, match="a column of time or a sample time is wanted, got both: 'n:ms' and 2 s"):
        read_any(path, ["y"], time="n:ms", sample_time=2.0)


def test_a_column_that_a_log_has_twice_with_the_same_values_is_one_column(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "t_s,x,u,x", RAMP, RAMP**2, RAMP, RAMP**2)
    assert read_any(path, ["x"])["x"][-1] == 361.0


def test_a_slow_clock_is_no_slip_of_units(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    assert read_any(written(tmp_path / "a.csv", "t_s,u", 2.0 * RAMP, RAMP), ["u"]).sample_time == 2.0
    assert len(recwarn) == 0


def test_a_known_channel_in_another_unit_is_found_by_its_name(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "time_s,motor_speed_rpm", RAMP, 60.0 * RAMP)
    assert read_any(path, ["motor_speed_rad_s"])["motor_speed_rad_s"][1] == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize(
    ("name", "said"),
    [("valv", "column 'valv' is needed; the log has 't', 'valve', 'x', 'x'; did you mean 'valve'"), ("x", "2 times")],
)
def test_a_requested_column_that_is_absent_or_ambiguous_is_refused(name: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "t,valve,x,x", RAMP, RAMP, RAMP, RAMP**2)
    with pytest.raises(LogError, match=said):
        read_any(path, [name])


def test_the_refusal_of_a_partial_column_name_suggests_the_full_name(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "t,Valve Cmd [V],Pos. [mm]", RAMP, RAMP, RAMP)
    with pytest.raises(LogError, match=r"did you mean 'Valve Cmd \[V\]'"):
        read_any(path, ["valve"])


def test_a_log_without_a_column_of_numbers_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,note\n" + "".join(f"{k},text\n" for k in range(15)))
    with pytest.raises(LogError, match="a column of numbers is needed; the log has none"):
        read_any(path)


def test_dates_are_read_as_the_clock_and_refused_as_a_column_of_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = [f"2026-03-01 12:00:{k:02d},2026-03-01 13:00:{k:02d},{k}\n" for k in range(15)]
    path.write_text("time,other,y\n" + "".join(rows))
    record = read_any(path, ["y"])
    assert record.sample_time == pytest.approx(1.0)
    with pytest.raises(LogError, match="column 'other' must hold numbers"):
        read_any(path, ["other"])


def test_a_corrected_time_stamp_gives_a_warning(tmp_path: Path) -> None:
    time = RAMP.copy()
    time[7] += 0.02
    with pytest.warns(LogWarning, match="time"):
        read_any(written(tmp_path / "a.csv", "t,u", time, RAMP), ["u"])


def test_the_refusal_of_an_absent_known_channel_names_it(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "t,motor_speed_rpm", RAMP, RAMP)
    with pytest.raises(LogError, match="column 'position_m' is needed; the log has 't', 'motor_speed_rpm'"):
        read_any(path, ["position_m"])


def test_missing_samples_are_accepted_up_to_the_given_share(tmp_path: Path) -> None:
    keep = np.r_[0:8, 12:20]
    path = written(tmp_path / "a.csv", "t_s,u", RAMP[keep], RAMP[keep])
    with pytest.raises(LogError, match="time_s leaves out 4 of 20 samples, wanted at most 5 %"):
        read_any(path, ["u"])
    with pytest.raises(LogError, match="wanted at most 15 %"):
        read_any(path, ["u"], most_missing=0.15)
    with pytest.warns(LogWarning, match="u is missing in 4 of 20 samples"):
        record = read_any(path, ["u"], most_missing=0.5)
    assert np.isnan(record["u"][8:12]).all()
    empty = written(tmp_path / "b.csv", "t_s,u", RAMP, np.where(RAMP % 7 < 3, np.nan, RAMP))
    with pytest.raises(LogError, match=r"u is missing in 9 of 20 samples .*, at most 20 % may be"):
        read_any(empty, ["u"], most_missing=0.2)
    with pytest.warns(LogWarning, match="u is missing in 9 of 20"):
        assert np.isfinite(read_any(empty, ["u"], most_missing=0.5)["u"]).sum() == 11


GARBAGE = {
    "a line of text": {40: "=== pause ==="},
    "a row too short": {40: "40"},
    "a cell of text out of order": {40: "3,ERR,40"},
    "a stamp that is none": {40: "2026-01-93 00:00:40,40,40"},
}


@pytest.mark.parametrize("names", [None, ("u", "y")])
@pytest.mark.parametrize("kind", GARBAGE)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_a_row_of_garbage_is_one_missing_sample_and_shifts_no_column(
    kind: str, names: tuple[str, ...] | None, tmp_path: Path
) -> None:
    stamped = kind.startswith("a stamp")
    rows = [f"{f'2026-01-01 00:{k // 60:02}:{k % 60:02}' if stamped else k},{k},{2 * k}" for k in range(500)]
    for line, garbage in GARBAGE[kind].items():
        rows[line] = garbage
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time,u,y", *rows]) + "\n")
    record = read_any(path, names)
    assert len(record) == 500
    there = np.isfinite(record["u"]) & np.isfinite(record["y"])
    assert np.flatnonzero(~there).tolist() == [40]
    np.testing.assert_allclose(record["u"][there], record.time[there], atol=1e-6)
    np.testing.assert_allclose(record["y"][there], 2.0 * record.time[there], atol=1e-6)


def test_rows_without_a_time_are_spaced_by_the_assumed_sample_time(tmp_path: Path) -> None:
    with pytest.warns(LogWarning, match="sample time of 4 s"):
        assert read_any(written(tmp_path / "a.csv", "u,y", RAMP % 3, RAMP % 4), assumed=4.0).sample_time == 4.0
