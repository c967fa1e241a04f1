"""A metrics page for a watch, in the format of Prometheus."""

import threading
import time
from collections.abc import Generator
from contextlib import contextmanager

from experiments.command.terminal import note
from experiments.serve.metrics import PROMETHEUS_TEXT, exposition
from experiments.streams.watched import Watched
from plant.errors import HydrostateError

LOOPBACK = "127.0.0.1"
"""Default address for metrics."""


def endpoint(text: str) -> tuple[str, int]:
    """Return host and port from ``PORT`` or ``HOST:PORT``.

    Parameters
    ----------
    text : str
        As the user writes it; an IPv6 address is in brackets.

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
def serve_metrics(where: str, told: Watched) -> Generator[int]:
    """Answer ``GET /metrics`` with the metrics of a watch; yield the port.

    Parameters
    ----------
    where : str
        In the form of `endpoint`; port 0 selects a free one.

    Raises
    ------
    HydrostateError
        If no server can listen there.
    """
    from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer  # no other verb needs it

    class Answer(BaseHTTPRequestHandler):
        timeout = 10.0  # a silent client holds a thread no longer than this [s]

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
            """Do not log requests."""

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
