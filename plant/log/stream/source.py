"""Lines of a stream: from a TCP connection, in numbered batches from an MQTT broker, or from a ring in memory.

Over TCP nothing is lost: unread rows wait at the sender. A broker sends rows in batches, because one message for each
row is limited to some thousand rows a second. A batch is text: ``rows N`` with its number, the header, the rows; an
empty message ends the stream. A batch whose number has already arrived is late and is dropped; numbers that never
arrive are lost. Up to `MOST_QUEUED` batches wait here, and a batch that finds the queue full is dropped. All of these
are counted, and their rows are missing in time.
"""

import queue
import socket
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO
from urllib.parse import urlsplit

from plant.errors import HydrostateError, LogError

SCHEMES = ("tcp", "mqtt", "ring")
"""What an address of a stream begins with."""

MOST_QUEUED = 1000
"""Batches that wait to be read [batches]."""

TIMEOUT = 10.0
"""How long a connection may take [s]."""

LONGEST_LINE = 1 << 20
"""Characters of the longest line: what never ends its lines is no stream of rows, and must not fill the memory."""

MQTT_PORT = 1883

KEEPALIVE = {"TCP_KEEPIDLE": 30, "TCP_KEEPALIVE": 30, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}
"""Silence after which the other machine is asked whether it is still there, on two systems by two names, time to the
next question [s], and questions [count]: a bench that lost its power closes no connection."""


@dataclass
class BatchCounts:
    """Counts of the batches of a stream: read, late, lost, dropped.

    Parameters
    ----------
    batches, late, lost, dropped : int
        How many were read, came late or twice, never came, and found no room.
    what : str
        What they are: batches of a broker, or rows of a ring.
    """

    batches: int = 0
    late: int = 0
    lost: int = 0
    dropped: int = 0
    what: str = field(default="batches", repr=False)
    expected: int | None = field(default=None, repr=False)

    def takes(self, number: int) -> bool:
        """Return whether a batch is the next one to read, and count it.

        Parameters
        ----------
        number : int
            Its number.

        Examples
        --------
        >>> received = BatchCounts()
        >>> [received.takes(number) for number in (7, 8, 8, 11)], received.late, received.lost
        ([True, True, False, True], 1, 2)
        """
        if self.expected is not None and number < self.expected:
            self.late += 1
            return False
        self.lost += 0 if self.expected is None else number - self.expected
        self.batches, self.expected = self.batches + 1, number + 1
        return True


def is_stream(address: str) -> bool:
    """Return whether a text is an address of a stream."""
    return urlsplit(address).scheme in SCHEMES or "://" in address


def stream_lines(address: str, received: BatchCounts) -> Iterator[str]:
    """Yield header and rows of a stream as they arrive.

    Parameters
    ----------
    address : str
        ``tcp://HOST:PORT``, ``mqtt://HOST[:PORT]/TOPIC`` or ``ring:PATH``, see `plant.log.stream.ring`.
    received : BatchCounts
        Receives what became of batches.

    Raises
    ------
    HydrostateError
        If it is no such address, or the package for MQTT is missing.
    LogError
        If nobody answers there, or a message is no batch.
    """
    scheme, host, port, topic = _parts(address)
    if scheme == "tcp" and host and port:
        return _tcp(host, port, address)
    if scheme == "mqtt" and host and topic:
        return _mqtt(host, port or MQTT_PORT, topic, address, received)
    if scheme == "ring" and address != "ring:":
        return _ring(address, received)
    raise HydrostateError(f"a stream must be tcp://HOST:PORT, mqtt://HOST[:PORT]/TOPIC or ring:PATH, got {address!r}")


def broker_of(address: str) -> tuple[str, int, str]:
    """Return host, port and topic of a broker's address.

    Parameters
    ----------
    address : str
        ``mqtt://HOST[:PORT]/TOPIC``.

    Raises
    ------
    HydrostateError
        If it is no such address, or its topic has wildcards.

    Examples
    --------
    >>> broker_of("mqtt://bench/press/events")
    ('bench', 1883, 'press/events')
    """
    scheme, host, port, topic = _parts(address)
    if scheme != "mqtt" or not host or not topic or "+" in topic or "#" in address:
        raise HydrostateError(f"a topic to publish on must be mqtt://HOST[:PORT]/TOPIC, got {address!r}")
    return host, port or MQTT_PORT, topic


def _parts(address: str) -> tuple[str, str | None, int | None, str]:
    """Return scheme, host, port and path of an address."""
    parts = urlsplit(address)
    try:
        return parts.scheme, parts.hostname, parts.port, parts.path.strip("/")
    except ValueError:
        return parts.scheme, None, None, ""


