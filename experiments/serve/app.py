"""`make_app(settings)`: the server as a FastAPI application with its OpenAPI schema."""

import asyncio
import re
import secrets
import time
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from importlib.metadata import version
from typing import Annotated, Any

from fastapi import FastAPI, Path, Query, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import StreamingResponse
from starlette.routing import Match, Route
from starlette.types import Scope

from experiments.command.terminal import error_sentence, note
from experiments.log_pages.comparison import comparison_rows
from experiments.serve.answers import Comparison, Health, Log, Logs, Refusal, StreamHistory, StreamState, Verb, log_of
from experiments.serve.connection import ALL_SENT
from experiments.serve.events import MOST_STREAM_VIEWS, event_stream
from experiments.serve.limits import HEADERS, MOST_UPLOADS, Guard, RefusedError, receive_file, require_size
from experiments.serve.metrics import PROMETHEUS_TEXT, exposition
from experiments.serve.pages import home_page, live_page, page_on_disk, policy_of
from experiments.serve.refusals import POLICY, refusal_page, wants_page
from experiments.serve.service import Service
from experiments.serve.settings import Settings
from experiments.serve.store import StoredLog
from plant.errors import HydrostateError

Identity = Annotated[str, Path(pattern=r"^[0-9a-f]{16}$", description="The id from the list of logs.")]
LogId = Annotated[str, Query(pattern=r"^[0-9a-f]{16}$", description="The id of a finished log.")]
Name = Annotated[str, Query(min_length=1, max_length=200, description="Name of the file.")]
StreamName = Annotated[str, Path(pattern=r"^[A-Za-z0-9_-]{1,40}$")]

WHY: Mapping[int, str] = {
    400: "The request is not HTTP, or its body was cut off.",
    401: "A token is needed.",
    403: "The request comes from a page of another site.",
    404: "Not found.",
    405: "This method is not allowed here.",
    408: "The request arrives too slowly.",
    409: "Not finished yet.",
    413: "It is too large, or the folder is full.",
    415: "The body must be the file itself.",
    421: "The host name is unknown.",
    422: "A parameter is missing or wrong, or the body is empty.",
    429: "The server is busy; come again after the seconds of Retry-After.",
}

_UNSEEN = re.compile(
    r"[\x00-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ud800-\udfff\ufeff"
    r"\ufff9-\ufffb\U000e0000-\U000e007f]"
)
"""Characters that cannot be seen, or that turn the direction of a text; scripts need \\u200c and \\u200d."""

_BLANK = " .\u200c\u200d"


def refusal_responses(*more: int, page: bool = False) -> dict[int | str, dict[str, Any]]:
    """Return the possible refusals of a request, for OpenAPI; refusals are JSON, except for browsers."""
    schema = {"$ref": "#/components/schemas/Refusal"}
    kinds = {"application/json": {"schema": schema}, "text/html": {"schema": {"type": "string"}}}
    said: dict[str, Any] = {"content": kinds} if page else {"model": Refusal}
    return {one: {"description": WHY[one], **said} for one in sorted((400, 401, 403, 405, 408, 421, 429, *more))}


BODY = {
    "requestBody": {
        "required": True,
        "description": "The file itself, in any format that `hydrostate inspect` reads.",
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary", "minLength": 1}}},
    }
}


def make_app(settings: Settings, refused: Callable[[HydrostateError], None] | None = None) -> FastAPI:
    """Return the server.

    Parameters
    ----------
    settings : Settings
        Settings of the server.
    refused : callable, optional
        Called with the reason if the folder cannot be opened; the error is raised too.

    Returns
    -------
    FastAPI
        The application; at its start it opens its folder and resumes unfinished logs.
    """
    service = Service(settings)

    @asynccontextmanager
    async def life(_: FastAPI) -> AsyncGenerator[None]:
        try:
            service.open()
        except HydrostateError as error:
            if refused is not None:
                refused(error)
            raise
        yield
        await asyncio.to_thread(service.close)

    app = FastAPI(
        title="Hydrostate",
        version=version("hydrostate"),
        description="Says what is wrong inside an electro-hydrostatic actuator. Values are in SI.",
        docs_url=None,
        redoc_url=None,
        lifespan=life,
        responses=refusal_responses(),
    )
    app.add_middleware(Guard, settings=settings)
    _answer_errors(app)
    _offer_logs(app, service)
    _offer_state(app, service)
    _offer_comparison(app, service)
    _offer_streams(app, service)
    _offer_pages(app, service)
    return app


def plain_name(name: str) -> str:
    """Return a file name without folders and invisible characters.

    Examples
    --------
    >>> plain_name("C:/logs/../run 1.csv"), plain_name(".."), plain_name(chr(0x200B))
    ('run 1.csv', 'log', 'log')
    """
    known = _UNSEEN.sub("", re.split(r"[/\\]", name)[-1]).strip()
    return known if known.strip(_BLANK) else "log"


def methods_at(app: FastAPI, scope: Scope) -> list[str]:
    """Return the methods allowed for a path."""
    routes = [route for route in app.routes if isinstance(route, Route) and route.matches(scope)[0] is not Match.NONE]
    return sorted({method for route in routes for method in route.methods or ()})


