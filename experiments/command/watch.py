"""`hydrostate watch -`: events of a stream as they come, one JSON object a line."""

import io
import json
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO, TypeVar

import typer

from experiments.command.json_output import plain
from experiments.command.logs import caught, read_log, with_rig_columns
from experiments.command.options import PRESSURE, Columns, RigFile, argument, flag, load_columns, load_rig, option
from experiments.command.terminal import SOME_FAILED, emit, note, unexpected
from plant.errors import HydrostateError, LogError
from plant.log.stream_source import Received, is_stream, stream_lines
from plant.notes import distinct

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from faults.watch.events import Alarm, Change, Event
    from faults.watch.watch import Watch
    from plant.eha.rig import Rig
    from plant.log.record import Record

T = TypeVar("T")

STANDARD_INPUT = "standard input"

LONGEST_LINE = 1 << 20
"""Characters of the longest line of a stream."""

SAME_RATE = 0.01
"""By how much the rates of a healthy log and of what is watched may differ [fraction]."""

SAVED_EVERY = 10.0
"""Time of a stream between two looks at its state file [s]."""

commands = typer.Typer()


@commands.command(epilog="Example: tail -n +1 -f bench.csv | hydrostate watch - --false-alarms 1")
def watch(
    log: Annotated[
        str,
        argument(
            "LOG",
            "A log, or - for rows of CSV on standard input: a header, then time_s, motor_speed_rad_s, and "
            "position_m or velocity_m_s; differential_pressure_pa is optional. Another unit stands in the name.",
        ),
    ],
    false_alarms: Annotated[float, option("RATE", "False alarms an hour of healthy, moving operation [1/h].")] = 1.0,
    learning: Annotated[
        float, option("S", "Healthy running to learn before alarms can come [s], 60 at least.")
    ] = 120.0,
    healthy: Annotated[
        Path | None, option("FILE", "A healthy log to learn first; an hour of one holds the rate best.")
    ] = None,
    rig: RigFile = None,
    columns: Columns = None,
    no_pressure: Annotated[
        bool, flag("--no-pressure", "Use motion alone, even if differential pressure is logged.")
    ] = False,
    state: Annotated[Path | None, option("FILE", "Continue a stream where this file says, and keep it there.")] = None,
) -> None:
    """Say when something changes inside the actuator: one JSON object a line, as it happens.

    Events: start; ready, learning is over; alarm, with since_s and its 95 % interval; change, two seconds later, by how
    much lost flow and pressure changed; end. It learns what the actuator does while it is healthy and follows slow
    drift, as of the oil's temperature, so it tells sudden changes; use diagnose for what has always been wrong.
    """
    told = _Told()
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        asked = _Asked(load_rig(rig), load_columns(columns), false_alarms, learning, healthy, no_pressure)
        if log == "-":
            _stream(told, _lines(sys.stdin), asked, STANDARD_INPUT, state)
        elif is_stream(log):
            _network(told, log, asked, state)
        else:
            _file(told, Path(log), asked)
    except HydrostateError as error:
        told.end("failed", str(error))
        raise
    except KeyboardInterrupt:
        told.end("interrupted", "interrupted")
        raise
    except BaseException as error:  # whatever ends it, the last line says so
        said = unexpected(error)
        told.end("failed", said)
        note(said)
        raise typer.Exit(SOME_FAILED) from error
    told.end("ok", "")


def _lines(file: TextIO) -> Iterator[str]:
    """Yield the lines of a stream; bytes that are no text, and a line without end, are refused later as no numbers."""
    if not isinstance(file, io.TextIOWrapper):
        yield from file
        return
    file.reconfigure(errors="replace")
    while line := file.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            raise LogError(f"a line must have fewer than {LONGEST_LINE} characters", STANDARD_INPUT)
        yield line


