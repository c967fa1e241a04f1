"""Where a watch tells what it sees beside its JSON lines: a broker, and a page of metrics for Prometheus."""

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from experiments.command.json_output import plain
from experiments.command.terminal import note
from experiments.serve.metrics import PROMETHEUS_TEXT, exposition
from experiments.streams.watch_events import WatchEvents
from plant.errors import HydrostateError, LogError
from plant.log.stream_source import broker_of, broker_package

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LOOPBACK = "127.0.0.1"
"""Where metrics are offered unless told."""

SHOWN_EVENTS = 200
"""Events that are remembered for a view [count]."""

PATIENCE = 5.0
"""How long the last messages to a broker may take [s]."""

STATES: Mapping[str, str] = {"start": "learning", "ready": "watching", "end": "ended"}
"""What a watch does from an event on."""

Sink = Callable[[Mapping[str, Any]], None]


class Watched(WatchEvents):
    """What a watch tells, sent to every output, and how it stands meanwhile.

    Parameters
    ----------
    source : str
        Where the rows come from.
    """

    def __init__(self, source: str) -> None:
        self._lock = threading.Lock()
        self._sinks: list[Sink] = []
        self.source, self.doing = source, "connecting"
        self.last_events: deque[Mapping[str, Any]] = deque(maxlen=SHOWN_EVENTS)
        self._gaps = 0
        self._seen: tuple[float, float, dict[str, float]] | None = None
        super().__init__(self._send)

    def to(self, sink: Sink) -> None:
        """Send every event from here on to one more output, before those that were there.

        Parameters
        ----------
        sink : callable
            Takes the entries of an event.
        """
        with self._lock:
            self._sinks.insert(0, sink)

    def _send(self, entries: dict[str, Any]) -> None:
        told = plain(entries)
        with self._lock:  # a line is whole before the next begins
            self.doing = STATES.get(told["event"], self.doing)
            if told["event"] == "end" and told["outcome"] != "ok":
                self.doing = told["outcome"]
            self.last_events.append(told)
            for sink in self._sinks:
                sink(told)

    def saw(self, channels: "Mapping[str, NDArray[np.float64]]", last: float, gap: bool) -> None:
        """Take notice of samples: they are counted, and the last of each channel is kept.

        Parameters
        ----------
        channels : Mapping[str, ndarray], shape (n,) each
            Samples by channel [SI].
        last : float
            Time of the last one [s].
        gap : bool
            Whether rows are missing before them.
        """
        super().saw(channels, last, gap)
        self._gaps += gap
        self._seen = last, time.time(), {name: float(values[-1]) for name, values in channels.items() if len(values)}

    def state(self) -> dict[str, Any]:
        """Return how it stands: ``name``, ``state``, ``gauges``, as `experiments.serve.live.Stream.state` does."""
        if self.watch is None or self._seen is None:
            return {"name": self.source, "state": self.doing, "gauges": None}
        last, received, values = self._seen
        gauges = {
            "time_s": last,
            "received": received,
            "rows": self.rows,
            "gaps": self._gaps,
            "values": values,
            "scores": dict(zip(self.watch.balances, self.watch.scores, strict=True)),
            "thresholds": dict(zip(self.watch.balances, self.watch.thresholds, strict=True)),
        }
        return {"name": self.source, "state": self.doing, "gauges": plain(gauges)}


@contextmanager
def published(address: str) -> Generator[Sink]:
    """Publish every event at a broker, as the same JSON object that the line is.

    A broker that goes away does not end the watch: what it missed is sent when it is back.

    Parameters
    ----------
    address : str
        ``mqtt://HOST[:PORT]/TOPIC``.

    Raises
    ------
    HydrostateError
        If it is no such address, or the package for MQTT is missing.
    LogError
        If no broker answers there.
    """
    host, port, topic = broker_of(address)
    mqtt, version = broker_package(address)
    client = mqtt.Client(version.VERSION2)
    try:
        client.connect(host, port)
    except OSError as error:
        raise LogError(f"no broker answers: {error.strerror or error}", address) from error
    client.loop_start()
    waiting: deque[Any] = deque(maxlen=SHOWN_EVENTS)

    def publish(entries: Mapping[str, Any]) -> None:
        waiting.append(client.publish(topic, json.dumps(entries, allow_nan=False), qos=1))

    try:
        yield publish
    finally:
        until = time.monotonic() + PATIENCE
        while any(not one.is_published() for one in waiting) and time.monotonic() < until:
            time.sleep(0.01)
        unsent = sum(not one.is_published() for one in waiting)
        if unsent:
            note(f"{address}: warning: {unsent} events did not reach the broker")
        client.disconnect()
        client.loop_stop()


def endpoint(text: str) -> tuple[str, int]:
    """Return host and port of ``PORT`` or ``HOST:PORT``.

    Parameters
    ----------
    text : str
        As a user writes it; an IPv6 address stands in brackets.

    Raises
    ------
    HydrostateError
        If it is neither.

    Examples
    --------
    >>> endpoint("9464"), endpoint("0.0.0.0:9464")
    (('127.0.0.1', 9464), ('0.0.0.0', 9464))
    """
    host, _, port = text.rpartition(":")
    if not (port.isdecimal() and int(port) < 1 << 16) or text.startswith(":"):
        raise HydrostateError(f"--metrics must be PORT or HOST:PORT, a port up to 65535, got {text!r}")
    return host.strip("[]") or LOOPBACK, int(port)


@contextmanager
def metrics_offered(where: str, told: Watched) -> Generator[int]:
    """Answer ``GET /metrics`` with the metrics of a watch; yield the port.

    Parameters
    ----------
    where : str
        As `endpoint` takes it; port 0 takes a free one.
    told : Watched
        The watch.

    Raises
    ------
    HydrostateError
        If nothing can be offered there.
    """
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer  # which no other verb needs

    class Answer(BaseHTTPRequestHandler):
        timeout = 10.0  # a client that says nothing holds no thread for longer [s]

        def do_GET(self) -> None:
            """Answer one request."""
            found = self.path.split("?")[0] == "/metrics"
            text = exposition({}, None, [(told.state(), told.alarms)], time.time()) if found else "see /metrics\n"
            body = text.encode()
            self.send_response(200 if found else 404)
            self.send_header("Content-Type", PROMETHEUS_TEXT if found else "text/plain; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *_: object) -> None:  # noqa: A002 - the name that the base class gives it
            """Say nothing of each request."""

    try:
        server = ThreadingHTTPServer(endpoint(where), Answer)
    except OSError as error:
        raise HydrostateError(f"--metrics {where}: cannot be offered there: {error.strerror or error}") from error
    server.daemon_threads = True
    port = int(server.server_address[1])
    note(f"metrics at http://{server.server_address[0]}:{port}/metrics")
    with server:
        answering = threading.Thread(target=server.serve_forever, name="metrics", daemon=True)
        answering.start()
        try:
            yield port
        finally:
            server.shutdown()
            answering.join()
