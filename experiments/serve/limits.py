"""Access and load limits of a server: who may send requests, what a page may do, bodies, files and timeouts."""

import asyncio
import hmac
import json
import os
import shutil
import time
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from urllib.parse import parse_qs, quote, unquote, urlsplit

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from experiments.serve.refusals import POLICY, refusal_page, wants_page
from experiments.serve.settings import MB, Settings, is_loopback

MOST_REQUESTS = 256
"""Requests handled at the same time [count]; further ones are told to retry."""

MOST_UPLOADS = 16
"""Logs uploaded at the same time [count]."""

IDLE_TIME = 15.0
"""Longest pause within a request body [s]."""

GRACE, SLOWEST = 30.0, 10_000.0
"""Grace period, after which a body must arrive faster than the given average rate [s, bytes/s]."""

DRAIN_TIME = 5.0
"""How long further data are discarded after a refusal, so that the client can read the reason [s]."""

SPARE_SPACE = 256 * MB
"""Disk space that is left free [bytes]."""

COOKIE = "hydrostate_token"

RETRY = (b"retry-after", b"5")

CLOSE = (b"connection", b"close")

HEADERS: Mapping[bytes, bytes] = {
    b"content-security-policy": b"default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"DENY",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"cache-control": b"no-store",
}
"""Default headers of every response."""


class RefusedError(Exception):
    """A request is refused.

    Parameters
    ----------
    status : int
        HTTP status code.
    detail : str
        The reason, in a sentence.
    """

    def __init__(self, status: int, detail: str) -> None:
        super().__init__(detail)
        self.status, self.detail = status, detail

    @property
    def headers(self) -> dict[str, str]:
        """Headers of the response: when to retry."""
        return {"Retry-After": RETRY[1].decode()} if self.status == 429 else {}


class Guard:
    """Refuses unauthorised requests, and adds the policy of pages to every response.

    Parameters
    ----------
    app : ASGIApp
        The application that answers all other requests.
    settings : Settings
        Host and token.
    """

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._token = app, settings.token
        public = urlsplit((settings.url or "").lower())
        self._origins = {public.netloc} - {""}
        self._secure = "; Secure" if public.scheme == "https" else ""
        self._names = {"localhost", "127.0.0.1", "::1", settings.host.lower(), public.hostname}
        self._loopback = is_loopback(settings.host)
        self._busy = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        exchange = _Exchange(receive, send)
        headers = {name.lower(): value for name, value in scope["headers"]}
        try:
            self._busy += 1
            moved = self._admit(scope, headers)
            if moved is not None:
                await exchange.answer(303, "", moved)
                return
            await self._app(scope, exchange.receive, exchange.send)
        except RefusedError as refused:
            again: list[tuple[bytes, bytes]] = [RETRY] if refused.status == 429 else []
            again += [CLOSE] if refused.status == 400 else []
            page = wants_page(scope["method"], scope["path"], headers.get(b"accept", b"").decode("latin-1"))
            await exchange.answer(refused.status, refused.detail, again, scope["path"] if page else None)
        finally:
            self._busy -= 1

    def _admit(self, scope: Scope, headers: Mapping[bytes, bytes]) -> list[tuple[bytes, bytes]] | None:
        """Refuse or accept a request; return redirection headers if the address contained the token."""
        if self._busy > MOST_REQUESTS:
            raise RefusedError(429, f"more than {MOST_REQUESTS} requests are being answered, come again")
        if b"content-length" in headers and b"transfer-encoding" in headers:
            # a proxy may read the first and the server the second: one of them would take the body for a request
            raise RefusedError(400, "a request must give Content-Length or Transfer-Encoding, not both")
        host = headers.get(b"host", b"").decode("latin-1").lower()
        if self._loopback and _host_name(host) not in self._names:
            raise RefusedError(421, f"this server answers for localhost alone, the request is for {host[:80]!r}")
        if scope["method"] not in ("GET", "HEAD", "OPTIONS"):
            origins = [value for name, value in scope["headers"] if name.lower() == b"origin"]
            own = {host, *self._origins}
            foreign = any(one.decode("latin-1").lower().partition("://")[2] not in own for one in origins)
            if foreign or headers.get(b"sec-fetch-site", b"none") not in (b"none", b"same-origin"):
                raise RefusedError(403, "a page of another site may not change anything here")
        if self._token is None:
            return None
        if scope["path"] == "/" and b"token=" in scope["query_string"]:
            given = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
            if _is_token(given, self._token):
                # no path: that of the address in the browser, which a proxy may have shortened
                cookie = f"{COOKIE}={quote(self._token, safe='')}; HttpOnly; SameSite=Strict{self._secure}"
                return [(b"location", b"./"), (b"set-cookie", cookie.encode())]
        if not (_is_token(_bearer(headers), self._token) or _is_token(_cookie(headers), self._token)):
            raise RefusedError(
                401, "a token is needed: open the address that the server printed, or send a Bearer token"
            )
        return None