@dataclass(frozen=True)
class _Asked:
    """The command line."""

    bench: "Rig"
    columns: Mapping[str, str]
    false_alarms: float
    learning: float
    healthy: Path | None
    no_pressure: bool

    def watch(self, sample_time: float, pressure: bool, start: float) -> "Watch":
        """Return the watch, with the healthy log learnt."""
        from faults.watch.events import Alarm
        from faults.watch.watch import Watch

        way: Any = {"false_alarms": self.false_alarms, "learning": self.learning, "start": start}
        made = Watch(self.bench.parameters, sample_time, pressure=pressure and not self.no_pressure, **way)
        if self.healthy is not None:
            record = _read(self.healthy, self)
            if abs(record.sample_time / sample_time - 1.0) > SAME_RATE:
                raise LogError(
                    f"{self.healthy}: the healthy log must have the rate of what is watched, {1.0 / sample_time:g} Hz, "
                    f"got {1.0 / record.sample_time:g} Hz"
                )
            samples, logged = _samples(record.channels, record.sample_time, str(self.healthy))
            if "motion" not in made.balances and not logged:
                raise LogError(f"{self.healthy}: the healthy log must have {PRESSURE}, as what is watched has")
            alarms = sum(isinstance(event, Alarm) for event in made.take(samples))
            if alarms:
                note(f"{self.healthy}: warning: {alarms} alarms while this was learnt as healthy")
            made.interrupt()
            made.clock_reads(start)
        return made


class _Told:
    """What has been said so far, for the last line."""

    def __init__(self) -> None:
        self.watch: Watch | None = None
        self.began = 0.0
        self.alarms = 0

    def start(self, source: str, watch: "Watch", asked: _Asked) -> None:
        self.watch, self.began = watch, watch.last
        about = {"file": source, "rig": asked.bench.name, "rate_hz": round(1.0 / watch.sample_time, 6)}
        about |= {"balances": list(watch.balances), "false_alarms_per_hour": asked.false_alarms}
        said = "learning what is normal" if len(watch.balances) == 2 else f"learning, without {PRESSURE}"
        self._line("start", self.began, **about, message=said)
        if self._armed:
            self._ready(self.began, watch.thresholds)

    @property
    def _armed(self) -> bool:
        return self.watch is not None and any(value < float("inf") for value in self.watch.thresholds)

    def _ready(self, time: float, thresholds: Sequence[float]) -> None:
        named = dict(zip(self.watch.balances, thresholds, strict=True)) if self.watch else {}
        self._line("ready", time, thresholds=named, message="alarms can come from here on")

    def events(self, events: "Sequence[Event]") -> None:
        from faults.watch.events import Alarm, Ready

        for event in events:
            if isinstance(event, Ready):
                self._ready(event.time, event.thresholds)
            elif isinstance(event, Alarm):
                self.alarms += 1
                said = f"the {event.balance} balance has changed since {event.since:.2f} s"
                self._line("alarm", event.time, **_alarm(event), message=said)
            else:
                lost = dict(zip(("before", "after"), event.lost or (None, None), strict=True))
                about = {
                    "lost_flow_percent": {when: None if one is None else 100.0 * one for when, one in lost.items()},
                    "pressure_change_percent": None if event.pressure is None else 100.0 * event.pressure,
                }
                self._line("change", event.time, **_alarm(event.alarm), **about, message=_reading(event))

    def end(self, outcome: str, message: str) -> None:
        if self.watch is not None:
            seconds = self.watch.last - self.began
            message = message or f"{self.alarms} alarms in {seconds:.1f} s"
            if outcome == "ok" and not self._armed:
                message += "; the stream ended before enough was learnt, so no alarm could come"
        time = None if self.watch is None else self.watch.last
        self._line("end", time, outcome=outcome, alarms=self.alarms, message=message)

    def _line(self, event: str, time: float | None, **entries: Any) -> None:
        emit(json.dumps(plain({"event": event, "time_s": _rounded(time), **entries}), allow_nan=False))


def _rounded(time: float | None) -> float | None:
    """Return a time to the microsecond, as far as any logger's clock goes [s]."""
    return None if time is None else round(time, 6)


def _alarm(alarm: "Alarm") -> dict[str, Any]:
    return {
        "balance": alarm.balance,
        "since_s": _rounded(alarm.since),
        "since_ci95_s": [_rounded(end) for end in alarm.interval],
        "score": alarm.score,
        "threshold": alarm.threshold,
    }


def _reading(event: "Change") -> str:
    if event.lost is None or event.pressure is None:
        return f"without {PRESSURE} it cannot be said what has changed"
    before, after = (f"{100.0 * one:.0f} %" for one in event.lost)
    return (
        f"flow lost: {before} of what the pump delivers before, {after} after; "
        f"differential pressure at the same velocity {100.0 * event.pressure:+.0f} %"
    )


