"""Server-sent events of a stream: new data a few times per second, as long as a client is connected."""

import asyncio
import json
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

from experiments.serve.gauges import GAUGE_INTERVAL
from experiments.serve.live import Stream, Streams

MOST_STREAM_VIEWS = 64
"""Largest number of open views of streams [count]."""

KEEP_ALIVE_INTERVAL = 15.0
"""Longest time without a message, even if there is nothing new [s]."""


def message(event: str, data: Any) -> bytes:
    r"""Return one server-sent event.

    Examples
    --------
    >>> message("state", {"a": 1})
    b'event: state\ndata: {"a":1}\n\n'
    """
    return f"event: {event}\ndata: {json.dumps(data, separators=(',', ':'), allow_nan=False)}\n\n".encode()


async def event_stream(stream: Stream, streams: Streams, gone: Callable[[], Awaitable[bool]]) -> AsyncIterator[bytes]:
    """Yield the server-sent events of a stream.

    Parameters
    ----------
    streams : Streams
        Counts who looks.
    gone : callable
        Says whether the client has gone.

    Yields
    ------
    bytes
        ``history`` first, then ``gauges`` and ``state`` as they come.
    """
    streams.looking += 1
    try:
        number, fresh = stream.revision
        history = stream.since(0)
        events = await asyncio.to_thread(stream.events)
        # a browser's clock may differ: the age of the last gauges is told by the server's
        yield message("history", {**stream.state, "history": history, "events": events, "now": time.time()})
        spoke = time.monotonic()
        while not await gone():
            await asyncio.sleep(GAUGE_INTERVAL)
            latest, changed = stream.revision
            if changed != fresh:
                fresh = changed
                yield message("state", {**stream.state, "events": await asyncio.to_thread(stream.events)})
                spoke = time.monotonic()
            if latest != number:
                new, number = stream.since(number), latest
                for one in new:
                    yield message("gauges", one)
                spoke = time.monotonic()
            if time.monotonic() - spoke > KEEP_ALIVE_INTERVAL:
                yield b": still here\n\n"
                spoke = time.monotonic()
    finally:
        streams.looking -= 1
