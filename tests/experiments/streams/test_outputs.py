"""Outputs of a watch beside its lines: a real broker, metrics for Prometheus, and a view on a terminal."""

import io
import json
import re
import socket
import threading
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from experiments.cli import app
from experiments.streams.metrics_endpoint import endpoint, serve_metrics
from experiments.streams.watch_view import show_view, view_frame
from experiments.streams.watched import Watched
from plant.errors import HydrostateError

LINE = re.compile(r'[a-z_]+(\{([a-z]+="([^"\\\n]|\\[\\"n])*",?)+\})? [0-9.e+-]+|# (HELP|TYPE) [a-z_]+ .+')


class OneBalance:
    """The part of a watch that an output uses."""

    balances, scores, thresholds = ("flow", "motion"), (3.0, 1.0), (12.0, float("inf"))
    sample_time, last, unlearnt = 1e-3, 5.0, 0.0


def watching() -> Watched:
    """Return a watch that has learnt, has received two samples, and has raised an alarm."""
    told = Watched("bench\x1b[2J.csv")
    told.start("bench", OneBalance(), "paper", 1.0)  # type: ignore[arg-type]
    told.process_samples({"position_m": np.array([0.1, 0.25]), "velocity_m_s": np.array([0.0, np.nan])}, 5.0, gap=True)
    told.alarms += 1
    return told


def rows(seconds: float) -> str:
    time = np.arange(0.0, seconds, 0.01)
    speed = 20.0 * np.sign(np.sin(2.0 * time))
    lines = [f"{t:.2f},{u:.1f},{0.001 * i:.4f}" for i, (t, u) in enumerate(zip(time, speed, strict=True))]
    return "\n".join(["time_s,motor_speed_rad_s,position_m", *lines]) + "\n"


def asked(port: int, path: str = "/metrics") -> tuple[str, str]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=5.0) as answer:
        return answer.headers["Content-Type"], answer.read().decode()


def test_every_printed_event_is_published_to_the_broker(broker: int) -> None:
    from paho.mqtt import client as mqtt
    from paho.mqtt.enums import CallbackAPIVersion

    came: list[dict[str, Any]] = []
    ready, over = threading.Event(), threading.Event()

    def take(_client: Any, _data: Any, message: Any) -> None:
        came.append(json.loads(message.payload))
        if came[-1]["event"] == "end":
            over.set()

    reader: Any = mqtt.Client(CallbackAPIVersion.VERSION2)
    reader.on_connect = lambda client, *_: client.subscribe("press/events", qos=1)
    reader.on_subscribe = lambda *_: ready.set()
    reader.on_message = take
    reader.connect("127.0.0.1", broker)
    reader.loop_start()
    try:
        assert ready.wait(10.0)
        address = f"mqtt://127.0.0.1:{broker}/press/events"
        done = CliRunner().invoke(app, ["watch", "-", "--publish", address], input=rows(3.0))
        assert done.exit_code == 0, done.stderr
        assert over.wait(10.0)
    finally:
        reader.loop_stop()
        reader.disconnect()
    assert came == [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["event"] for one in came] == ["start", "end"]


@pytest.mark.parametrize(
    "address", ["mqtt://127.0.0.1", "tcp://127.0.0.1:9/x", "mqtt://h/a/+", "mqtt://h/a/#", "mqtt://h:x/a"]
)
def test_an_invalid_address_to_publish_to_is_refused_with_the_expected_form(address: str) -> None:
    done = CliRunner().invoke(app, ["watch", "-", "--publish", address], input=rows(1.0))
    assert done.exit_code != 0
    (end,) = [json.loads(line) for line in done.stdout.splitlines()]
    assert (end["event"], end["outcome"]) == ("end", "failed")
    assert "mqtt://HOST[:PORT]/TOPIC" in end["message"]


def test_a_broker_that_does_not_answer_is_named() -> None:
    pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is an extra")
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # bound but not listening: nobody answers, and no other program takes the port
        address = f"mqtt://127.0.0.1:{held.getsockname()[1]}/press"
        done = CliRunner().invoke(app, ["watch", "-", "--publish", address], input=rows(1.0))
    assert "no broker answers" in json.loads(done.stdout)["message"]


def test_metrics_contain_the_alarm_share_of_each_learnt_balance() -> None:
    with serve_metrics("0", watching()) as port:
        kind, text = asked(port)
        with pytest.raises(urllib.error.HTTPError, match="404"):
            asked(port, "/etc/passwd")
    lines = text.splitlines()
    assert kind.startswith("text/plain; version=0.0.4")
    assert [line for line in lines if not LINE.fullmatch(line)] == []
    values = {line.split("{")[0] + line.partition(",")[2].partition("}")[0]: line.split()[-1] for line in lines}
    assert values['hydrostate_stream_alarm_sharebalance="flow"'] == "0.25"
    assert values['hydrostate_stream_valuechannel="position_m"'] == "0.25"
    assert (values["hydrostate_stream_rows_total"], values["hydrostate_stream_gaps_total"]) == ("2", "1")
    assert (values["hydrostate_stream_up"], values["hydrostate_stream_alarms_total"]) == ("1", "1")
    assert "motion" not in text  # its threshold is not yet learnt
    assert "hydrostate_logs" not in text


@pytest.mark.parametrize("where", ["", "x", "70000", ":9464", "-1"])
def test_an_invalid_address_for_metrics_is_refused(where: str) -> None:
    with pytest.raises(HydrostateError, match="--metrics must be PORT or HOST:PORT"):
        endpoint(where)


def test_a_port_that_is_taken_is_named() -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = str(held.getsockname()[1])
        with pytest.raises(HydrostateError, match=f"--metrics {port}: "), serve_metrics(port, watching()):
            pass


def test_the_view_shows_gauges_values_and_events_without_control_characters() -> None:
    page = io.StringIO()
    Console(file=page, width=100, force_terminal=False).print(view_frame(watching()))
    shown = page.getvalue()
    assert "watching, 5.0 s of the stream, 2 rows, 1 alarm" in shown
    assert re.search(r"flow +#{8}\.{22} +25", shown)
    assert re.search(r"motion +still learning", shown)
    assert re.search(r"position +250 +mm", shown)
    assert re.search(r"velocity +- +mm/s", shown)
    assert "ready: learning is over, alarms are possible from now on" in shown
    assert "\x1b" not in shown


def test_the_view_shows_the_end_of_the_stream_last() -> None:
    page, told = io.StringIO(), watching()
    with show_view(told, Console(file=page, width=100, force_terminal=True)):
        told.end("ok", "")
    assert "ended" in page.getvalue().rsplit("watching", 1)[-1]


def test_with_the_view_on_another_terminal_events_are_still_printed(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    log.write_text(rows(3.0))
    done = CliRunner().invoke(app, ["watch", str(log), "--view", "--metrics", "0"])
    assert done.exit_code == 0, done.stderr
    assert [json.loads(line)["event"] for line in done.stdout.splitlines()] == ["start", "end"]
    assert "ended, 0 alarms" in " ".join(done.stderr.split())  # a long path wraps the line