def _file(told: _Told, path: Path, asked: _Asked) -> None:
    record = _read(path, asked)
    samples, pressure = _samples(record.channels, record.sample_time, str(path))
    watch = asked.watch(record.sample_time, pressure, record.start_time)
    told.start(str(path), watch, asked)
    told.events(watch.take(samples))


def _network(told: _Told, address: str, asked: _Asked, state: Path | None) -> None:
    received = Received()
    try:
        _stream(told, stream_lines(address, received), asked, address, state)
    finally:
        for count, said in (
            (received.lost, "never came"),
            (received.late, "came late or twice"),
            (received.dropped, "found no room to wait"),
        ):
            if count:
                note(f"{address}: warning: {count} batches {said} beside {received.batches} that were read")


def _stream(told: _Told, lines: Iterable[str], asked: _Asked, source: str, state: Path | None) -> None:
    import numpy as np

    from faults.watch.saved import save_watch
    from plant.log.csv_stream import CsvStream

    rest = iter(lines)
    header = next((line for line in rest if line.strip()), "")

    def opened(mapping: Mapping[str, str]) -> CsvStream:
        return CsvStream(chain([header], rest), mapping, source=source)

    stream = _noted(source, lambda: with_rig_columns(opened, asked.bench.columns, asked.columns))
    _, pressure = _samples(dict.fromkeys(stream.channels, np.empty(0)), stream.sample_time, source)
    watch, travelled = _begun(asked, stream.sample_time, pressure, stream.start_time, source, state)
    T = watch.sample_time
    told.start(source, watch, asked)
    kept = watch.last
    try:
        for last, rows, gap in stream.samples(watch.block):
            channels = dict(zip(stream.channels, rows.T, strict=True))
            samples, _ = _samples(channels, T, source, travelled)
            if "position_m" not in channels:
                travelled += float(np.nansum(channels["velocity_m_s"])) * T
            if gap:
                watch.interrupt()
                note(f"{source}: warning: rows are missing before {last:g} s, so what is normal is learnt again")
            watch.clock_reads(last - (len(rows) - 1) * T)
            told.events(watch.take(samples))
            if state is not None and watch.last - kept > SAVED_EVERY:
                kept = watch.last
                save_watch(watch, state, travelled)
    finally:
        if state is not None:
            save_watch(watch, state, travelled)
    if stream.cut:
        note(f"{source}: warning: the last row is cut short and left out")


def _begun(
    asked: _Asked, sample_time: float, pressure: bool, start: float, source: str, state: Path | None
) -> "tuple[Watch, float]":
    """Return a watch, continued where there is a state of one, and how far the piston had come [m]."""
    if state is None or not state.exists():
        return asked.watch(sample_time, pressure, start), 0.0
    import numpy as np

    from faults.watch.saved import load_state
    from plant.log.csv_stream import LONGEST_GAP

    remembered, kept_time, travelled = load_state(state)
    if abs(kept_time / sample_time - 1.0) > SAME_RATE:
        raise LogError(f"{state} is of {1.0 / kept_time:g} Hz, the stream has {1.0 / sample_time:g} Hz", source)
    watch = replace(asked, healthy=None).watch(kept_time, pressure, start)
    watch.resume(remembered)
    missing = round((start - watch.last) / kept_time)
    if 0 <= missing * kept_time <= LONGEST_GAP:
        watch.take(np.full((missing, 3), np.nan))
    else:
        watch.interrupt()
        note(f"{source}: warning: the stream does not go on at {watch.last:g} s, so what is normal is learnt again")
    return watch, travelled


def _samples(
    channels: "Mapping[str, NDArray[np.float64]]", sample_time: float, source: str, travelled: float = 0.0
) -> "tuple[NDArray[np.float64], bool]":
    from faults.watch.samples import watched_samples

    try:
        return watched_samples(channels, sample_time, travelled)
    except LogError as error:
        raise LogError(error.message, source) from error


def _read(path: Path, asked: _Asked) -> "Record":
    return _noted(str(path), lambda: read_log(path, asked.bench.columns, asked.columns))


def _noted(source: str, read: Callable[[], T]) -> T:
    """Return what is read; what the reader should know of it goes to standard error."""
    with caught() as said:
        found = read()
    for one in distinct(warning.note for warning in said):
        note(f"{source}: warning: {one}")
    return found
