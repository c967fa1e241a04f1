"""Bodies that are too large, slow, empty or cut leave nothing behind; permission is checked first."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest

from experiments.serve import limits
from experiments.serve.limits import Guard, RefusedError, receive_file
from experiments.serve.settings import Settings
from plant.errors import HydrostateError


async def chunks(*parts: bytes, pause: float = 0.0) -> AsyncIterator[bytes]:
    for part in parts:
        await asyncio.sleep(pause)
        yield part


def received(body: AsyncIterator[bytes], path: Path, most: int = 100, room: int = 100) -> int:
    return asyncio.run(receive_file(body, path, most, room))


def test_the_chunks_of_a_body_are_written_in_order(tmp_path: Path) -> None:
    assert received(chunks(b"ab", b"", b"c"), tmp_path / "a") == 3
    assert (tmp_path / "a").read_bytes() == b"abc"


@pytest.mark.parametrize(
    ("parts", "most", "room", "status"),
    [((b"x" * 60, b"x" * 60), 100, 1000, 413), ((b"x" * 60, b"x" * 60), 1000, 100, 413), ((), 100, 100, 422)],
)
def test_a_refused_body_leaves_no_file(
    tmp_path: Path, parts: tuple[bytes, ...], most: int, room: int, status: int
) -> None:
    with pytest.raises(RefusedError) as refused:
        received(chunks(*parts), tmp_path / "a", most, room)
    assert refused.value.status == status
    assert not list(tmp_path.iterdir())


def test_a_body_that_stops_or_is_too_slow_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "IDLE_TIME", 0.05)
    with pytest.raises(RefusedError, match="stopped coming"):
        received(chunks(b"a", b"b", pause=0.2), tmp_path / "a")
    monkeypatch.setattr(limits, "IDLE_TIME", 60.0)  # on a busy machine, much time may pass between two bytes
    monkeypatch.setattr(limits, "GRACE", 0.05)
    with pytest.raises(RefusedError, match="too slowly"):
        received(chunks(*[b"a"] * 20, pause=0.02), tmp_path / "a")
    assert not list(tmp_path.iterdir())


def test_a_body_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match="takes no more") as refused:
        received(chunks(b"a"), tmp_path / "missing" / "a")
    assert refused.value.status == 413


@pytest.mark.parametrize("token", [None, "short", "sixteen-létters-!"])
def test_a_host_reachable_by_others_needs_a_token_of_16_ascii_characters(tmp_path: Path, token: str | None) -> None:
    with pytest.raises(HydrostateError, match="token"):
        Settings(folder=tmp_path, host="192.168.0.7", token=token)
    assert Settings(folder=tmp_path, host="192.168.0.7", token="0123456789abcdef").token  # noqa: S106


def guarded(app: Any, folder: Path, **settings: Any) -> tuple[Guard, list[dict[str, Any]], Any]:
    """Return a guard, the messages that it sends, and a function that requests a page from it."""
    guard, sent = Guard(app, Settings(folder=folder, **settings)), list[dict[str, Any]]()

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    scope = {"type": "http", "method": "GET", "path": "/", "query_string": b"", "headers": [(b"host", b"localhost")]}
    return guard, sent, lambda: guard(scope, receive, send)


def test_a_request_beyond_the_maximum_gets_status_429_and_the_others_an_answer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "MOST_REQUESTS", 1)
    waiting = asyncio.Event()

    async def slow(_scope: Any, _receive: Any, send: Any) -> None:
        await waiting.wait()
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def both() -> list[int]:
        _, sent, ask = guarded(slow, tmp_path)
        first = asyncio.ensure_future(ask())
        await asyncio.sleep(0.0)
        await ask()
        waiting.set()
        await first
        await ask()
        return [message["status"] for message in sent if message["type"] == "http.response.start"]

    assert asyncio.run(both()) == [429, 204, 204]


def test_a_refusal_after_an_answer_has_begun_sends_no_second_answer(tmp_path: Path) -> None:
    async def half(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        raise RefusedError(408, "too late")

    _, sent, ask = guarded(half, tmp_path)
    asyncio.run(ask())
    assert [message["type"] for message in sent] == ["http.response.start"]


def test_a_request_with_two_statements_of_its_length_is_refused_and_its_connection_ends(tmp_path: Path) -> None:
    async def taken(_scope: Any, _receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    guard, sent, _ = guarded(taken, tmp_path)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message: Any) -> None:
        sent.append(message)

    lengths = [(b"content-length", b"6"), (b"transfer-encoding", b"chunked")]
    for told in (lengths[:1], lengths[1:], lengths):
        headers = [(b"host", b"localhost"), *told]
        asyncio.run(
            guard(
                {"type": "http", "method": "POST", "path": "/", "query_string": b"", "headers": headers}, receive, send
            )
        )
    starts = [message for message in sent if message["type"] == "http.response.start"]
    assert [start["status"] for start in starts] == [204, 204, 400]
    assert [(b"connection", b"close") in start["headers"] for start in starts] == [False, False, True]
