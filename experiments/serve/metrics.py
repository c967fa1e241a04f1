"""Metrics of a server, in the text format of Prometheus."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

MEANINGS: Mapping[str, tuple[str, str]] = {
    "hydrostate_logs": ("gauge", "Logs that the server has, by state."),
    "hydrostate_logs_waiting": ("gauge", "Logs that are worked on or wait."),
    "hydrostate_stream_up": ("gauge", "Whether a stream is learnt or watched."),
    "hydrostate_stream_rows_total": ("counter", "Rows that came since the stream last began."),
    "hydrostate_stream_gaps_total": ("counter", "Gaps in them that were too long to be filled."),
    "hydrostate_stream_left_out_total": ("counter", "Rows that held garbage, which was left out."),
    "hydrostate_stream_age_seconds": ("gauge", "Time since its last gauges."),
    "hydrostate_stream_alarm_share": ("gauge", "How far a balance is from an alarm: 1 raises one."),
    "hydrostate_stream_alarms_total": ("counter", "Alarms since the server began."),
    "hydrostate_stream_value": ("gauge", "What a channel reads, in SI."),
}
"""Kind and meaning of each metric."""

PROMETHEUS_TEXT = "text/plain; version=0.0.4; charset=utf-8"
"""Media type of the text."""

Labels = Mapping[str, str]


def exposition(
    counts: Mapping[str, int], waiting: int | None, streams: Sequence[tuple[Mapping[str, Any], int]], now: float
) -> str:
    """Return all metrics as text.

    Parameters
    ----------
    counts : Mapping[str, int]
        Logs by state.
    waiting : int or None
        Logs that are running or waiting; None for a watch, which has none.
    streams : sequence of tuple
        State of each stream as in `experiments.serve.live.Stream.state`, and its alarms.
    now : float
        Current time, since 1970 [s].

    Examples
    --------
    >>> exposition({"done": 2}, 0, [], 0.0).splitlines()[2]
    'hydrostate_logs{state="done"} 2'
    """
    found: dict[str, list[str]] = {name: [] for name in MEANINGS}
    for name, labels, value in _values(counts, waiting, streams, now):
        if math.isfinite(value):
            found[name].append(f"{name}{_braced(labels)} {value:.10g}")
    lines: list[str] = []
    for name, samples in found.items():
        kind, meaning = MEANINGS[name]
        if samples:
            lines += [f"# HELP {name} {meaning}", f"# TYPE {name} {kind}", *samples]
    return "\n".join(lines) + "\n"


def _values(
    counts: Mapping[str, int], waiting: int | None, streams: Sequence[tuple[Mapping[str, Any], int]], now: float
) -> Iterator[tuple[str, Labels, float]]:
    for state, count in counts.items():
        yield "hydrostate_logs", {"state": state}, count
    if waiting is not None:
        yield "hydrostate_logs_waiting", {}, waiting
    for one, alarms in streams:
        labels, gauges = {"stream": one["name"]}, one["gauges"]
        yield "hydrostate_stream_up", labels, float(one["state"] in ("learning", "watching"))
        yield "hydrostate_stream_alarms_total", labels, alarms
        if gauges is None:
            continue
        yield "hydrostate_stream_rows_total", labels, gauges["rows"]
        yield "hydrostate_stream_gaps_total", labels, gauges["gaps"]
        yield "hydrostate_stream_left_out_total", labels, gauges["left_out"]
        yield "hydrostate_stream_age_seconds", labels, now - gauges["received"]
        for balance, score in gauges["scores"].items():
            threshold = gauges["thresholds"][balance]
            if threshold:
                yield "hydrostate_stream_alarm_share", {**labels, "balance": balance}, score / threshold
        for channel, value in gauges["values"].items():
            if value is not None:
                yield "hydrostate_stream_value", {**labels, "channel": channel}, value


def _braced(labels: Labels) -> str:
    if not labels:
        return ""
    return "{" + ",".join(f'{name}="{_escaped(value)}"' for name, value in labels.items()) + "}"


def _escaped(value: str) -> str:
    return value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
