"""Publishes the events of a stream at an MQTT broker."""

import json
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from typing import Any

from experiments.command.terminal import note
from plant.log.stream.source import broker_of, broker_package, connect

PUBLISH_TIMEOUT = 5.0
"""Longest time for the last messages to a broker [s]."""

MOST_WAITING = 200
"""Largest number of messages whose delivery is awaited at the end [count]."""


@contextmanager
def broker_publisher(address: str) -> Generator[Callable[[Mapping[str, Any]], None]]:
    """Publish every event at a broker, as the same JSON object as on its line.

    If the broker goes away, the watch continues; missed events are sent when the broker is back.

    Parameters
    ----------
    address : str
        ``mqtt://HOST[:PORT]/TOPIC``.

    Raises
    ------
    HydrostateError
        If the address is invalid, or the package for MQTT is missing.
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
        until = time.monotonic() + PUBLISH_TIMEOUT
        while any(not one.is_published() for one in waiting) and time.monotonic() < until:
            time.sleep(0.01)
        unsent = sum(not one.is_published() for one in waiting)
        if unsent:
            note(f"{address}: warning: {unsent} events did not reach the broker")
        client.disconnect()
        client.loop_stop()
