"""A watch with all its outputs: each event goes to every output, and the watch's state can be queried."""

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import plain
from experiments.streams.watch_events import STATES, WatchEvents

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

SHOWN_EVENTS = 200
"""Number of events stored for a view [count]."""

Sink = Callable[[Mapping[str, Any]], None]


class Watched(WatchEvents):
    """Sends the events of a watch to every output, and keeps its state."""

    def __init__(self, source: str) -> None:
        self._lock = threading.Lock()
        self._sinks: list[Sink] = []
        self.source, self.doing = source, "connecting"
        self.last_events: deque[Mapping[str, Any]] = deque(maxlen=SHOWN_EVENTS)
        self._seen: tuple[float, float, dict[str, float]] | None = None
        super().__init__(self._send)

    def add_output(self, sink: Sink) -> None:
        """Send all future events to one more output, ahead of the earlier outputs."""
        with self._lock:
            self._sinks.insert(0, sink)

    def _send(self, entries: dict[str, Any]) -> None:
        told = plain(entries)
        with self._lock:  # so that lines do not mix
            self.doing = STATES.get(told["event"], self.doing)
            if told["event"] == "end" and told["outcome"] != "ok":
                self.doing = told["outcome"]
            self.last_events.append(told)
            for sink in self._sinks:
                sink(told)

    def process_samples(self, channels: "Mapping[str, NDArray[np.float64]]", last: float, gap: bool) -> None:
        """Process new samples: count them, and keep the last value of each channel."""
        super().process_samples(channels, last, gap)
        self._seen = last, time.time(), {name: float(values[-1]) for name, values in channels.items() if len(values)}

    def state(self) -> dict[str, Any]:
        """Return the state: ``name``, ``state``, ``gauges``, as `experiments.serve.live.Stream.state` does."""
        if self.watch is None or self._seen is None:
            return {"name": self.source, "state": self.doing, "gauges": None}
        last, received, values = self._seen
        gauges = {
            "time_s": last,
            "received": received,
            "rows": self.rows,
            "gaps": self.gaps,
            "left_out": self.left_out,
            "values": values,
            **self.nearness(),
        }
        return {"name": self.source, "state": self.doing, "gauges": plain(gauges)}
