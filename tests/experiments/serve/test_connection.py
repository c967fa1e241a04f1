"""Connections end if a client is silent, does not read, or sends no HTTP; and their number is limited."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from uvicorn.config import Config
from uvicorn.server import ServerState

from experiments.serve import connection
from experiments.serve.connection import FULL_RESPONSE, TIMEOUT_RESPONSE, PatientProtocol

SOON = 0.02
"""Time limit in these tests [s]."""

Heard = list[str]
App = Callable[[Any, Any, Any], Awaitable[None]]

ASKED = b"GET / HTTP/1.1\r\nHost: bench\r\n\r\n"
POSTED = b"POST / HTTP/1.1\r\nHost: bench\r\nTransfer-Encoding: chunked\r\n\r\n"


class Wire(asyncio.Transport):
    """A transport that records what is written to it."""

    def __init__(self) -> None:
        super().__init__()
        self.written, self.closed, self.aborted = b"", False, False

    def write(self, data: Any) -> None:
        self.written += bytes(data)

    def close(self) -> None:
        self.closed = True

    def abort(self) -> None:
        self.aborted = self.closed = True

    def is_closing(self) -> bool:
        return self.closed

    def pause_reading(self) -> None: ...

    def resume_reading(self) -> None: ...


async def answers(_: Any, receive: Any, send: Any) -> None:
    """Answer slower than headers may take to come."""
    await asyncio.sleep(2.0 * SOON)
    await send({"type": "http.response.start", "status": 204, "headers": []})
    await send({"type": "http.response.body", "body": b""})
    del receive


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "HEADERS_TIMEOUT", SOON)
    monkeypatch.setattr(connection, "READ_TIMEOUT", SOON)


def connected(app: App = answers) -> tuple[PatientProtocol, Wire]:
    """Return a connection and its transport, on the running loop."""
    config = Config(app, lifespan="off", log_config=None)
    config.load()
    protocol = PatientProtocol(config, ServerState(), {}, asyncio.get_running_loop())
    wire = Wire()
    protocol.connection_made(wire)
    return protocol, wire


async def answered(wire: Wire) -> None:
    """Wait for the first that is written, however long the processor is elsewhere."""
    for _ in range(1000):
        if wire.written:
            return
        await asyncio.sleep(0.5 * SOON)


def test_a_client_that_does_not_complete_its_headers_in_time_is_refused() -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.data_received(ASKED[:20])
        await asyncio.sleep(3.0 * SOON)
        protocol.data_received(ASKED[20:])  # too late: the server no longer reads
        await asyncio.sleep(3.0 * SOON)
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.closed
    assert wire.written == TIMEOUT_RESPONSE


def test_an_answer_may_take_longer_than_the_time_limit_for_headers() -> None:
    async def said() -> bytes:
        protocol, wire = connected()
        protocol.data_received(ASKED)
        await answered(wire)
        protocol.connection_lost(None)
        return wire.written

    assert asyncio.run(said()).startswith(b"HTTP/1.1 204")


def test_a_lost_connection_gets_no_timeout_answer() -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.connection_lost(None)
        await asyncio.sleep(2.0 * SOON)
        return wire

    assert asyncio.run(said()).written == b""


def test_a_closing_connection_gets_no_timeout_answer() -> None:
    async def said() -> Wire:
        _, wire = connected()
        wire.close()
        await asyncio.sleep(2.0 * SOON)
        return wire

    assert asyncio.run(said()).written == b""


def test_a_connection_beyond_the_maximum_is_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "most_connections", lambda: 0)

    async def said() -> Wire:
        return connected()[1]

    wire = asyncio.run(said())
    assert wire.closed
    assert wire.written == FULL_RESPONSE


@pytest.mark.parametrize("reads", [False, True])
def test_only_a_client_that_does_not_read_its_answer_is_disconnected(reads: bool) -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.data_received(ASKED)
        protocol.pause_writing()
        if reads:
            protocol.resume_writing()
        await asyncio.sleep(1.5 * SOON)
        protocol.connection_lost(None)
        return wire

    assert asyncio.run(said()).aborted is not reads


def listener() -> tuple[Heard, Any]:
    """Return what an application hears, and the application, which reads a body until the client leaves."""
    heard: Heard = []

    async def listens(_: Any, receive: Any, send: Any) -> None:
        del send
        while (message := await receive())["type"] != "http.disconnect":
            heard.append("body")
        heard.append(message["type"])

    return heard, listens


def test_a_malformed_body_is_refused_and_the_application_gets_a_disconnect() -> None:
    heard, listens = listener()

    async def said() -> Wire:
        protocol, wire = connected(listens)
        protocol.data_received(POSTED)
        await asyncio.sleep(0)
        protocol.data_received(b"no length\r\n")
        await asyncio.sleep(0.5 * SOON)
        # already before the connection is lost, which would also cause the message
        assert heard[-1:] == ["http.disconnect"]
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.written.startswith(b"HTTP/1.1 400") or wire.aborted


def test_a_broken_body_after_the_answer_began_ends_the_connection() -> None:
    async def begins(_: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"half", "more_body": True})
        while (await receive())["type"] != "http.disconnect":
            pass

    async def said() -> Wire:
        protocol, wire = connected(begins)
        protocol.data_received(POSTED)
        await asyncio.sleep(0.5 * SOON)
        protocol.data_received(b"no length\r\n")
        await asyncio.sleep(0.5 * SOON)
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.aborted
    assert b"400" not in wire.written


@pytest.mark.parametrize(("files", "most"), [(-1, 512), (1024, 480), (100_000, 512), (32, 8)])
def test_the_maximum_of_connections_leaves_file_descriptors_free(
    files: int, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection.resource, "getrlimit", lambda _: (files, files))
    assert connection.most_connections() == most


def test_a_resume_without_a_pause_does_not_end_the_connection() -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.data_received(ASKED)
        protocol.resume_writing()
        await answered(wire)
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.written.startswith(b"HTTP/1.1 204")
    assert not wire.aborted


def test_noise_before_any_request_is_refused() -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.data_received(b"\x16\x03\x01 no request\r\n\r\n")
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.written.startswith(b"HTTP/1.1 400")


def test_a_client_that_sends_all_and_then_only_listens_gets_its_answer() -> None:
    async def said() -> tuple[bool, bool, Wire]:
        protocol, wire = connected()
        protocol.data_received(ASKED)
        stays = protocol.eof_received()
        await answered(wire)
        await asyncio.sleep(0)
        closed = wire.closed
        protocol.connection_lost(None)
        return stays, closed, wire

    stays, closed, wire = asyncio.run(said())
    assert stays
    assert wire.written.startswith(b"HTTP/1.1 204")
    assert closed  # no further request can come


def test_requests_sent_before_a_client_stops_sending_are_all_answered() -> None:
    async def said() -> Wire:
        protocol, wire = connected()
        protocol.data_received(ASKED * 2)
        assert protocol.eof_received()
        for _ in range(1000):
            if wire.closed:
                break
            await asyncio.sleep(0.5 * SOON)
        protocol.connection_lost(None)
        return wire

    wire = asyncio.run(said())
    assert wire.written.count(b"HTTP/1.1 204") == 2
    assert wire.closed


@pytest.mark.parametrize("sent", [b"", ASKED[:20], ASKED])
def test_a_client_that_waits_for_no_answer_is_disconnected_when_it_stops_sending(sent: bytes) -> None:
    async def said() -> bool:
        protocol, wire = connected()
        if sent:
            protocol.data_received(sent)
        if sent == ASKED:
            await answered(wire)
        stays = protocol.eof_received()
        protocol.connection_lost(None)
        return stays

    assert not asyncio.run(said())


def test_a_body_that_is_cut_off_is_refused_and_the_application_gets_a_disconnect() -> None:
    heard, listens = listener()

    async def said() -> tuple[bool, Wire]:
        protocol, wire = connected(listens)
        protocol.data_received(POSTED + b"5\r\nhalf")
        await asyncio.sleep(0)
        stays = protocol.eof_received()
        await asyncio.sleep(0.5 * SOON)
        assert heard[-1:] == ["http.disconnect"]
        protocol.connection_lost(None)
        return stays, wire

    stays, wire = asyncio.run(said())
    assert not stays
    assert wire.written.startswith(b"HTTP/1.1 400")
    assert wire.closed


def test_an_application_is_told_that_its_client_has_sent_all() -> None:
    told: list[bool] = []

    async def listens(scope: Any, _: Any, send: Any) -> None:
        told.append(connection.ALL_SENT in scope["state"])
        await asyncio.sleep(2.0 * SOON)
        told.append(connection.ALL_SENT in scope["state"])
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def said() -> None:
        protocol, wire = connected(listens)
        protocol.data_received(ASKED)
        await asyncio.sleep(0)
        protocol.eof_received()
        await answered(wire)
        protocol.connection_lost(None)

    asyncio.run(said())
    assert told == [False, True]
