"""The verb `hydrostate watch`: turns rows into samples, and passes the samples to a watch."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.command.logs import read_and_warn, read_log
from experiments.command.options import PRESSURE
from experiments.command.terminal import note
from experiments.streams.rows import open_rows, report_left_out_rows, warn_of_cut_row, warn_of_lost_batches
from experiments.streams.state_file import require_same_rate, save_at_intervals
from experiments.streams.watch_events import WatchEvents
from plant.errors import HydrostateError, LogError
from plant.log.stream.source import BatchCounts, stream_lines

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from faults.watch.watch import Watch
    from plant.eha.rig import Rig
    from plant.log.record import Record

LEARNING = 120.0
"""Default duration of healthy running before alarms are possible [s]. A copy of `faults.watch.watch.LEARNING`, so that
a help text need not import it."""


@dataclass(frozen=True)
class WatchSettings:
    """Settings of a watch on a stream.

    Parameters
    ----------
    columns : Mapping[str, str]
        Foreign column by channel.
    false_alarms : float
        Rate during healthy, moving operation [1/h].
    learning : float
        Healthy running before alarms are possible [s].
    healthy : Path or None
        A healthy log from which to learn first.
    renew : bool
        Whether learning starts again if the state file does not fit, as where nobody can be asked to delete it.
    """

    rig: "Rig"
    columns: Mapping[str, str]
    false_alarms: float
    learning: float = LEARNING
    healthy: Path | None = None
    no_pressure: bool = False
    renew: bool = False

    def watch(self, sample_time: float, pressure: bool, start: float) -> "Watch":
        """Return the watch, which has already learnt the healthy log.

        Parameters
        ----------
        sample_time : float
            Time between samples [s].
        pressure : bool
            Whether differential pressure is logged.
        start : float
            Time of the first sample [s].

        Raises
        ------
        LogError
            If the healthy log does not match the stream.
        """
        from faults.watch.events import Alarm
        from faults.watch.watch import Watch
        from plant.log.stream.csv_rows import SAME_RATE

        way: Any = {"false_alarms": self.false_alarms, "learning": self.learning, "start": start}
        made = Watch(self.rig.parameters, sample_time, pressure=pressure and not self.no_pressure, **way)
        if self.healthy is not None:
            record = _read(self.healthy, self)
            if abs(record.sample_time / sample_time - 1.0) > SAME_RATE:
                raise LogError(
                    f"{self.healthy}: the healthy log must have the sample rate of the stream, {1.0 / sample_time:g} "
                    f"Hz, got {1.0 / record.sample_time:g} Hz"
                )
            samples, logged = _samples(record.channels, record.sample_time, str(self.healthy))
            if "motion" not in made.balances and not logged:
                raise LogError(f"{self.healthy}: the healthy log must have {PRESSURE}, as the stream has")
            alarms = sum(isinstance(event, Alarm) for event in made.take(samples))
            if alarms:
                note(f"{self.healthy}: warning: {alarms} alarms in this healthy log")
            made.interrupt()
            made.clock_reads(start)
        return made


def watch_file(told: WatchEvents, path: Path, settings: WatchSettings) -> None:
    """Watch a log as if its rows arrived now.

    Raises
    ------
    LogError
        If it cannot be read or watched.
    """
    record = _read(path, settings)
    samples, pressure = _samples(record.channels, record.sample_time, str(path))
    watch = settings.watch(record.sample_time, pressure, record.start_time)
    told.start(str(path), watch, settings.rig.name, settings.false_alarms)
    told.events(watch.take(samples))


def watch_network(told: WatchEvents, address: str, settings: WatchSettings, state: Path | None) -> None:
    """Watch a network stream until it ends.

    Parameters
    ----------
    address : str
        In the form of `plant.log.stream.source.stream_lines`.
    state : Path or None
        File that keeps the state of the watch over a restart.

    Raises
    ------
    HydrostateError
        If no source answers there, or the data cannot be watched.
    """
    received = BatchCounts()
    try:
        watch_rows(told, stream_lines(address, received), settings, address, state)
    finally:
        warn_of_lost_batches(address, received)


def watch_rows(
    told: WatchEvents, lines: Iterable[str], settings: WatchSettings, source: str, state: Path | None
) -> None:
    """Watch a header and rows as they arrive.

    Parameters
    ----------
    source : str
        Name of the stream in errors.
    state : Path or None
        File that keeps the state of the watch over a restart.

    Raises
    ------
    LogError
        If too many rows are garbage, or the stream cannot be watched.
    """
    import numpy as np

    from faults.watch.saved import save_watch

    stream = open_rows(lines, settings.rig.columns, settings.columns, source)
    _, pressure = _samples(dict.fromkeys(stream.channels, np.empty(0)), stream.sample_time, source)
    watch, travelled = _begin_or_resume(settings, stream.sample_time, pressure, stream.start_time, source, state)
    T = watch.sample_time
    told.start(source, watch, settings.rig.name, settings.false_alarms)

    def save(path: Path) -> None:
        save_watch(watch, path, travelled)

    with report_left_out_rows(stream, source), save_at_intervals(state, save, watch.last) as save_if_due:
        for last, rows, gap in stream.samples(watch.block):
            channels = dict(zip(stream.channels, rows.T, strict=True))
            samples, _ = _samples(channels, T, source, travelled)
            if "position_m" not in channels:
                travelled += float(np.nansum(channels["velocity_m_s"])) * T
            if gap:
                watch.interrupt()
                note(f"{source}: warning: rows are missing before {last:g} s, so learning starts again")
            watch.clock_reads(last - (len(rows) - 1) * T)
            told.left_out = stream.left_out
            told.events(watch.take(samples))
            told.process_samples(channels, last, gap)
            save_if_due(watch.last)
    warn_of_cut_row(stream, source)


def _begin_or_resume(
    settings: WatchSettings, sample_time: float, pressure: bool, start: float, source: str, state: Path | None
) -> "tuple[Watch, float]":
    """Return a watch, resumed from its state file if there is one, and the piston travel so far [m]."""
    if state is None or not state.exists():
        return settings.watch(sample_time, pressure, start), 0.0
    try:
        return _resume(settings, sample_time, pressure, start, source, state)
    except HydrostateError as error:
        if not settings.renew:
            raise
        note(f"{source}: warning: {error}; so learning starts again")
        return settings.watch(sample_time, pressure, start), 0.0


def _resume(
    settings: WatchSettings, sample_time: float, pressure: bool, start: float, source: str, state: Path
) -> "tuple[Watch, float]":
    """Return the watch that a state file continues, and the piston travel so far [m]."""
    import numpy as np

    from faults.watch.saved import load_state
    from plant.log.stream.csv_rows import LONGEST_GAP

    remembered, kept_time, travelled = load_state(state)
    require_same_rate(state, kept_time, sample_time, source)
    watch = replace(settings, healthy=None).watch(kept_time, pressure, start)
    watch.resume(remembered)
    missing = round((start - watch.last) / kept_time)
    if 0 <= missing * kept_time <= LONGEST_GAP:
        watch.take(np.full((missing, 3), np.nan))
    else:
        watch.interrupt()
        note(f"{source}: warning: the stream does not continue at {watch.last:g} s, so learning starts again")
        watch.clock_reads(start)  # otherwise times would continue from the previous stream
    return watch, travelled


def _samples(
    channels: "Mapping[str, NDArray[np.float64]]", sample_time: float, source: str, travelled: float = 0.0
) -> "tuple[NDArray[np.float64], bool]":
    from faults.watch.samples import watched_samples

    try:
        return watched_samples(channels, sample_time, travelled)
    except LogError as error:
        raise LogError(error.message, source) from error


def _read(path: Path, settings: WatchSettings) -> "Record":
    return read_and_warn(str(path), lambda: read_log(path, settings.rig.columns, settings.columns))
