"""Metrics of a server in the text format of Prometheus."""

import re
from collections.abc import Callable

import pytest
from fastapi.testclient import TestClient

from experiments.serve.metrics import exposition

LINE = re.compile(r'[a-z_]+(\{([a-z]+="([^"\\\n]|\\[\\"n])*",?)+\})? [0-9.e+-]+|# (HELP|TYPE) [a-z_]+ .+')


def test_metrics_of_every_stream_contain_rows_values_and_alarm_shares() -> None:
    gauges = {"rows": 5000, "gaps": 1, "left_out": 3, "received": 97.5, "values": {"position_m": 0.25, "speed": None}}
    gauges |= {"scores": {"flow": 3.0, "force": 1.0}, "thresholds": {"flow": 12.0, "force": None}}
    state = {"name": "press", "state": "watching", "message": "", "gauges": gauges}
    quiet = {"name": "lift", "state": "failed", "message": "nobody answers", "gauges": None}
    lines = exposition({"done": 2, "failed": 1}, 3, [(state, 4), (quiet, 0)], 100.0).splitlines()
    assert {
        'hydrostate_logs{state="done"} 2',
        "hydrostate_logs_waiting 3",
        'hydrostate_stream_up{stream="press"} 1',
        'hydrostate_stream_up{stream="lift"} 0',
        'hydrostate_stream_rows_total{stream="press"} 5000',
        'hydrostate_stream_left_out_total{stream="press"} 3',
        'hydrostate_stream_age_seconds{stream="press"} 2.5',
        'hydrostate_stream_alarm_share{stream="press",balance="flow"} 0.25',
        'hydrostate_stream_alarms_total{stream="press"} 4',
        'hydrostate_stream_value{stream="press",channel="position_m"} 0.25',
    } <= set(lines)
    assert not [line for line in lines if 'balance="force"' in line or 'channel="speed"' in line]
    assert [line for line in lines if not LINE.fullmatch(line)] == []


def test_metrics_omit_values_that_are_not_finite() -> None:
    gauges = {"rows": 1, "gaps": 0, "left_out": 0, "received": 0.0}
    gauges |= {"values": {"a": float("inf"), "b": float("nan"), "c": 2.0}}
    gauges |= {"scores": {"flow": float("nan")}, "thresholds": {"flow": 1.0}}
    state = {"name": "press", "state": "watching", "message": "", "gauges": gauges}
    text = exposition({}, None, [(state, 0)], 1.0)
    told = [line for line in text.splitlines() if line.startswith("hydrostate_stream_value")]
    assert told == ['hydrostate_stream_value{stream="press",channel="c"} 2']
    assert "alarm_share" not in text
    assert "hydrostate_logs" not in text


@pytest.mark.parametrize("name", ['a"b', "a\\b", "a\nb"])
def test_names_with_quotes_or_line_breaks_are_escaped_in_metrics(name: str) -> None:
    text = exposition({name: 1}, 0, [], 0.0)
    assert [line for line in text.splitlines() if not LINE.fullmatch(line)] == []


def test_the_server_offers_metrics_as_text(served: Callable[..., TestClient]) -> None:
    answer = served().get("/metrics")
    assert answer.headers["content-type"].startswith("text/plain; version=0.0.4")
    assert "hydrostate_logs_waiting 0" in answer.text.splitlines()
