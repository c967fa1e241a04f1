"""`hydrostate filter -`: a filter's estimates for a stream as rows arrive, one JSON object per line."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer

from experiments.command.json_output import plain
from experiments.command.logs import read_and_warn, read_log
from experiments.command.options import (
    Columns,
    RigFile,
    argument,
    flag,
    load_columns,
    load_rig,
    option,
    require_positive,
    split_names,
)
from experiments.command.output_paths import require_place
from experiments.command.terminal import note
from experiments.running.refusal import os_errors_as
from experiments.streams.broker import broker_publisher
from experiments.streams.endings import report_end, say_line, stop_at_signals
from experiments.streams.filtering import Filtering
from experiments.streams.rows import STANDARD_INPUT, stream_input, warn_of_lost_batches
from plant.errors import LogError
from plant.log.stream.source import BatchCounts, bounded_lines, is_stream, stream_lines

HEALTHY_ASSUMED = (
    "leakage and friction are taken from the rig {rig!r}; if the actuator leaks more, bulk modulus is wrong: where "
    "position and pressure are logged, --form flow estimates leakage too"
)
"""What is said of a filter that is given leakage and friction."""

commands = typer.Typer()


@commands.command(
    name="filter", epilog="Example: hydrostate filter mqtt://bench/rows --rig rig.toml --state filter.npz"
)
def filter_stream(
    stream: Annotated[
        str,
        argument(
            "STREAM",
            "tcp://HOST:PORT, mqtt://HOST/TOPIC, ring:PATH, a CSV file, or - for CSV on standard input: a header, then "
            "rows of time_s, motor_speed_rad_s and what the form needs.",
        ),
    ],
    form: Annotated[
        str,
        option(
            "FORM", "Model of the filter: pressure, acceleration, flow, chambers, chambers_by_mass or chambers_held."
        ),
    ] = "pressure",
    method: Annotated[str, option("METHOD", "ekf, iekf, ukf, ckf, svsf or sif.")] = "ekf",
    states: Annotated[
        str,
        option(
            "NAMES",
            "Parameters to estimate in addition to bulk modulus, comma-separated: leakage, friction, air, or names "
            "such as flow_bias.",
        ),
    ] = "",
    like: Annotated[
        Path | None,
        option(
            "LOG",
            "A log of the same bench, from which the noise levels are taken.",
            show_default="the stream's first second",
        ),
    ] = None,
    tune: Annotated[bool, flag("--tune", "Tune the noise levels on that log by maximum likelihood.")] = False,
    every: Annotated[float, option("S", "Time of the stream between two estimates [s].")] = 1.0,
    rig: RigFile = None,
    columns: Columns = None,
    state: Annotated[
        Path | None, option("FILE", "Save the filter in this file, and continue from it after a restart.")
    ] = None,
    publish: Annotated[
        str | None, option("mqtt://HOST[:PORT]/TOPIC", "Also publish every line to an MQTT broker.")
    ] = None,
) -> None:
    """Run a filter on a stream: bulk modulus and its other estimates, with standard deviations, as rows arrive.

    This is the filter that `export c` writes for a controller, with the same numbers. Events: start; estimate (values,
    standard deviations, the mean squared innovation of each channel since the last estimate, and what speaks against
    it: the gate); end. A missing sample is skipped; a missing drive value is held. After more than a second without
    rows the filter restarts from where the actuator then is.
    """
    require_positive("--every", every, "s")
    require_place("--state", state)
    sinks: list[Any] = [say_line]

    def say(entries: Mapping[str, Any]) -> None:
        shown = plain(dict(entries))
        for sink in sinks:
            sink(shown)

    stop_at_signals()
    from estimation.eha.by_filter import FilterOptions
    from estimation.eha.online import StreamFilterOptions
    from estimation.models.eha_forms import FORMS

    with ExitStack() as outputs:
        bench, named = load_rig(rig), load_columns(columns)
        freed = FilterOptions(states=split_names(states)).names
        asked = StreamFilterOptions(bench.parameters, form, method, freed, tune)
        if form in FORMS and not freed:
            note(HEALTHY_ASSUMED.format(rig=bench.name))
        log = None if like is None else read_and_warn(str(like), lambda: read_log(like, bench.columns, named))
        source = STANDARD_INPUT if stream == "-" else stream
        told = Filtering(say, asked, (bench.columns, named), every, log, state, source)
        if publish is not None:
            sinks.append(outputs.enter_context(broker_publisher(publish)))
        received = BatchCounts()
        with report_end(told):
            try:
                told.follow(_lines(stream, received))
            finally:
                warn_of_lost_batches(stream, received)


def _lines(stream: str, received: BatchCounts) -> Iterator[str]:
    if is_stream(stream):
        yield from stream_lines(stream, received)
    elif stream == "-":
        yield from stream_input(sys.stdin)
    else:
        _require_text(Path(stream))
        with (
            os_errors_as(f"{stream}: it cannot be read"),
            Path(stream).open(encoding="utf-8", errors="replace", newline="\n") as file,
        ):
            yield from bounded_lines(file, stream)


def _require_text(path: Path) -> None:
    """Refuse a file of another format, whose bytes would be taken for a header."""
    from plant.log.formats.detect import format_of
    from plant.log.formats.packed import packing_of

    if path.is_file() and path.stat().st_size and (format_of(path) != "csv" or packing_of(path) is not None):
        raise LogError("rows are filtered from text; `hydrostate estimate LOG --method ekf` filters a log", str(path))
