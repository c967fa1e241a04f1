"""Events of a watch as entries: the cause of an alarm, and what is unknown."""

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.streams.heartbeat import report_alive
from experiments.streams.watch_events import WatchEvents
from faults.watch.events import LOSS_BALANCE, Alarm, Change


def told(*events: Any) -> list[dict[str, Any]]:
    lines: list[dict[str, Any]] = []
    WatchEvents(lines.append).events(events)
    return lines


def alarm(balance: str) -> Alarm:
    return Alarm(time=12.0, balance=balance, since=11.25, interval=(11.0, 11.5), score=9.0, threshold=4.0)


def test_a_sudden_change_is_dated_and_a_slow_one_reported_as_growth() -> None:
    (sudden,), (slow,) = told(alarm("flow")), told(alarm(LOSS_BALANCE))
    assert sudden["message"] == (
        "the flow balance changed at 11.25 s of the stream (95 % interval 11.00 to 11.50 s): "
        "the piston gets a different share of the pump's flow than before"
    )
    assert "leakage has grown by more than warm oil explains" in slow["message"]
    assert "since about 11 s of the stream (95 % interval 11 to 12 s)" in slow["message"]
    assert (sudden["since_s"], sudden["since_ci95_s"]) == (11.25, [11.0, 11.5])


def test_slow_growth_without_pressure_is_not_called_leakage() -> None:
    """Growing friction costs speed as a leak does; before, the alarm said that leakage had grown."""
    lines: list[dict[str, Any]] = []
    events = WatchEvents(lines.append)
    watch: Any = SimpleNamespace(balances=("motion", "loss"))
    events.watch = watch
    events.events([alarm(LOSS_BALANCE)])
    assert "leakage has grown" not in lines[0]["message"]
    assert lines[0]["message"].endswith("by a leak, growing friction or a failing encoder")


def test_a_change_gives_lost_flow_and_pressure_in_percent_or_as_unknown() -> None:
    known, blind = told(
        Change(time=14.0, alarm=alarm("flow"), lost=(0.1, 0.4), pressure=-0.05),
        Change(time=14.0, alarm=alarm("motion"), lost=None, pressure=None),
    )
    assert known["lost_flow_percent"] == pytest.approx({"before": 10.0, "after": 40.0})
    assert known["pressure_change_percent"] == pytest.approx(-5.0)
    assert "10 % of the pump's delivery before, 40 % after" in known["message"]
    assert blind["lost_flow_percent"] == {"before": None, "after": None}
    assert blind["pressure_change_percent"] is None
    assert "the cause of the change is not known" in blind["message"]


@pytest.mark.parametrize("every", [1, 3])
def test_a_channel_without_samples_for_ten_seconds_is_told_once_and_when_it_is_back(every: int) -> None:
    """Before, a pressure that was lost for ever left the watch blind, and it ended with `ok` and no word."""
    lines: list[dict[str, Any]] = []
    events = WatchEvents(lines.append)
    for k in range(1, 800):
        pressure = np.full(10, 1e5)
        if 200 <= k < 600:
            pressure[::every] = np.nan
        events.process_samples({"position_m": np.zeros(10), "differential_pressure_pa": pressure}, 0.05 * k, False)
    (missing, back) = lines
    assert (missing["event"], back["event"]) == ("missing", "back")
    assert missing["channel"] == back["channel"] == "differential_pressure_pa"
    assert missing["since_s"] == back["since_s"] == pytest.approx(9.95)
    assert missing["time_s"] == pytest.approx(20.0, abs=0.06)
    assert back["time_s"] == pytest.approx(30.0, abs=0.06)
    assert missing["message"].startswith("samples of differential_pressure_pa are missing since")


def test_a_channel_that_is_not_judged_may_be_missing() -> None:
    lines: list[dict[str, Any]] = []
    events = WatchEvents(lines.append)
    watch: Any = SimpleNamespace(balances=("motion", "loss"))
    events.watch = watch
    for k in range(1, 400):
        lost = np.full(10, np.nan)
        channels = {"position_m": np.zeros(10), "velocity_m_s": lost, "differential_pressure_pa": lost}
        events.process_samples({**channels, "motor_voltage_v": lost}, 0.05 * k, False)
    assert lines == []


def test_short_dropouts_and_missing_rows_are_no_missing_channel() -> None:
    lines: list[dict[str, Any]] = []
    events = WatchEvents(lines.append)
    for k in range(1, 800):
        lost = np.full(10, np.nan if k % 150 else 0.0)
        events.process_samples({"position_m": lost}, 0.05 * k + (60.0 if k > 400 else 0.0), k == 401)
    assert lines == []


@pytest.mark.parametrize(
    ("outcome", "why", "words"),
    [
        ("ok", "", "1 alarm in 12.0 s"),
        ("interrupted", "interrupted", "interrupted; 1 alarm in 12.0 s"),
        ("failed", "no", "no"),
    ],
)
def test_the_end_event_counts_the_alarms_unless_the_watch_failed(outcome: str, why: str, words: str) -> None:
    lines: list[dict[str, Any]] = []
    events = WatchEvents(lines.append)
    watch: Any = SimpleNamespace(last=12.0, thresholds=(1.0,), balances=("flow",))
    events.watch = watch
    events.events([alarm("flow")])
    events.end(outcome, why)
    assert lines[-1]["message"] == words


def test_a_heartbeat_interval_of_thousands_of_years_raises_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    failed: list[object] = []
    monkeypatch.setattr(threading, "excepthook", failed.append)
    with report_alive(WatchEvents(lambda _: None), 1e20):
        pass
    assert failed == []


def test_the_start_event_gives_the_motion_left_to_learn() -> None:
    lines: list[dict[str, Any]] = []
    for unlearnt, threshold in ((120.0, float("inf")), (0.0, 4.0)):
        watch: Any = SimpleNamespace(
            last=0.0, thresholds=(threshold,), balances=("flow",), sample_time=1e-3, unlearnt=unlearnt
        )
        WatchEvents(lines.append).start("bench", watch, "paper", 1.0)
    said = [one["message"] for one in lines if one["event"] == "start"]
    assert said == [
        "learning the healthy behaviour: alarms are possible after 120 s of motion",
        "the healthy behaviour was learnt before",
    ]
