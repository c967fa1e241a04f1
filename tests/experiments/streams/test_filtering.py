"""Rows to a filter: the estimate and the messages if a stream breaks, or a sensor is missing."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation.eha import online
from estimation.eha.online import StreamFilterOptions
from estimation.trust.consistency import LARGEST_NIS, MISMATCH_NIS
from experiments.streams.filtering import FEWEST_ROWS, Filtering
from experiments.streams.state_file import SAVED_EVERY
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

T = 5e-3
P = EhaParameters()
SECONDS = 16.0


@pytest.fixture(scope="module")
def bench() -> Record:
    drive, rng = sine(SECONDS, T, P.rated_speed, 5.0), np.random.default_rng(5)
    return simulate(LUMPED, drive, T, P, sensors=BENCH, rng=rng)


def lines_of(record: Record, start: float = 0.0, **changes: np.ndarray) -> list[str]:
    """Return header and rows of a log; a sample that is not finite is an empty cell."""
    channels = {**{name: record[name] for name in record if "." not in name}, **changes}
    header = ",".join(["time_s", *channels]) + "\n"
    cells = zip(*channels.values(), strict=True)
    rows = [
        ",".join([f"{start + T * k:.4f}", *(f"{one:.10g}" if np.isfinite(one) else "" for one in row)]) + "\n"
        for k, row in enumerate(cells)
    ]
    return [header, *rows]


def filtered(
    lines: list[str], every: float = 1.0, form: str = "pressure", **changes: Any
) -> tuple[list[dict[str, Any]], Filtering]:
    told: list[dict[str, Any]] = []
    one = Filtering(told.append, StreamFilterOptions(P, form, "ekf"), ({}, {}), every, **changes)
    one.follow(lines)
    return told, one


def estimates(told: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [one for one in told if one["event"] == "estimate"]


def test_a_stream_with_fewer_rows_than_a_filter_starts_from_is_still_filtered(bench: Record) -> None:
    lines = lines_of(bench)[: FEWEST_ROWS // 2 + 1]
    told, one = filtered(lines)
    assert [event["event"] for event in told] == ["start", "estimate"]
    assert told[-1]["samples"] == FEWEST_ROWS // 2
    assert told[-1]["time_s"] == pytest.approx(T * (FEWEST_ROWS // 2 - 1))
    one.end("ok", "")
    assert told[-1]["message"] == f"{FEWEST_ROWS // 2} samples filtered"


def test_the_end_of_a_stream_gives_exactly_one_estimate(bench: Record) -> None:
    lines = lines_of(bench)
    for rows, times in ((401, [1.0, 2.0]), (500, [1.0, 2.0, 2.495])):
        told, _ = filtered(lines[: rows + 1])
        assert [round(one["time_s"], 3) for one in estimates(told)] == pytest.approx(times, abs=0.11)
        assert estimates(told)[-1]["samples"] == rows


def test_too_few_rows_before_a_gap_are_left_out_with_a_warning(
    bench: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    header, *rows = lines_of(bench)
    told, one = filtered([header, *rows[: FEWEST_ROWS // 2], *rows[600:1200]])
    said = capsys.readouterr().err
    assert "too few rows before a gap" in said
    assert told[0]["event"] == "start"
    assert one.filtered is not None
    assert one.filtered.taken == 600
    alone, _ = filtered([header, *rows[600:1200]])
    assert estimates(told)[-1]["values"] == pytest.approx(estimates(alone)[-1]["values"], rel=1e-9)


def test_a_sensor_without_values_is_skipped_and_has_no_innovation_statistic(bench: Record) -> None:
    position = bench["position_m"].copy()
    position[800:1400] = np.nan
    told, _ = filtered(lines_of(bench, position_m=position)[:1401])
    silent, before = estimates(told)[-1], estimates(told)[2]
    assert silent["nis"]["position_m"] is None
    assert before["nis"]["position_m"] > 0.0
    assert silent["nis"]["velocity_m_s"] > 0.0
    assert silent["std"]["position_m"] > 2.0 * before["std"]["position_m"]


def test_large_innovations_mark_an_estimate_as_overconfident_or_a_mismatch(bench: Record) -> None:
    rng = np.random.default_rng(1)
    for size, gate in ((0.0, []), (8.0, ["overconfident"]), (60.0, ["mismatch", "overconfident"])):
        noise = size * BENCH.velocity_noise * rng.normal(size=len(bench))
        noise[:800] = 0.0
        told, _ = filtered(lines_of(bench, velocity_m_s=bench["velocity_m_s"] + noise)[:1601], like=bench)
        last = estimates(told)[-1]
        assert last["gate"] == gate, (size, last["nis"])
        worst = max(last["nis"].values())
        assert ("overconfident" in gate) is (worst > LARGEST_NIS)
        assert ("mismatch" in gate) is (worst > MISMATCH_NIS)


def test_a_missing_differential_pressure_is_calculated_from_the_chamber_pressures(bench: Record) -> None:
    difference = bench["differential_pressure_pa"]
    channels = {name: bench[name] for name in bench if "." not in name}
    channels.pop("differential_pressure_pa")
    both = Record(T, {**channels, "pressure_a_pa": 2e6 + difference, "pressure_b_pa": np.full(len(bench), 2e6)})
    one, _ = filtered(lines_of(bench)[:801])
    other, _ = filtered(lines_of(both)[:801])
    found = [estimates(told)[-1]["values"] for told in (one, other)]
    assert found[0] == pytest.approx(found[1], rel=1e-6)


def test_the_state_is_saved_while_the_stream_runs(
    bench: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    times: list[float] = []
    monkeypatch.setattr(online, "save_filter", lambda _path, _asked, _filtered, last: times.append(last))
    filtered(lines_of(bench), state=tmp_path / "state.npz")
    middle, end = times
    assert SAVED_EVERY < middle < SAVED_EVERY + 0.2
    assert end == pytest.approx(SECONDS - T, abs=1e-6)


def test_a_temporarily_full_disk_does_not_end_the_filter(
    bench: Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[float] = []

    def full_at_first(*given: Any) -> None:
        asked.append(given[-1])
        if len(asked) == 1:
            raise HydrostateError("state.npz: the state cannot be written: No space left on device")

    monkeypatch.setattr(online, "save_filter", full_at_first)
    told, _ = filtered(lines_of(bench), state=tmp_path / "state.npz")
    assert len(asked) == 2
    assert estimates(told)[-1]["time_s"] > asked[0]
    assert "No space left on device" in capsys.readouterr().err


def test_a_failed_stream_saves_the_state_of_its_last_complete_piece(bench: Record, tmp_path: Path) -> None:
    state, (header, *rows) = tmp_path / "state.npz", lines_of(bench)
    with pytest.raises(LogError, match="must hold numbers"):
        filtered([header, *rows[:1000], *["x,x,0,0,0\n"] * 60], state=state)
    told, one = filtered([header, *rows[1000:1400]], state=state)
    assert told[0]["message"] == "continued"
    assert one.filtered is not None
    assert one.filtered.taken == 1400


def test_a_saved_filter_is_not_continued_without_one_of_its_channels(bench: Record, tmp_path: Path) -> None:
    state, lines = tmp_path / "state.npz", lines_of(bench)
    filtered(lines[:601], state=state)
    place = lines[0].strip().split(",").index("position_m")
    blind = [",".join(cell for k, cell in enumerate(line.strip().split(",")) if k != place) + "\n" for line in lines]
    with pytest.raises(LogError, match="the stream lacks position_m") as refused:
        filtered([blind[0], *blind[601:900]], state=state, source="bench")
    assert refused.value.source == "bench"


def test_a_rig_column_missing_from_the_stream_gives_a_warning(
    bench: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[dict[str, Any]] = []
    rig = {"pressure_a_pa": "PA:bar"}
    Filtering(told.append, StreamFilterOptions(P, "pressure", "ekf"), (rig, {}), 1.0, source="bench").follow(
        lines_of(bench)[:401]
    )
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("bench: warning: ")
    assert "PA:bar" in said
    assert estimates(told)[-1]["samples"] == 400


def test_an_incomplete_last_row_is_left_out_with_a_warning(bench: Record, capsys: pytest.CaptureFixture[str]) -> None:
    told, _ = filtered([*lines_of(bench)[:401], "2.0,1"])
    assert estimates(told)[-1]["samples"] == 400
    assert "the last row is incomplete and was left out" in capsys.readouterr().err