def broker_package(address: str) -> tuple[Any, Any]:
    """Return the paho client and its callback versions.

    Parameters
    ----------
    address : str
        For whom, as an error names it.

    Raises
    ------
    HydrostateError
        If it is not installed.
    """
    try:
        from paho.mqtt import client as mqtt
        from paho.mqtt.enums import CallbackAPIVersion
    except ImportError as error:
        raise HydrostateError(f"{address}: a broker needs paho-mqtt: pip install 'hydrostate[stream]'") from error
    return mqtt, CallbackAPIVersion


def connect(client: Any, host: str, port: int, address: str) -> None:
    """Connect a client to its broker, and start its loop.

    Parameters
    ----------
    client : object
        Paho's.
    host, port : str and int
        Of the broker.
    address : str
        The same as an error names it.

    Raises
    ------
    LogError
        If no broker answers there.
    """
    try:
        client.connect(host, port)
    except OSError as error:
        raise LogError(f"no broker answers: {error.strerror or error}", address) from error
    client.loop_start()


def _ring(address: str, received: BatchCounts) -> Iterator[str]:
    received.what = "rows"

    def count(taken: int, lost: int) -> None:
        received.batches, received.lost = taken, lost

    from plant.log.stream.ring import ring_lines  # imported here, so that a call for help does not wait for arrays

    return ring_lines(Path(address.removeprefix("ring:")), count)


def _tcp(host: str, port: int, address: str) -> Iterator[str]:
    try:
        connection = socket.create_connection((host, port), TIMEOUT)
    except OSError as error:
        raise LogError(f"no answer: {error.strerror or error}", address) from error
    connection.settimeout(None)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in KEEPALIVE.items():
        if hasattr(socket, name):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
    with connection, connection.makefile("r", encoding="utf-8", errors="replace", newline="\n") as lines:
        try:
            yield from bounded_lines(lines, address)
        except OSError as error:
            raise LogError(f"the connection broke: {error.strerror or error}", address) from error


def bounded_lines(file: TextIO, source: str) -> Iterator[str]:
    """Yield the lines of a text that may have no end.

    Parameters
    ----------
    file : TextIO
        The text.
    source : str
        What it is called in errors.

    Raises
    ------
    LogError
        If a line does not end.
    """
    while line := file.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            raise LogError(f"a line must have fewer than {LONGEST_LINE} characters", source)
        yield line


def batch(number: int, header: str, rows: Sequence[str]) -> str:
    r"""Return rows as a message for a broker.

    Parameters
    ----------
    number : int
        Number of the batch: one more than that of the one before.
    header : str
        Names of the columns.
    rows : sequence of str
        The rows, without line ends.

    Examples
    --------
    >>> batch(3, "time_s,position_m", ["0.0,0.1"])
    'rows 3\ntime_s,position_m\n0.0,0.1\n'
    """
    return "\n".join([f"rows {number}", header, *rows]) + "\n"


def _mqtt(host: str, port: int, topic: str, address: str, received: BatchCounts) -> Iterator[str]:
    mqtt, version = broker_package(address)
    waiting: queue.Queue[str] = queue.Queue(MOST_QUEUED)

    def subscribe(client: Any, *_: Any) -> None:
        client.subscribe(topic, qos=1)

    def take(_client: Any, _data: Any, message: Any) -> None:
        try:
            waiting.put_nowait(message.payload.decode("utf-8", errors="replace"))
        except queue.Full:
            received.dropped += 1

    client = mqtt.Client(version.VERSION2)
    client.on_connect, client.on_message = subscribe, take
    connect(client, host, port, address)
    try:
        header = ""
        while text := waiting.get():
            number, names, rows = _unpack_batch(text, address)
            if header and names != header:
                raise LogError(f"every batch must have the header {header.strip()!r}, got {names.strip()!r}", address)
            if not received.takes(number):
                continue
            if not header:
                header = names
                yield header
            yield from rows
    finally:
        client.loop_stop()
        client.disconnect()


def _unpack_batch(text: str, address: str) -> tuple[int, str, list[str]]:
    """Return number, header and rows of a batch."""
    first, *lines = text.splitlines(keepends=True)
    word, _, number = first.strip().partition(" ")
    if word != "rows" or not number.isdecimal() or not lines:
        raise LogError(f"a batch must begin with 'rows NUMBER' and a header, got {first.strip()[:80]!r}", address)
    return int(number), lines[0], [line if line.endswith("\n") else f"{line}\n" for line in lines[1:]]
