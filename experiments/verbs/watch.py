"""`hydrostate watch -`: events of a stream as they occur, one JSON object per line."""

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import (
    Columns,
    RigFile,
    argument,
    flag,
    load_columns,
    load_rig,
    option,
    require_positive,
)
from experiments.command.output_paths import require_place
from experiments.streams.broker import broker_publisher
from experiments.streams.endings import report_end, say_line, stop_at_signals
from experiments.streams.heartbeat import report_alive
from experiments.streams.metrics_endpoint import serve_metrics
from experiments.streams.rows import STANDARD_INPUT, stream_input
from experiments.streams.watch_view import lines_wanted, show_view
from experiments.streams.watched import Watched
from experiments.streams.watching import LEARNING, WatchSettings, watch_file, watch_network, watch_rows
from plant.errors import HydrostateError
from plant.log.stream.source import is_stream

commands = typer.Typer()


@commands.command(epilog="Example: tail -n +1 -f bench.csv | hydrostate watch - --false-alarms 1")
def watch(
    log: Annotated[
        str,
        argument(
            "LOG",
            "A log (it is read to its end; a file that still grows is followed as in the example), tcp://HOST:PORT, "
            "mqtt://HOST/TOPIC, ring:PATH, or - for CSV on standard input: a header, then "
            "rows of time_s, motor_speed_rad_s, and position_m or velocity_m_s; differential_pressure_pa is optional.",
        ),
    ],
    false_alarms: Annotated[
        float, option("RATE", "False alarms allowed per hour of healthy, moving operation [1/h].")
    ] = 1.0,
    learning: Annotated[
        float, option("S", "Time of healthy running to learn from before the first alarm [s]; at least 60.")
    ] = LEARNING,
    healthy: Annotated[
        Path | None,
        option("FILE", "A healthy log to learn from first; one hour of log keeps false alarms closest to RATE."),
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    no_pressure: Annotated[bool, flag("--no-pressure", "Ignore differential pressure even if it is logged.")] = False,
    heartbeat: Annotated[
        float | None, option("S", "Also report every S seconds that the command is running, whether rows come or not.")
    ] = None,
    state: Annotated[
        Path | None, option("FILE", "Save what was learnt in this file, and continue from it after a restart.")
    ] = None,
    publish: Annotated[
        str | None, option("mqtt://HOST[:PORT]/TOPIC", "Also publish every event to an MQTT broker.")
    ] = None,
    metrics: Annotated[
        str | None,
        option(
            "[HOST:]PORT", "Also serve Prometheus metrics at /metrics; on this machine only, unless a host is named."
        ),
    ] = None,
    view: Annotated[bool, flag("--view", "Also draw gauges and the last events on standard error.")] = False,
) -> None:
    """Report a change inside the actuator as it happens: one JSON object per line.

    Events: start; ready (learning is over); alarm, with since_s and its 95 % interval; change (two seconds later: how
    much lost flow and pressure changed); missing and back (a channel has no samples); alive (with --heartbeat); end.
    Each has the time of the stream and the clock's time (UTC). The command learns how the healthy actuator behaves and
    follows slow drift, such as warming oil. So it reports sudden changes, and leakage that grows by more than warm oil
    explains. Use diagnose for a fault that was there from the start.
    """
    require_positive("--heartbeat", heartbeat, "s")
    require_place("--state", state)
    if state is not None and log != "-" and not is_stream(log):
        raise HydrostateError(f"--state goes with a stream, '-' or tcp://HOST:PORT, got the file {log!r:.80}")
    told = Watched(STANDARD_INPUT if log == "-" else log)
    if lines_wanted(view):
        told.add_output(say_line)
    stop_at_signals()

    with ExitStack() as outputs, report_end(told):  # outputs receive the end before they are closed
        _open_outputs(told, outputs, publish, metrics, view)
        settings = WatchSettings(load_rig(rig), load_columns(columns), false_alarms, learning, healthy, no_pressure)
        with report_alive(told, heartbeat):
            if log == "-":
                watch_rows(told, stream_input(sys.stdin), settings, STANDARD_INPUT, state)
            elif is_stream(log):
                watch_network(told, log, settings, state)
            else:
                watch_file(told, Path(log), settings)


def _open_outputs(told: Watched, outputs: ExitStack, publish: str | None, metrics: str | None, view: bool) -> None:
    """Open the requested outputs."""
    if publish is not None:
        told.add_output(outputs.enter_context(broker_publisher(publish)))
    if metrics is not None:
        outputs.enter_context(serve_metrics(metrics, told))
    if view:
        outputs.enter_context(show_view(told))
