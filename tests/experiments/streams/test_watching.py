"""Rows to a watch: the effect of a broken, late, slow or restarted stream is reported, and limited to that."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.streams import watching
from experiments.streams.rows import warn_of_lost_batches
from experiments.streams.state_file import SAVED_EVERY
from experiments.streams.watch_events import WatchEvents
from experiments.streams.watching import WatchSettings, watch_rows
from faults.watch import watch as engine
from faults.watch.saved import load_state
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.errors import HydrostateError, LogError
from plant.log.stream.source import BatchCounts

T = 0.01
SPEED = 50.0
"""Motor speed, in both directions [rad/s]."""

HEADER = "time_s,motor_speed_rad_s,velocity_m_s"
LEARNT = engine.LEAST_LEARNING
"""Least time for which a watch learns [s]."""


def rows(start: float, seconds: float, share: float = 1.0, seed: int = 0, T: float = T) -> list[str]:
    """Return rows of an actuator whose piston moves by a share of the pump's delivery and may reverse every 0.1 s."""
    p, rng = EhaParameters(), np.random.default_rng(seed)
    count = round(seconds / T)
    speed = SPEED * rng.choice((-1.0, 1.0), count // 10 + 1).repeat(10)[:count]
    velocity = share * 0.9 * p.pump_displacement * speed / p.piston_area
    told = zip(start + T * np.arange(count), speed + 0.05 * rng.standard_normal(count), velocity, strict=True)
    return [f"{t:.3f},{n:.6f},{v:.8f}\n" for t, n, v in told]


def asked(**changes: Any) -> WatchSettings:
    given: dict[str, Any] = {"false_alarms": 1.0, "learning": LEARNT, "healthy": None, "no_pressure": False}
    return WatchSettings(Rig(), {}, **{**given, **changes})


def watched(
    lines: list[str], state: Path | None = None, header: str = HEADER, **changes: Any
) -> tuple[list[dict[str, Any]], WatchEvents]:
    """Watch lines; return the events, and the object that reported them."""
    events: list[dict[str, Any]] = []
    told = WatchEvents(events.append)
    watch_rows(told, [header + "\n", *lines], asked(**changes), "bench", state)
    return events, told


def named(events: list[dict[str, Any]]) -> list[str]:
    return [event["event"] for event in events]


def position(lines: list[str], offset: float = 0.0, T: float = T) -> list[str]:
    """Return the same rows, with position instead of velocity."""
    cells = [line.split(",") for line in lines]
    place = offset + np.cumsum([float(velocity) for *_, velocity in cells]) * T
    return [f"{time},{speed},{x:.12f}\n" for (time, speed, _), x in zip(cells, place, strict=True)]


def test_command_and_engine_have_the_same_default_learning_time() -> None:
    assert watching.LEARNING == engine.LEARNING


def test_after_a_long_gap_a_change_is_learnt_again_instead_of_an_alarm(capsys: pytest.CaptureFixture[str]) -> None:
    healthy, leaking = rows(0.0, 70.0), [rows(start, 5.0, share=0.6, seed=1) for start in (72.0, 70.5)]
    events, told = watched(healthy + leaking[0])
    assert "bench: warning: rows are missing before 72" in capsys.readouterr().err
    assert named(events) == ["start", "ready"]
    assert told.rows == len(healthy) + len(leaking[0])
    short, _ = watched(healthy + leaking[1])  # a gap of half a second is filled with missing samples
    assert named(short) == ["start", "ready", "alarm", "change"]
    assert capsys.readouterr().err == ""


def test_a_stream_of_velocity_gives_the_same_events_as_one_of_position() -> None:
    lines = rows(0.0, 70.0) + rows(70.0, 5.0, share=0.6, seed=1)
    by_velocity, _ = watched(lines)
    by_position, _ = watched(position(lines), header=HEADER.replace("velocity_m_s", "position_m"))
    assert named(by_velocity) == ["start", "ready", "alarm", "change"]
    assert [one["time_s"] for one in by_velocity] == [one["time_s"] for one in by_position]
    assert by_velocity[2]["score"] == pytest.approx(by_position[2]["score"], rel=1e-4)


def test_the_state_is_saved_at_intervals_while_the_stream_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import faults.watch.saved as saved

    times: list[float] = []
    save = saved.save_watch

    def noted(watch: Any, path: Path, travelled: float = 0.0) -> None:
        times.append(watch.last)
        save(watch, path, travelled)

    monkeypatch.setattr(saved, "save_watch", noted)
    lines = rows(0.0, 35.0)
    _, told = watched(lines, tmp_path / "state.npz")
    assert told.watch is not None
    steps = np.diff(times[:-1])  # the last save is that at the end of the stream
    assert len(times) == 4
    assert np.all((steps > SAVED_EVERY) & (steps < SAVED_EVERY + 1.0))
    _, _, travelled = load_state(tmp_path / "state.npz")
    assert travelled == pytest.approx(T * sum(float(line.split(",")[2]) for line in lines), abs=1e-9)


def test_a_temporarily_full_disk_does_not_end_the_watch_and_is_reported_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Before, a watch ended at its first save on a full disk, and never reached its alarms."""
    import faults.watch.saved as saved

    save, asked = saved.save_watch, list[float]()

    def full_at_first(watch: Any, path: Path, travelled: float = 0.0) -> None:
        asked.append(watch.last)
        if len(asked) <= 5:
            raise HydrostateError(f"{path}: the state cannot be written: No space left on device")
        save(watch, path, travelled)

    monkeypatch.setattr(saved, "save_watch", full_at_first)
    events, _ = watched(rows(0.0, 70.0) + rows(70.0, 5.0, share=0.6, seed=1), tmp_path / "state.npz")
    assert named(events) == ["start", "ready", "alarm", "change"]
    assert capsys.readouterr().err.count("No space left on device; the stream goes on without") == 1
    assert (tmp_path / "state.npz").exists()


def test_what_was_learnt_before_a_broken_row_is_saved(tmp_path: Path) -> None:
    state = tmp_path / "state.npz"
    with pytest.raises(LogError, match=r"time_s must increase|'motor_speed_rad_s' must hold numbers, got 'x'"):
        watched([*rows(0.0, 70.0), *["70.000,x,0\n"] * 60], state)
    events, _ = watched(rows(70.0, 5.0, share=0.6, seed=1), state)
    assert named(events) == ["start", "ready", "alarm", "change"]


def test_a_restarted_watch_continues_from_the_travel_of_the_piston(tmp_path: Path) -> None:
    lines, state = rows(0.0, 70.0) + rows(70.0, 5.0, share=0.6, seed=1), tmp_path / "state.npz"
    whole, _ = watched(lines)
    before, _ = watched(lines[:6500], state)
    after, _ = watched(lines[6500:], state)
    assert [(one["event"], one["time_s"]) for one in [*before, *after[2:]]] == [
        (one["event"], one["time_s"]) for one in whole
    ]
    assert named(after)[:2] == ["start", "ready"]


def test_a_stream_that_continues_at_another_time_is_learnt_again_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for start, follows in ((70.5, True), (80.0, False), (10.0, False)):
        state = tmp_path / f"{start}.npz"
        watched(rows(0.0, 70.0), state)
        capsys.readouterr()
        events, _ = watched(rows(start, 5.0, share=0.6, seed=1), state)
        assert ("alarm" in named(events)) is follows
        assert events[0]["time_s"] == pytest.approx(start, abs=1.0)
        assert ("the stream does not continue at 70 s" in capsys.readouterr().err) is not follows


def test_a_state_of_another_rate_is_refused(tmp_path: Path) -> None:
    state = tmp_path / "state.npz"
    watched(rows(0.0, 10.0), state)
    with pytest.raises(LogError, match="was saved at 100 Hz, but the stream has 50 Hz"):
        watched(rows(10.0, 10.0, T=0.02), state)


def test_an_incomplete_last_row_is_left_out_with_a_warning(capsys: pytest.CaptureFixture[str]) -> None:
    _, told = watched([*rows(0.0, 5.0), "5.000,1"])
    assert told.rows == 500
    assert "the last row is incomplete and was left out" in capsys.readouterr().err


def test_a_stream_without_motion_is_refused_by_its_name() -> None:
    with pytest.raises(LogError, match="a watch needs motor_speed_rad_s, and position_m or velocity_m_s") as refused:
        watched(["0,1\n", "1,1\n", "2,1\n"], header="time_s,motor_speed_rad_s")
    assert refused.value.source == "bench"


def test_an_empty_stream_is_refused() -> None:
    with pytest.raises(LogError, match="a header line is needed, but nothing came"):
        watch_rows(WatchEvents(lambda _: None), ["\n", "  \n"], asked(), "bench", None)


def test_empty_lines_before_the_header_are_skipped() -> None:
    events: list[dict[str, Any]] = []
    watch_rows(WatchEvents(events.append), ["\n", HEADER + "\n", *rows(0.0, 5.0)], asked(), "bench", None)
    assert named(events) == ["start"]


def written(path: Path, lines: list[str], header: str = HEADER) -> Path:
    path.write_text(header + "\n" + "".join(lines))
    return path


def test_alarms_in_a_healthy_log_give_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = written(tmp_path / "wrong.csv", rows(0.0, 80.0) + rows(80.0, 10.0, share=0.6, seed=1))
    watched(rows(0.0, 5.0), healthy=wrong)
    assert f"{wrong}: warning: 1 alarms in this healthy log" in capsys.readouterr().err
    right = written(tmp_path / "right.csv", rows(0.0, 80.0))
    watched(rows(0.0, 5.0), healthy=right)
    assert "alarms" not in capsys.readouterr().err


def test_a_healthy_log_without_the_pressure_of_the_stream_is_refused(tmp_path: Path) -> None:
    healthy = written(tmp_path / "healthy.csv", rows(0.0, 80.0))
    with_pressure = [line.replace("\n", ",1e5\n") for line in rows(0.0, 5.0)]
    header = HEADER + ",differential_pressure_pa"
    with pytest.raises(LogError, match="the healthy log must have differential_pressure_pa, as the stream has"):
        watched(with_pressure, header=header, healthy=healthy)
    events, _ = watched(with_pressure, header=header, healthy=healthy, no_pressure=True)
    assert named(events) == ["start", "ready"]


def test_lost_late_and_dropped_batches_are_counted_separately(capsys: pytest.CaptureFixture[str]) -> None:
    warn_of_lost_batches("mqtt://bench/press", BatchCounts(batches=7, late=1, lost=2, dropped=3))
    assert capsys.readouterr().err.splitlines() == [
        "mqtt://bench/press: warning: 2 batches never came beside 7 that were read",
        "mqtt://bench/press: warning: 1 batches came late or twice beside 7 that were read",
        "mqtt://bench/press: warning: 3 batches found no room to wait beside 7 that were read",
    ]
    warn_of_lost_batches("mqtt://bench/press", BatchCounts(batches=7))
    assert capsys.readouterr().err == ""


def test_lost_batches_are_reported_even_if_the_stream_ends_in_an_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def lines(_: str, received: BatchCounts) -> Any:
        received.lost = 4
        yield HEADER + "\n"
        yield "nothing\n"

    monkeypatch.setattr(watching, "stream_lines", lines)
    with pytest.raises(LogError):
        watching.watch_network(WatchEvents(lambda _: None), "tcp://bench:1", asked(), None)
    assert "4 batches never came" in capsys.readouterr().err


def test_a_missing_column_gives_a_warning_from_the_rig_file_and_an_error_from_the_option(
    capsys: pytest.CaptureFixture[str],
) -> None:
    bench = Rig(columns={"differential_pressure_pa": "DP:bar"})
    watch_rows(
        WatchEvents(lambda _: None), [HEADER + "\n", *rows(0.0, 5.0)], replace(asked(), rig=bench), "bench", None
    )
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("bench: warning: ")
    assert "DP:bar" in said
    wanted = replace(asked(), columns=bench.columns)
    with pytest.raises(LogError, match="DP"):
        watch_rows(WatchEvents(lambda _: None), [HEADER + "\n", *rows(0.0, 5.0)], wanted, "bench", None)


def test_a_state_of_other_settings_is_refused_but_a_server_learns_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = tmp_path / "state.npz"
    watched(rows(0.0, 70.0), state)
    with pytest.raises(HydrostateError, match="false alarms; to learn again, delete its state file"):
        watched(rows(70.0, 5.0), state, false_alarms=2.0)
    for changes in ({"false_alarms": 2.0}, {"learning": LEARNT + 1.0}):
        events, _ = watched(rows(70.0, 70.0), state, renew=True, **changes)
        assert named(events) == ["start", "ready"]
        assert "so learning starts again" in capsys.readouterr().err
    events, _ = watched(rows(140.0, 70.0, T=0.02), state, renew=True)
    assert named(events) == ["start", "ready"]
    state.write_text("no archive")
    events, _ = watched(rows(0.0, 70.0), state, renew=True)
    assert named(events) == ["start", "ready"]
