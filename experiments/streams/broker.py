"""Events of a stream at an MQTT broker."""

import json
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import Any

from experiments.command.terminal import note
from plant.log.stream.source import broker_of, broker_package, connect

PATIENCE = 5.0
"""How long the last messages to a broker may take [s]."""

MOST_WAITING = 200
"""Messages at most whose arrival is waited for at the end [count]."""


@contextmanager
def published(address: str) -> Generator[Callable[[Mapping[str, Any]], None]]:
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
    connect(client, host, port, address)
    waiting: deque[Any] = deque(maxlen=MOST_WAITING)

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
