import io
import json
import socket
import threading
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.streams.watch_events import WatchEvents
from plant.eha.model import EhaParameters
from plant.log.files import write_record
from plant.log.record import Record

P = EhaParameters()
T = 5e-3


def _record(leak_from: float, seconds: float = 100.0, seed: int = 0) -> Record:
    rng = np.random.default_rng(seed)
    count = round(seconds / T)
    speed = P.rated_speed * np.repeat(rng.choice((-1.0, 1.0), count // 10 + 1), 10)[:count]
    share = np.where(T * np.arange(count) < leak_from, 0.9, 0.6)
    velocity = share * P.pump_displacement * speed / P.piston_area
    pressure = 1e7 * velocity + 5e3 * rng.standard_normal(count)
    position = np.cumsum(velocity) * T + 1e-6 * rng.standard_normal(count)
    noisy = speed + 0.05 * rng.standard_normal(count)
    return Record(T, {"motor_speed_rad_s": noisy, "position_m": position, "differential_pressure_pa": pressure})


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("watch") / "run.csv"
    write_record(_record(leak_from=90.0), path)
    return path


def _run(*arguments: str, given: str | None = None) -> tuple[int, list[dict[str, Any]], str]:
    result = CliRunner().invoke(app, ["watch", *arguments], input=given)
    return result.exit_code, [json.loads(line) for line in result.stdout.splitlines()], result.stderr


def test_a_stream_and_its_log_give_the_same_events(log: Path) -> None:
    code, streamed, _ = _run("-", "--learning", "60", given=log.read_text())
    assert code == 0
    assert [one["event"] for one in streamed] == ["start", "ready", "alarm", "change", "end"]
    alarm = streamed[2]
    assert alarm["since_ci95_s"][0] <= 90.0 <= alarm["since_ci95_s"][1]
    assert 90.0 < alarm["time_s"] < 90.6
    assert streamed[3]["lost_flow_percent"] == pytest.approx({"before": 10.0, "after": 40.0}, abs=1.0)
    assert streamed[3]["pressure_change_percent"] == pytest.approx(0.0, abs=1.0)
    _, read, _ = _run(str(log), "--learning", "60")
    assert [one.get("since_s") for one in read] == [one.get("since_s") for one in streamed]


def test_with_a_healthy_log_the_watch_is_ready_from_the_start(log: Path, tmp_path: Path) -> None:
    healthy = tmp_path / "healthy.csv"
    write_record(_record(leak_from=np.inf, seed=1), healthy)
    code, events, _ = _run(str(log), "--learning", "60", "--healthy", str(healthy))
    assert code == 0
    assert [one["event"] for one in events] == ["start", "ready", "alarm", "change", "end"]
    assert events[1]["time_s"] == 0.0


def test_foreign_columns_and_units_are_read_from_a_stream(log: Path) -> None:
    lines = log.read_text().replace("position_m", "POS").replace("motor_speed_rad_s", "W")
    columns = ("--columns", "position_m=POS:m,motor_speed_rad_s=W:rad/s")
    code, events, _ = _run("-", "--learning", "60", *columns, given=lines)
    assert code == 0
    assert [one["event"] for one in events][2] == "alarm"


def test_a_stream_too_short_to_learn_from_ends_with_that_message(log: Path) -> None:
    code, events, _ = _run("-", given="".join(log.read_text().splitlines(keepends=True)[:3000]))
    assert code == 0
    assert "before learning was over" in events[-1]["message"]


def test_a_row_of_garbage_is_left_out_and_counted(log: Path) -> None:
    lines = log.read_text().splitlines(keepends=True)
    code, events, said = _run("-", given="".join([*lines[:3001], lines[3001].replace(",", ",x", 1), *lines[3002:]]))
    assert code == 0
    assert (events[-1]["outcome"], events[-1]["left_out"]) == ("ok", 1)
    assert "warning: 1 row holds garbage, which was left out; column" in said
    assert "in row 3001" in said


def test_a_stream_that_turns_into_garbage_ends_the_watch_with_the_row(log: Path) -> None:
    lines = log.read_text().splitlines(keepends=True)
    garbage = [line.replace(",", ",x", 1) for line in lines[3001:]]
    code, events, said = _run("-", given="".join([*lines[:3001], *garbage]))
    assert code == 2
    assert events[-1]["outcome"] == "failed"
    assert "in row 30" in said
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--false-alarms", "0"), "false alarms must be over 0"),
        (("--learning", "1"), "learning must take 60 to 1e+07 s, got 1 s"),
        (("--learning", "1e308"), "learning must take 60 to 1e+07 s, got 1e+308 s"),
        (("--healthy", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_options_that_cannot_be_used_are_refused(log: Path, arguments: tuple[str, ...], said: str) -> None:
    code, _, error = _run(str(log), *arguments)
    assert code == 2
    assert said in error


def test_a_healthy_log_of_another_rate_is_refused(log: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.csv"
    write_record(Record(2 * T, dict(_channels(_record(leak_from=np.inf, seconds=10.0)))), other)
    code, _, error = _run(str(log), "--healthy", str(other))
    assert code == 2
    assert "the sample rate of the stream, 200 Hz, got 100 Hz" in error


def _channels(record: Record) -> dict[str, np.ndarray]:
    return {name: record[name] for name in record}


def test_an_alarm_is_printed_before_standard_input_ends(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    class Growing(io.StringIO):
        def readline(self, size: int | None = -1, /) -> str:
            seen.append(len(printed))
            return super().readline(size)

    printed: list[str] = []
    monkeypatch.setattr("experiments.streams.endings.emit", lambda line: printed.append(line))
    monkeypatch.setattr("sys.stdin", Growing(log.read_text()))
    from experiments.verbs.watch import watch

    watch("-", learning=60.0)
    alarm = next(k for k, line in enumerate(printed) if '"alarm"' in line)
    assert alarm + 1 in seen


def test_a_restarted_tcp_stream_continues_from_its_saved_state(log: Path, tmp_path: Path) -> None:
    header, *rows = log.read_text().splitlines(keepends=True)
    _, wanted, _ = _run("-", "--learning", "60", given="".join([header, *rows]))
    state, found = tmp_path / "state.npz", list[dict[str, Any]]()
    for part in (rows[:7001], rows[7001:]):
        with socket.create_server(("127.0.0.1", 0)) as server:

            def serve(part: list[str] = part, server: socket.socket = server) -> None:
                connection, _ = server.accept()
                with connection:
                    connection.sendall("".join([header, *part]).encode())

            threading.Thread(target=serve, daemon=True).start()
            address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
            code, events, said = _run(address, "--learning", "60", "--state", str(state))
        assert (code, said) == (0, "")
        found += events
    told = [
        [{**one, "clock": ""} for one in events if one["event"] in ("ready", "alarm", "change")]
        for events in (found, wanted)
    ]
    assert told[0] == told[1]
    assert [one["event"] for one in told[0]] == ["ready", "alarm", "change"]


def test_heartbeats_are_sent_without_rows_and_every_event_has_the_wall_clock(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    header, *rows = log.read_text().splitlines(keepends=True)
    beats, enough, alive = list[int](), threading.Event(), WatchEvents.alive

    def counted(self: WatchEvents) -> None:
        alive(self)
        beats.append(self.rows)
        if beats.count(400) == 3:
            enough.set()

    monkeypatch.setattr(WatchEvents, "alive", counted)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall("".join([header, *rows[:400]]).encode())
                enough.wait(20.0)

        threading.Thread(target=serve, daemon=True).start()
        code, events, _ = _run(f"tcp://127.0.0.1:{server.getsockname()[1]}", "--heartbeat", "0.1")
    assert code == 0
    assert [one["event"] for one in events if one["event"] != "alive"] == ["start", "end"]
    assert events[-1]["event"] == "end"
    taken = [one["samples"] for one in events if one["event"] == "alive"]
    silent = [one["silent_s"] for one in events if one["event"] == "alive" and one["samples"] == 400]
    assert taken == sorted(taken)  # a heartbeat may fall between two received pieces
    assert len(silent) >= 2
    assert silent == sorted(silent)
    stamps = [datetime.fromisoformat(one["clock"]) for one in events]
    assert stamps == sorted(stamps)
    assert stamps[-1].tzinfo is not None


@pytest.mark.parametrize("every", ["0", "-1", "nan"])
def test_a_heartbeat_interval_that_is_not_positive_is_refused(log: Path, every: str) -> None:
    code, _, said = _run(str(log), "--heartbeat", every)
    assert code == 2
    assert "--heartbeat must be positive" in said
