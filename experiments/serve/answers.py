"""Responses of the server, as described by its OpenAPI schema."""

from typing import Any, Literal

from pydantic import BaseModel, Field

from experiments.serve.jobs import Jobs
from experiments.serve.store import DONE, UNFINISHED, StoredLog

Verb = Literal["diagnose", "estimate", "inspect"]


class Refusal(BaseModel):
    """Why a request was refused."""

    detail: str


class Log(BaseModel):
    """A log on the server.

    Parameters
    ----------
    received, ended : float, float or None
        When it was received and when the work on it ended, since 1970 [s].
    """

    number: int = Field(description="Later logs have larger numbers.")
    id: str
    name: str
    verb: Verb
    size: int = Field(description="Size of the file [byte].")
    state: Literal["waiting", "running", "done", "failed", "interrupted"]
    phase: str | None = Field(description="Current step, while the log is running.")
    received: float = Field(description="When the log arrived [s since 1970].")
    ended: float | None = Field(description="When the result was ready [s since 1970].")
    outcome: str | None = Field(description="ok, not_observable, mismatch, diverged or failed.")
    message: str | None = Field(description="The result in one sentence.")
    page: bool = Field(description="Whether it has a page, at /logs/ID.")


class Logs(BaseModel):
    """Logs, the latest first."""

    logs: list[Log]
    counts: dict[str, int] = Field(description="How many logs are in each state.")


class Health(BaseModel):
    """Whether the server has capacity."""

    waiting: int = Field(description="Number of logs that are running or waiting.")
    most_waiting: int
    room: int = Field(description="Free space in the folder [byte].")
    version: str


class Difference(BaseModel):
    """A quantity in two logs.

    Parameters
    ----------
    difference : float or None
        Second log minus first [unit].
    interval : list of float or None
        95 % interval of the difference [unit].
    """

    quantity: str
    unit: str
    first: dict[str, Any] | None
    second: dict[str, Any] | None
    difference: float | None
    interval: list[float] | None = Field(description="95 % interval of the difference.")
    changed: bool


class Comparison(BaseModel):
    """Two logs side by side."""

    first: Log
    second: Log
    differences: list[Difference]


class StreamState(BaseModel):
    """A watched stream."""

    name: str
    state: Literal["connecting", "learning", "watching", "ended", "failed"]
    message: str
    gauges: dict[str, Any] | None = Field(description="The latest gauges, in SI.")


class StreamHistory(StreamState):
    """A stream with its last ten minutes and its events."""

    history: list[dict[str, Any]]
    events: list[dict[str, Any]]


def log_of(kept: StoredLog, jobs: Jobs) -> Log:
    """Return a log in the form of a response."""
    unfinished = kept.state == UNFINISHED
    phase = jobs.phase(kept.id) if unfinished else None
    state = ("waiting" if phase is None else "running") if unfinished else kept.state
    told = {name: getattr(kept, name) for name in Log.model_fields if name not in ("state", "phase", "page")}
    page = kept.state == DONE and jobs.has_page(kept.id)
    return Log.model_validate({**told, "state": state, "phase": phase, "page": page})
