"""Requests that no honest client sends, over bare sockets: the server's answers to each, counted."""

import random
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor

TIMEOUT = 40.0
"""Maximum wait for an answer [s]."""

HUGE_BODY = 1 << 30
"""Size of an oversized body [bytes]."""

LINE = b"\r\n"

TRAVERSALS = (
    b"/logs/../../../../etc/passwd",
    b"/logs/..%2f..%2f..%2fetc%2fpasswd",
    b"/logs/%2e%2e/%2e%2e/etc/passwd",
    b"/api/logs/....//....//etc/passwd",
    b"/api/logs/%00/result",
    b"/api/logs/%ff%fe/result",
    b"//etc/passwd",
    b"/live/..%5c..%5cx",
    b"/api/streams/%2e%2e%2fin-use",
    b"/api/logs/0000000000000000/result",
    b"/logs/" + b"a" * 5000,
    b"/api/logs?before=99999999999999999999999999",
    b"/api/logs?most=-1",
    b"/api/logs?most=%F0%9F%92%A9",
    b"/compare?first=0123456789abcdef&second=0123456789abcdef",
    b"/compare?first='%3B DROP TABLE logs&second=x".replace(b" ", b"+"),
    b"/api/compare?first=%ed%a0%80&second=%00",
)

NAMES = (
    b"..%2f..%2fescaped.csv",
    b"%2e%2e",
    b"%2ftmp%2fescaped.csv",
    b"a%00b.csv",
    b"%ed%a0%80.csv",
    b"CON",
    b"x" * 300,
    b"<script>alert(1)</script>.csv",
    b"C%3a%5cescaped.csv",
    b"%e2%80%ae.csv",
)

GARBAGE = (
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(range(256)),
    b"GET / HTTP/9.9\r\n\r\n",
    b"\r\n\r\n\r\n\r\n",
    b"GET /\r\n\r\n",
    b"GET / HTTP/1.1\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"y" * 70000 + b"\r\n\r\n",
    b"BREW /pot HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"POST /api/logs?name=a HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
    b"POST /api/logs?name=a HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n"
    b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    b"POST /api/logs?name=a HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nZZZ\r\nhello\r\n0\r\n\r\n",
    b"POST /api/logs?name=a HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: gzip\r\n\r\n",
    b"POST /api/logs?name=a HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\nContent-Length: 1\r\n\r\na",
    b"DELETE /api/logs/0123456789abcdef HTTP/1.1\r\nHost: localhost\r\nSec-Fetch-Site: cross-site\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n",
    b"GET / HTTP/1.1\r\nHost: localhost\r\nCookie: \xff\xfe=\x80\r\nAuthorization: Bearer \xff\r\n\r\n",
)


