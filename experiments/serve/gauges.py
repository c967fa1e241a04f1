"""The process of a stream: it watches the rows, and sends the server gauges a few times per second, and every event."""

import contextlib
import signal
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.command.json_output import plain
from experiments.command.options import load_rig
from experiments.command.terminal import error_sentence
from experiments.serve.process import bind_to_server
from experiments.streams.watch_events import WatchEvents
from experiments.streams.watching import WatchSettings, watch_network
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from faults.watch.events import Event

GAUGE_INTERVAL = 0.25
"""Time between two messages of gauges [s]."""


class Gauges(WatchEvents):
    """Events of a watch, and the latest readings of its channels.

    Parameters
    ----------
    out : Connection
        Receives ``("event", entries)`` and ``("gauges", entries)``.
    """

    def __init__(self, out: Connection) -> None:
        super().__init__(lambda entries: out.send(("event", plain(entries))))
        self._out = out
        self._whole = 0
        self._ends: dict[str, tuple[float, float]] = {}
        self._sent = 0.0
        self._peaks: dict[str, float] = {}

    def events(self, events: "Sequence[Event]") -> None:
        """Report new events; after an alarm, a balance restarts at once, and its peak is reported once."""
        from faults.watch.events import Alarm

        super().events(events)
        self._peaks |= {event.balance: event.score for event in events if isinstance(event, Alarm)}

    def process_samples(self, channels: "Mapping[str, NDArray[np.float64]]", last: float, gap: bool) -> None:
        """Process samples; every `GAUGE_INTERVAL`, report the range of each channel since the last report."""
        import numpy as np

        super().process_samples(channels, last, gap)
        missing = 0
        for name, values in channels.items():
            there = values[np.isfinite(values)]
            missing = max(missing, len(values) - len(there))
            if len(there):
                low, high = self._ends.get(name, (np.inf, -np.inf))
                self._ends[name] = min(low, float(there.min())), max(high, float(there.max()))
        self._whole += max((len(values) for values in channels.values()), default=0) - missing
        now = time.monotonic()
        if now - self._sent < GAUGE_INTERVAL:
            return
        self._sent = now
        self.flush(last, {name: float(values[-1]) for name, values in channels.items()})

    def flush(self, last: float, values: Mapping[str, float]) -> None:
        """Report the gauges now.

        Parameters
        ----------
        last : float
            Stream time [s].
        values : Mapping[str, float]
            Current reading of each channel [SI].
        """
        if self.watch is None:
            return
        near = self.nearness()
        near["scores"] |= self._peaks
        told = {
            "time_s": last,
            "rows": self._whole,
            "gaps": self.gaps,
            "left_out": self.left_out,
            "values": dict(values),
            "low": {name: low for name, (low, _) in self._ends.items()},
            "high": {name: high for name, (_, high) in self._ends.items()},
            **near,
        }
        self._out.send(("gauges", plain(told)))
        self._ends, self._peaks = {}, {}


@dataclass(frozen=True)
class StreamTask:
    """A stream to be watched.

    Parameters
    ----------
    address : str
        In the form of `plant.log.stream.source.stream_lines`.
    rig : Path or None
        Rig file.
    columns : tuple of tuple
        Pairs of channel and foreign column.
    false_alarms : float
        Rate during healthy, moving operation [1/h].
    state : Path
        File that keeps the state of the watch over a restart.
    """

    address: str
    rig: Path | None
    columns: tuple[tuple[str, str], ...]
    false_alarms: float
    state: Path


def watch_stream(out: Connection, server: int, task: StreamTask) -> None:
    """Watch a stream until it ends, in its own process.

    Parameters
    ----------
    out : Connection
        Connection to the server.
    server : int
        Process ID of the server; this process ends with it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    bind_to_server(server)
    told, outcome, said = Gauges(out), "failed", ""
    with contextlib.suppress(BrokenPipeError):
        try:
            settings = WatchSettings(load_rig(task.rig), dict(task.columns), task.false_alarms, renew=True)
            watch_network(told, task.address, settings, task.state)
            outcome = "ok"
        except HydrostateError as error:
            said = str(error)
        except Exception as error:  # the server goes on, and reports why this stream stopped
            said = error_sentence(error)
        if told.watch is not None:
            told.flush(told.watch.last, {})
        told.end(outcome, said)
    out.close()