def _answer_errors(app: FastAPI) -> None:
    def answered(request: Request, status: int, detail: str, headers: Mapping[str, str] | None = None) -> Response:
        if wants_page(request.method, request.url.path, request.headers.get("accept", "")):
            policy = {"Content-Security-Policy": POLICY}
            return HTMLResponse(refusal_page(detail, request.url.path), status, {**(headers or {}), **policy})
        return JSONResponse({"detail": detail}, status, headers)

    async def refused(request: Request, error: Exception) -> Response:
        said = error if isinstance(error, RefusedError) else RefusedError(400, str(error))
        return answered(request, said.status, said.detail, said.headers)

    async def http(request: Request, error: Exception) -> Response:
        status = error.status_code if isinstance(error, HTTPException) else 400
        headers = {"Allow": ", ".join(methods_at(app, request.scope))} if status == 405 else None
        return answered(request, status, WHY.get(status, str(error)), headers)

    async def invalid(request: Request, error: Exception) -> Response:
        found: Any = error.errors()[0] if isinstance(error, RequestValidationError) else {"loc": (), "msg": str(error)}
        where, *names = map(str, found["loc"]) if found["loc"] else ("request",)
        if found.get("type") == "missing":
            return answered(request, 422, f"the {where} has no {' '.join(names)!r}; it must give one")
        if found.get("type") == "string_pattern_mismatch":
            return answered(request, 422, f"{str(found['input'])[:80]!r} is none of this server's logs or streams")
        return answered(request, 422, f"{' '.join((where, *names))}: {found['msg']}")

    async def strange(_: Request, error: Exception) -> Response:
        said = error_sentence(error)
        note(f"serve: {said}")
        # this response bypasses the guard, which normally sets these headers
        every = {name.decode(): value.decode() for name, value in HEADERS.items()}
        return JSONResponse({"detail": said}, 500, every)

    async def left(_: Request, __: Exception) -> Response:
        return JSONResponse({"detail": "the body was cut off"}, 400)

    app.add_exception_handler(RefusedError, refused)
    app.add_exception_handler(HTTPException, http)
    app.add_exception_handler(RequestValidationError, invalid)
    app.add_exception_handler(ClientDisconnect, left)
    app.add_exception_handler(Exception, strange)


def _offer_logs(app: FastAPI, service: Service) -> None:
    @app.post(
        "/api/logs", status_code=202, responses=refusal_responses(413, 415, 422), openapi_extra=BODY, tags=["logs"]
    )
    async def drop(request: Request, response: Response, name: Name, verb: Verb = "diagnose") -> Log:
        """Take a log and put it into the queue; the body is the file itself."""
        kept = await _received(request, service, plain_name(name), verb)
        response.headers["Location"] = f"/api/logs/{kept.id}"
        return log_of(kept, service.jobs)

    @app.get("/api/logs", responses=refusal_responses(422), tags=["logs"])
    def logs(
        most: Annotated[int, Query(ge=1, le=500)] = 100, before: Annotated[int | None, Query(ge=0, le=1 << 60)] = None
    ) -> Logs:
        """Return logs, the latest first."""
        found = service.store.latest(most, before)
        return Logs(logs=[log_of(one, service.jobs) for one in found], counts=service.store.counts())

    @app.get("/api/logs/{id}", responses=refusal_responses(404, 422), tags=["logs"])
    def log(id: Identity) -> Log:  # noqa: A002 - a path's name
        """Return the state of a log."""
        return log_of(service.require_log(id), service.jobs)

    @app.get("/api/logs/{id}/result", responses=refusal_responses(404, 409, 422), tags=["logs"])
    def result(id: Identity) -> dict[str, Any]:  # noqa: A002 - a path's name
        """Return the result of a log: the object that `hydrostate VERB --json` prints for it."""
        return service.result(id)

    @app.post("/api/logs/{id}/again", status_code=202, responses=refusal_responses(404, 409, 413, 422), tags=["logs"])
    def again(id: Identity) -> Log:  # noqa: A002 - a path's name
        """Work on a finished log once more, such as one that failed, or whose page met a full disk."""
        return log_of(service.again(id), service.jobs)

    @app.delete("/api/logs/{id}", status_code=204, responses=refusal_responses(404, 413, 422), tags=["logs"])
    def delete(id: Identity) -> None:  # noqa: A002 - a path's name
        """Delete a log with its page and result; if it is running, it stops at once."""
        service.delete(id)


async def _received(request: Request, service: Service, name: str, verb: Verb) -> StoredLog:
    """Receive the file that a request carries, and put it into the queue."""
    if request.headers.get("content-type", "").lower().startswith("multipart/"):
        raise RefusedError(415, "the body must be the file itself, not a form: curl --data-binary @run.csv")
    service.require_place()
    if service.room.uploads >= MOST_UPLOADS:
        raise RefusedError(429, f"{MOST_UPLOADS} logs are coming in, come again")
    service.room.uploads += 1
    try:
        room, length = service.room.bytes_left(), request.headers.get("content-length", "")
        require_size(int(length) if length.isdecimal() else 0, service.settings.largest, room)
        identity = secrets.token_hex(8)
        part = service.settings.work / f"{identity}.part"
        size = await receive_file(request.stream(), part, service.settings.largest, room)
    finally:
        service.room.uploads -= 1
    return await asyncio.to_thread(service.take_in, identity, part, name, verb, size)


