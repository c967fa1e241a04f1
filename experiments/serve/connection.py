"""Connections with timeouts: slow headers, unread request bodies, clients that do not read, too many connections."""

import asyncio
import resource
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

HEADERS_TIMEOUT = 10.0
"""Longest time for the headers of a request, or for a body that the server does not read [s]."""

READ_TIMEOUT = 30.0
"""Longest time that a client may leave a response unread [s]."""

MOST_CONNECTIONS = 512
"""Largest number of connections, fewer if the system allows fewer files [count]."""

ALL_SENT = "all_sent"
"""Entry of a request's state: its client has sent all, so it has left or only listens."""

FULL_RESPONSE = b"HTTP/1.1 429 Too Many Requests\r\nretry-after: 5\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"

TIMEOUT_RESPONSE = b"HTTP/1.1 408 Request Timeout\r\ncontent-length: 0\r\nconnection: close\r\n\r\n"


def most_connections() -> int:
    """Return the largest number of open connections [count]; each may need one more file."""
    allowed, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return MOST_CONNECTIONS if allowed < 0 else min(MOST_CONNECTIONS, max(allowed // 2 - 32, 8))


class PatientProtocol(H11Protocol):
    """HTTP/1.1 of uvicorn with timeouts; uvicorn alone waits forever."""

    _headers_due: asyncio.TimerHandle | None = None
    _reading_due: asyncio.TimerHandle | None = None
    _all_sent = False

    def connection_made(self, transport: Any) -> None:
        """Accept a connection, or reply that there are too many."""
        super().connection_made(transport)
        if len(self.connections) > most_connections():
            transport.write(FULL_RESPONSE)
            transport.close()
            return
        self._update_timer()

    def data_received(self, data: bytes) -> None:
        """Receive data from the client."""
        if self.transport.is_closing():
            return
        super().data_received(data)
        self._update_timer()

    def eof_received(self) -> bool:  # pyright: ignore[reportIncompatibleMethodOverride] -- asyncio's own type
        """Answer a client that has sent all and only listens now; return whether the connection stays open."""
        if self.transport.is_closing():
            return False
        self._all_sent = True
        if self._is_answering():
            self.scope.setdefault("state", {})[ALL_SENT] = True  # an endless answer may stop: hardly anyone listens
        if self.conn.their_state is h11.SEND_BODY and self.conn.our_state is h11.SEND_RESPONSE:
            self.send_400_response("The body was cut off.")
        return not self.transport.is_closing() and self._is_answering()

    def on_response_complete(self) -> None:
        """End the connection after the last answer if the client has sent all."""
        super().on_response_complete()
        if self._all_sent and not self._is_answering() and not self.transport.is_closing():
            self.transport.close()

    def _is_answering(self) -> bool:
        cycle: Any = self.cycle
        return cycle is not None and not cycle.response_complete

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        for due in (self._headers_due, self._reading_due):
            if due is not None:
                due.cancel()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Start to wait for a client that does not read."""
        super().pause_writing()
        self._reading_due = self.loop.call_later(READ_TIMEOUT, self.transport.abort)

    def resume_writing(self) -> None:
        """Stop waiting, because the client reads again."""
        if self._reading_due is not None:
            self._reading_due.cancel()
            self._reading_due = None
        super().resume_writing()

    def send_400_response(self, msg: str) -> None:
        """Refuse data that are not HTTP; in the middle of a response, the connection can only be closed."""
        try:
            super().send_400_response(msg)
        except h11.LocalProtocolError:
            self.transport.abort()
        cycle: Any = self.cycle
        if cycle is not None and not cycle.response_complete:  # tell the application that the client is gone
            cycle.disconnected = True
            cycle.message_event.set()

    def _update_timer(self) -> None:
        """Start or stop the timer for headers, or for the rest of a body after the response."""
        unread = self.conn.our_state is h11.DONE and self.conn.their_state is h11.SEND_BODY
        if self.conn.their_state is h11.IDLE or unread:
            if self._headers_due is None:
                self._headers_due = self.loop.call_later(HEADERS_TIMEOUT, self._close_late)
        elif self._headers_due is not None:
            self._headers_due.cancel()
            self._headers_due = None

    def _close_late(self) -> None:
        self._headers_due = None
        if self.transport.is_closing():
            return
        if self.conn.our_state is h11.IDLE:
            self.transport.write(TIMEOUT_RESPONSE)
        self.transport.close()
