"""`run_server(settings, say)`: listens, answers until asked to end, and releases the folder."""

import errno
import gc
import logging
import socket
import sys
from collections.abc import Callable
from urllib.parse import quote

import uvicorn

from experiments.serve.app import make_app
from experiments.serve.connection import PatientProtocol
from experiments.serve.settings import Settings
from plant.errors import HydrostateError

SHUTDOWN_WAIT = 3
"""Longest wait at the end for responses in progress [s]."""

LONGEST_HEADERS = 32 << 10
"""Largest size of the headers of a request [bytes]."""

GARBAGE_THRESHOLD = 10_000
"""Garbage collector threshold, in objects allocated minus freed. It is lower than for a command, as a server must not
grow."""

BACKLOG = 512
"""Connections that may wait to be accepted [count]."""


def run_server(settings: Settings, say: Callable[[str], None]) -> None:
    """Serve until the process is asked to end.

    Parameters
    ----------
    settings : Settings
        Settings of the server.
    say : callable
        Called with the address once the server listens.

    Raises
    ------
    HydrostateError
        If it cannot listen there, or cannot use the folder.
    """
    logging.getLogger("uvicorn.error").setLevel(logging.CRITICAL)  # the application reports errors
    gc.freeze()
    gc.set_threshold(GARBAGE_THRESHOLD)
    refusals: list[HydrostateError] = []
    app = make_app(settings, refusals.append)
    with _listening_socket(settings) as listener:
        config = uvicorn.Config(
            app,
            http=PatientProtocol,
            ws="none",
            loop="asyncio",
            log_config=None,
            access_log=False,
            server_header=False,
            proxy_headers=False,
            backlog=BACKLOG,
            timeout_keep_alive=5,
            timeout_graceful_shutdown=SHUTDOWN_WAIT,
            h11_max_incomplete_event_size=LONGEST_HEADERS,
        )
        server = _ReportingServer(config, lambda: say(_address(settings, listener)))
        try:
            server.run(sockets=[listener])
        except SystemExit:
            if not refusals:
                raise
        if refusals:
            raise refusals[0]


ANY_HOST = ("0.0.0.0", "::")  # noqa: S104 - hosts that another machine cannot open under this name


class _ReportingServer(uvicorn.Server):
    """A server that reports when it listens."""

    def __init__(self, config: uvicorn.Config, say: Callable[[], None]) -> None:
        super().__init__(config)
        self._say = say

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started and not self.should_exit:
            self._say()


def _listening_socket(settings: Settings) -> socket.socket:
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((settings.host, settings.port))
        listener.listen(BACKLOG)
    except OSError as error:
        listener.close()
        taken = "; another server listens there" if error.errno == errno.EADDRINUSE else ""
        host = f"[{settings.host}]" if ":" in settings.host else settings.host
        raise HydrostateError(f"{host}:{settings.port}: cannot listen there: {error.strerror}{taken}") from error
    return listener


def _address(settings: Settings, listener: socket.socket) -> str:
    port = listener.getsockname()[1]
    name = socket.gethostname() if settings.host in ANY_HOST else settings.host
    host = f"[{name}]" if ":" in name else name
    token = f"?token={quote(settings.token, safe='')}" if settings.token else ""
    sys.stdout.flush()
    return f"{settings.url.rstrip('/')}/{token}" if settings.url else f"http://{host}:{port}/{token}"
