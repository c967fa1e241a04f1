"""Runs a plan into its store, and reports progress, failures and interruptions on standard error."""

import signal
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from threading import Event
from typing import TYPE_CHECKING, Any

from experiments.command.terminal import note

if TYPE_CHECKING:
    from experiments.batch.cases import Plan
    from experiments.batch.part_store import PartStore
    from experiments.batch.rows import Failure
    from experiments.batch.runner import Tally
    from experiments.batch.work import Part

QUIET_SECONDS = 30.0
"""Time between lines of progress if standard error is not a terminal [s]."""

MOST_NAMED = 20
"""Number of failed cases that are named as they occur; the store and the report name all."""

END_SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask a batch to end: Ctrl-C, and the signal that the system sends when it shuts down."""


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """Settings of a run: workers, selected cases, and when to stop.

    Parameters
    ----------
    workers : int
        Number of processes on this machine.
    cluster : str or None
        Scheduler of a Dask cluster, used instead of local workers.
    max_failures : int or None
        The run stops if more cases than this have failed.
    resume : bool
        Whether cases that the store already has are kept.
    retry_failed : bool
        Whether failed cases run again.
    """

    workers: int
    cluster: str | None = None
    max_failures: int | None = None
    resume: bool = True
    retry_failed: bool = False


def run_plan(plan: "Plan", store: "PartStore", source: str, settings: RunSettings) -> "tuple[Tally, int]":
    """Run what the store does not have yet, with progress on standard error.

    Parameters
    ----------
    source : str
        Name of the study in the manifest.
    settings : RunSettings
        Where the study runs, and when it stops.

    Returns
    -------
    tuple of Tally and int
        Counts of the run, and how many cases the store had before.
    """
    from experiments.batch.runner import manifest_of, run_batch
    from experiments.running.executors import open_executor

    manifest = manifest_of(plan, source)
    if settings.resume:
        _warn_of_differences(store.manifest(), manifest)
    else:
        store.clear()
    if plan.links:
        link, log = next(iter(plan.links.items()))
        several = len(plan.links) > 1
        counted = f"{len(plan.links)} links lead to logs that count" if several else "1 link leads to a log that counts"
        note(f"{counted} under another name, {'such as ' if several else ''}{link} ({log})")
    done, broken = store.done(again=settings.retry_failed)
    for name in broken:
        note(f"part {name} of {store.name} cannot be read: it is set aside, and its cases are run again")
    wanted = plan.keys
    store.describe(manifest, wanted)
    before = len(done.intersection(wanted))
    if before:
        note(f"{before} of {len(wanted)} cases are in {store.name} already")
    with _show_progress(len(wanted), before) as advance, _interruptible() as stop:
        opener = partial(open_executor, settings.workers, settings.cluster)
        most = settings.max_failures
        tally = run_batch(plan, store, done, opener, stop=stop, on_part=advance, max_failures=most)
    return tally, before


def _warn_of_differences(old: Any, new: Any) -> None:
    """Warn if kept rows were made by different software than the new rows."""
    from experiments.batch.runner import METHODS

    if old is None:
        return
    then = old["versions"]
    changed = [f"{name} {then.get(name)}" for name, now in new["versions"].items() if then.get(name) != now]
    if old.get("commit") != new["commit"]:
        changed.append(f"commit {str(old.get('commit'))[:10]}")
    elif old.get("sources") != new.get("sources"):
        changed.append(f"other code in {', '.join(METHODS)}")
    if changed:
        note(f"rows that are kept may have been made with {', '.join(changed)}; --no-resume makes all of them again")


@contextmanager
def _interruptible() -> Generator[Event]:
    """Set the stop event at the first Ctrl-C or request of the system to end; stop immediately at the second one."""
    stop = Event()

    def wish(number: int, frame: object) -> None:
        del number, frame
        stop.set()
        for one in END_SIGNALS:
            signal.signal(one, signal.default_int_handler)
        note("interrupted: finishing the running cases; press Ctrl-C again to stop at once")

    before = {one: signal.signal(one, wish) for one in END_SIGNALS}
    try:
        yield stop
    finally:
        for one, was in before.items():
            signal.signal(one, was)


@contextmanager
def _show_progress(total: int, before: int) -> "Generator[Callable[[int, Part], None]]":
    """Show the number of finished cases, their rate and the time left; name failures as they occur."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    quiet = not console.is_terminal
    columns = (TextColumn("cases"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"))
    bar = Progress(*columns, TimeRemainingColumn(), console=console, transient=True, disable=quiet)
    task = bar.add_task("cases", total=total, completed=before, rate="")
    pace, named, spoken = Pace(total, before), 0, time.monotonic()

    def advance(count: int, part: "Part") -> None:
        nonlocal named, spoken
        for said in in_sentences(part.failures):
            named += 1
            if named <= MOST_NAMED:
                note(said)
            elif named == MOST_NAMED + 1:
                note("more cases failed; the report names all")
        pace.done += count
        bar.update(task, advance=count, rate=f"{pace.rate:.3g}/s")
        if quiet and time.monotonic() - spoken > QUIET_SECONDS:
            spoken = time.monotonic()
            note(str(pace))

    with bar:
        yield advance


def in_sentences(failures: "Sequence[Failure]") -> list[str]:
    """Return one sentence for each failure: a log that failed for one reason is named once, with all its verbs.

    Examples
    --------
    >>> from experiments.batch.rows import Failure
    >>> in_sentences([Failure("a.csv", verb, "it is empty") for verb in ("diagnose", "estimate")])
    ['a.csv (diagnose, estimate): it is empty']
    """
    verbs: dict[tuple[str, str], dict[str, None]] = {}
    for one in failures:
        verbs.setdefault((one.series, one.reason), {})[one.verb] = None
    return [f"{series} ({', '.join(each)}): {reason}" for (series, reason), each in verbs.items()]


class Pace:
    """Pace of a run: cases per second, and the time left."""

    def __init__(self, total: int, before: int) -> None:
        self.total, self.done, self._before, self._begin = total, before, before, time.monotonic()

    @property
    def rate(self) -> float:
        """Cases per second since the beginning [1/s]."""
        return (self.done - self._before) / max(time.monotonic() - self._begin, 1e-9)

    def __str__(self) -> str:
        rate = self.rate
        left = (self.total - self.done) / rate if rate > 0.0 else 0.0
        pace = f"{1.0 / rate:.2g} s each" if 0.0 < rate < 1.0 else f"{rate:.3g} a second"
        return f"{self.done} of {self.total} cases, {pace}, {duration(left)} left"


def duration(seconds: float) -> str:
    """Return a duration in everyday units.

    Parameters
    ----------
    seconds : float
        The time [s].

    Returns
    -------
    str
        In seconds, minutes or hours.

    Examples
    --------
    >>> duration(5.2), duration(300.0), duration(40_000.0)
    ('5 s', '5 min', '11.1 h')
    """
    if seconds < 90.0:
        return f"{max(1.0, seconds):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