def _is_token(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def _bearer(headers: Mapping[bytes, bytes]) -> str:
    kind, _, given = headers.get(b"authorization", b"").decode("latin-1").partition(" ")
    return given.strip() if kind.lower() == "bearer" else ""


def _cookie(headers: Mapping[bytes, bytes]) -> str:
    parts = [part.strip().partition("=") for part in headers.get(b"cookie", b"").decode("latin-1").split(";")]
    return next((unquote(value) for name, _, value in parts if name == COOKIE), "")


def _host_name(host: str) -> str:
    """Return a host header without its port.

    Examples
    --------
    >>> _host_name("127.0.0.1:8765"), _host_name("[::1]:80")
    ('127.0.0.1', '::1')
    """
    return host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]


class _Exchange:
    """A request and its response: every response has `HEADERS`, and a refusal is read before the connection ends."""

    def __init__(self, receive: Receive, send: Send) -> None:
        self._receive, self._send = receive, send
        self._whole = self._gone = False
        self._status = 0

    async def receive(self) -> Message:
        message = await self._receive()
        self._gone = self._gone or message["type"] == "http.disconnect"
        self._whole = self._whole or not message.get("more_body", False)
        return message

    async def send(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self._status = message["status"]
            there = {name.lower() for name, _ in message["headers"]}
            more = [(name, value) for name, value in HEADERS.items() if name not in there]
            message = {**message, "headers": [*message["headers"], *more]}
        elif not message.get("more_body", False) and self._status >= 400:
            await self._send({**message, "more_body": True})
            await self._drain()
            message = {"type": "http.response.body", "body": b"", "more_body": False}
        await self._send(message)

    async def answer(
        self, status: int, detail: str, headers: list[tuple[bytes, bytes]], page: str | None = None
    ) -> None:
        if self._status:  # an answer has begun and cannot be replaced
            return
        body = (json.dumps({"detail": detail}) if page is None else refusal_page(detail, page)).encode()
        kind = b"application/json" if page is None else b"text/html; charset=utf-8"
        about = [(b"content-type", kind), (b"content-length", str(len(body)).encode())]
        about += [] if page is None else [(b"content-security-policy", POLICY.encode())]
        await self.send({"type": "http.response.start", "status": status, "headers": [*about, *headers]})
        await self.send({"type": "http.response.body", "body": body})

    async def _drain(self) -> None:
        try:
            async with asyncio.timeout(DRAIN_TIME):
                while not (self._whole or self._gone):
                    await self.receive()
        except TimeoutError:
            return


class FreeSpace:
    """Free space in the folder of a server."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._taken, self._looked = 0, -1e9
        self.uploads = 0

    def bytes_left(self) -> int:
        """Return the number of bytes that may still be received; refreshed every few seconds."""
        if time.monotonic() - self._looked > IDLE_TIME:
            folders = (self._settings.logs, self._settings.pages, self._settings.work)
            self._taken = sum(_size(entry) for folder in folders for entry in os.scandir(folder))
            self._looked = time.monotonic()
        free = shutil.disk_usage(self._settings.folder).free - SPARE_SPACE
        return min(self._settings.room - self._taken, free)

    def add_received(self, size: int) -> None:
        """Count received data [bytes]."""
        self._taken += size


def _size(entry: "os.DirEntry[str]") -> int:
    try:
        return entry.stat(follow_symlinks=False).st_size
    except FileNotFoundError:  # deleted after it was listed
        return 0


async def receive_file(chunks: AsyncIterator[bytes], path: Path, most: int, room: int) -> int:
    """Write a body to a file as it comes.

    Parameters
    ----------
    chunks : AsyncIterator of bytes
        The body.
    path : Path
        The file, which must not be there yet; it is deleted if the body is refused or breaks off.
    most : int
        Most that is taken [bytes].
    room : int
        What the folder still takes [bytes].

    Returns
    -------
    int
        Its size [bytes].

    Raises
    ------
    RefusedError
        If it is empty, too large or too slow, or the disk is full.
    """
    size, began, whole = 0, time.monotonic(), False
    try:
        with path.open("xb") as file:
            while True:
                async with asyncio.timeout(IDLE_TIME):
                    chunk = await anext(chunks, None)
                if chunk is None:
                    break
                size += len(chunk)
                require_size(size, most, room)
                took = time.monotonic() - began
                if took > GRACE and size < took * SLOWEST:
                    raise RefusedError(408, f"the file arrives too slowly: {size / took:.0f} bytes per second")
                file.write(chunk)
            if not size:
                raise RefusedError(422, "the body must be the file itself, but it is empty")
            file.flush()
            await asyncio.to_thread(os.fsync, file.fileno())
        whole = True
    except TimeoutError as error:
        raise RefusedError(408, f"the file stopped coming for {IDLE_TIME:g} s") from error
    except OSError as error:
        raise RefusedError(413, f"the server's folder takes no more: {error.strerror or error}") from error
    finally:
        if not whole:
            path.unlink(missing_ok=True)
    return size


def require_size(size: int, most: int, room: int) -> None:
    """Refuse a request body that is too large for a log or for the folder.

    Parameters
    ----------
    size, most, room : int
        Size of the body, largest size of a log, and space left in the folder [bytes].

    Raises
    ------
    RefusedError
        If it is too large.
    """
    if size > most:
        raise RefusedError(413, f"a log may have {most // MB} MB, this one has more")
    if size > room:
        raise RefusedError(413, "the server's folder is full: delete logs in it, or give it more room")