def _offer_state(app: FastAPI, service: Service) -> None:
    @app.get("/api/health", tags=["server"])
    def health() -> Health:
        """Return whether the server has capacity for more logs."""
        waiting, most = service.jobs.waiting, service.settings.waiting
        return Health(
            waiting=waiting, most_waiting=most, room=max(service.room.bytes_left(), 0), version=version("hydrostate")
        )

    @app.get("/metrics", response_class=PlainTextResponse, responses=refusal_responses(page=True), tags=["server"])
    def metrics() -> PlainTextResponse:
        """Return the metrics in the text format of Prometheus."""
        streams = [(one.state, one.alarms) for one in service.streams.by_name.values()]
        text = exposition(service.store.counts(), service.jobs.waiting, streams, time.time())
        return PlainTextResponse(text, media_type=PROMETHEUS_TEXT)


def _offer_comparison(app: FastAPI, service: Service) -> None:
    @app.get("/api/compare", responses=refusal_responses(404, 409, 422), tags=["logs"])
    def compare(first: LogId, second: LogId) -> Comparison:
        """Return the differences between two logs, second minus first."""
        pair = [service.result(one) for one in (first, second)]
        logs = [log_of(service.require_log(one), service.jobs) for one in (first, second)]
        return Comparison.model_validate({"first": logs[0], "second": logs[1], "differences": comparison_rows(*pair)})


def _offer_streams(app: FastAPI, service: Service) -> None:
    @app.get("/api/streams", tags=["streams"])
    def streams() -> list[StreamState]:
        """Return the watched streams."""
        return [StreamState.model_validate(one.state) for one in service.streams.by_name.values()]

    @app.get("/api/streams/{name}", responses=refusal_responses(404, 422), tags=["streams"])
    def stream(name: StreamName) -> StreamHistory:
        """Return a stream with the last ten minutes of its gauges, and its events."""
        one = service.stream(name)
        return StreamHistory.model_validate({**one.state, "history": one.since(0), "events": one.events()})

    @app.get(
        "/api/streams/{name}/events",
        responses={
            **refusal_responses(404, 422, page=True),
            200: {"content": {"text/event-stream": {}}, "description": "Server-sent events."},
        },
        response_class=StreamingResponse,
        tags=["streams"],
    )
    async def follow(request: Request, name: StreamName) -> StreamingResponse:
        """Return the events of a stream as they come: `history` once, then `gauges`, and `state` with new events."""
        one = service.stream(name)
        if service.streams.looking >= MOST_STREAM_VIEWS:
            raise RefusedError(429, f"{MOST_STREAM_VIEWS} views are open, close one")

        async def gone() -> bool:
            return ALL_SENT in request.scope.get("state", {}) or await request.is_disconnected()

        return StreamingResponse(event_stream(one, service.streams, gone), media_type="text/event-stream")


def _offer_pages(app: FastAPI, service: Service) -> None:
    def shown(page: str) -> HTMLResponse:
        return HTMLResponse(page, headers={"Content-Security-Policy": policy_of(page)})

    @app.get("/", response_class=HTMLResponse, responses=refusal_responses(page=True), tags=["pages"])
    def home() -> HTMLResponse:
        """Return the page for uploading logs."""
        return shown(home_page(service.settings))

    @app.get(
        "/logs/{id}", response_class=HTMLResponse, responses=refusal_responses(404, 409, 422, page=True), tags=["pages"]
    )
    def page(id: Identity) -> StreamingResponse:  # noqa: A002 - a path's name
        """Return the page of a log."""
        return page_on_disk(service.page(id))

    @app.get("/fleet", response_class=HTMLResponse, responses=refusal_responses(404, 409, page=True), tags=["pages"])
    async def fleet() -> HTMLResponse:
        """Return the page of the fleet: one row per actuator, the worst on top."""
        return shown(await service.fleet())

    @app.get(
        "/actuator", response_class=HTMLResponse, responses=refusal_responses(404, 409, 422, page=True), tags=["pages"]
    )
    async def actuator(name: Annotated[str, Query(min_length=1, max_length=400)]) -> HTMLResponse:
        """Return the page of an actuator with several logs: its trends and its last logs."""
        return shown(await service.actuator(name))

    @app.get(
        "/compare", response_class=HTMLResponse, responses=refusal_responses(404, 409, 422, page=True), tags=["pages"]
    )
    async def comparison(first: LogId, second: LogId) -> HTMLResponse:
        """Return the page of two logs side by side."""
        return shown(await service.comparison(first, second))

    @app.get(
        "/live/{name}", response_class=HTMLResponse, responses=refusal_responses(404, 422, page=True), tags=["pages"]
    )
    def live(name: StreamName) -> HTMLResponse:
        """Return the page of a stream."""
        service.stream(name)
        return shown(live_page(list(service.streams.by_name), name))