class HostileClients:
    """Hostile clients of a server.

    Parameters
    ----------
    host, port : str, int
        Address where the server listens.
    """

    def __init__(self, host: str, port: int) -> None:
        self._place = (host, port)
        self._host = f"{host}:{port}".encode()
        self.answers: Counter[str] = Counter()
        self._lock = threading.Lock()

    def attack(self, count: int, clients: int, shares: Mapping[str, float], seed: int = 0) -> None:
        """Send requests of many kinds, many at once; `answers` counts the answers.

        Parameters
        ----------
        count : int
            Number of requests.
        clients : int
            Number of clients at once.
        shares : Mapping[str, float]
            Relative frequency of each kind.
        """
        kinds: Mapping[str, Callable[[random.Random], bytes]] = {
            "traversal": self._traversal,
            "name": self._name,
            "multipart": self._multipart,
            "garbage": self._garbage,
            "cut": self._cut,
            "huge": self._huge,
            "chunked": self._chunked,
            "slow": self._slow,
            "polite": self._polite,
        }
        chance = random.Random(seed)  # noqa: S311 -- a test's dice
        drawn = chance.choices(list(shares), list(shares.values()), k=count)

        def one(place: int, kind: str) -> None:
            try:
                answer = kinds[kind](random.Random(seed + place))  # noqa: S311
            except OSError as error:
                answer = type(error).__name__.encode()
            with self._lock:
                self.answers[f"{kind} {status_of(answer)}"] += 1

        with ThreadPoolExecutor(clients) as pool:
            for _ in pool.map(one, range(count), drawn):
                pass

    def _ask(self, *parts: bytes, wait: bool = True) -> bytes:
        with socket.create_connection(self._place, TIMEOUT) as connection:
            try:
                for part in parts:
                    connection.sendall(part)
            except ConnectionError:  # refused before all was sent: the answer may have arrived
                pass
            return first_line(connection) if wait else b"left"

    def _head(self, target: bytes, *more: bytes, method: bytes = b"GET") -> bytes:
        lines = (method + b" " + target + b" HTTP/1.1", b"Host: " + self._host, b"Connection: close", *more)
        return LINE.join(lines) + LINE + LINE

    def _traversal(self, chance: random.Random) -> bytes:
        return self._ask(self._head(chance.choice(TRAVERSALS)))

    def _name(self, chance: random.Random) -> bytes:
        target = b"/api/logs?verb=inspect&name=" + chance.choice(NAMES)
        return self._ask(self._head(target, b"Content-Length: 8", method=b"POST"), b"a,b\n1,2\n")

    def _multipart(self, chance: random.Random) -> bytes:
        body = b"--x\r\nContent-Disposition: form-data; name=file; filename=../../a\r\n" + b"a" * chance.randrange(2000)
        about = (b"Content-Type: multipart/form-data; boundary=y", b"Content-Length: %d" % (len(body) + 10))
        return self._ask(self._head(b"/api/logs?name=form.csv", *about, method=b"POST"), body)

    def _garbage(self, chance: random.Random) -> bytes:
        return self._ask(chance.choice(GARBAGE))

    def _cut(self, chance: random.Random) -> bytes:
        head = self._head(b"/api/logs?name=cut.csv", b"Content-Length: 100000", method=b"POST")
        return self._ask(head, b"time_s,position_m\n" * chance.randrange(100), wait=False)

    def _polite(self, chance: random.Random) -> bytes:
        return self._ask(self._head(chance.choice((b"/", b"/api/logs", b"/api/health", b"/openapi.json", b"/fleet"))))

    def _huge(self, chance: random.Random) -> bytes:
        head = self._head(b"/api/logs?name=huge.csv", b"Content-Length: %d" % HUGE_BODY, method=b"POST")
        return self._ask(head, bytes(chance.randrange(1 << 16)))

    def _chunked(self, _: random.Random) -> bytes:
        """Send a body of a gigabyte without stating its length, until the server answers."""
        head = self._head(b"/api/logs?name=huge.csv", b"Transfer-Encoding: chunked", method=b"POST")
        block = b"%x\r\n" % (1 << 20) + bytes(1 << 20) + LINE
        with socket.create_connection(self._place, TIMEOUT) as connection:
            connection.sendall(head)
            connection.setblocking(False)
            until = time.monotonic() + TIMEOUT
            for _ in range(HUGE_BODY >> 20):
                rest = memoryview(block)
                while rest and time.monotonic() < until:
                    try:
                        rest = rest[connection.send(rest) :]
                    except BlockingIOError:
                        time.sleep(0.002)
                    try:
                        if connection.recv(1, socket.MSG_PEEK):
                            connection.settimeout(TIMEOUT)
                            return first_line(connection)
                        return b""
                    except BlockingIOError:
                        continue
            return b"taken whole"

    def _slow(self, _: random.Random) -> bytes:
        """Send a header one letter at a time, until the server gives up."""
        with socket.create_connection(self._place, TIMEOUT) as connection:
            for letter in self._head(b"/"):
                try:
                    connection.sendall(bytes([letter]))
                    connection.settimeout(0.5)
                    return first_line(connection)
                except TimeoutError:
                    continue
            return b"waited for ever"


def first_line(connection: socket.socket) -> bytes:
    """Return the first line of an answer, empty if the server closed without one."""
    said = b""
    while LINE not in said:
        part = connection.recv(4096)
        if not part:
            return said
        said += part
    return said.partition(LINE)[0]


def status_of(answer: bytes) -> str:
    """Return the HTTP status of an answer, its first characters if it has none, or ``closed`` if it is empty.

    Examples
    --------
    >>> status_of(b"HTTP/1.1 413 Content Too Large"), status_of(b"")
    ('413', 'closed')
    """
    if answer.startswith(b"HTTP/"):
        return answer.split(b" ")[1].decode()
    return answer.decode("latin-1")[:40] or "closed"


def server_errors(answers: Mapping[str, int]) -> dict[str, int]:
    """Return the answers with a status of 500 or more.

    Examples
    --------
    >>> server_errors({"huge 413": 2, "polite 500": 1, "slow 408": 3})
    {'polite 500': 1}
    """
    return {kind: count for kind, count in answers.items() if kind.rpartition(" ")[2][:1] == "5"}


MIX: Mapping[str, float] = {
    "traversal": 30.0,
    "name": 10.0,
    "multipart": 10.0,
    "garbage": 25.0,
    "cut": 10.0,
    "huge": 4.0,
    "chunked": 0.1,
    "slow": 1.0,
    "polite": 10.0,
}
"""Relative frequency of each kind."""
