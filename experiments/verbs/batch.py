"""`hydrostate batch STUDY`: run a study file's cases into a store, or go on where the last run stopped."""

import os
import signal
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import json_text
from experiments.command.options import Json, argument, flag, option
from experiments.command.terminal import INTERRUPTED, SOME_FAILED, USAGE, emit, note
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.batch.cases import Plan
    from experiments.batch.part_store import PartStore
    from experiments.batch.runner import Tally
    from experiments.batch.study_file import Study
    from experiments.batch.work import Part

QUIET_SECONDS = 30.0
"""Time between lines of progress where standard error is no terminal [s]."""

MOST_NAMED = 20
"""So many failed cases are named as they come; the store and the report name all."""

ENDINGS = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask a batch to end: Ctrl-C, and that of a system that shuts down."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate batch fleet-archive --logs 'archive/**/*.csv' --out results/fleet")
def batch(
    study: Annotated[
        str, argument("STUDY", "Study file (TOML), or the name of an installed study: eha-paper, fleet-archive.")
    ],
    out: Annotated[
        str | None, option("STORE", "Folder or URL (s3://...) of the store; results/<study> by default.", "--out", "-o")
    ] = None,
    dry_run: Annotated[bool, flag("--dry-run", "Print the number of cases and what they cost, and stop.")] = False,
    resume: Annotated[
        bool, flag("--resume/--no-resume", "Keep the cases that the store has, or run all again.")
    ] = True,
    retry_failed: Annotated[bool, flag("--retry-failed", "Run failed cases again.")] = False,
    workers: Annotated[int | None, option("N", "Number of processes; by default the number of cores.", min=1)] = None,
    cluster: Annotated[
        str | None, option("ADDRESS", "Scheduler of a Dask cluster to use, such as tcp://host:8786.")
    ] = None,
    max_failures: Annotated[int | None, option("N", "Stop once more than N cases have failed.", min=0)] = None,
    logs: Annotated[str | None, option("GLOB", "Glob of logs, instead of that in the study file.")] = None,
    as_json: Json = False,
) -> None:
    """Run a study of many cases into a store that survives interruptions, and write its report.

    Cases that are in the store are not run again: after a crash or Ctrl-C, the same command continues where it stopped;
    of a changed study, only the changed cases are run. A case that fails becomes a row with its reason. The last line
    of standard output is the path of the report.
    """
    from experiments.batch.cases import plan_study
    from experiments.batch.part_store import open_store
    from experiments.batch.study_file import SHIPPED, read_study, shipped_studies, study_path

    chosen = _with_logs(read_study(study), logs)
    shipped = study in shipped_studies() and not Path(study).exists()
    folder = Path() if shipped or logs is not None else study_path(study).parent
    plan = plan_study(chosen, folder)
    store = open_store(out or f"results/{chosen.name}")
    width = workers or os.cpu_count() or 1
    if dry_run:
        _say_plan(plan, store, width, retry_failed, as_json)
        return
    from experiments.batch.reporting import write_report

    begin = time.perf_counter()
    source = f"{SHIPPED}/{study}.toml" if shipped else Path(study).name
    with store.writing():
        tally, before = run_plan(plan, store, source, width, cluster, max_failures, resume, retry_failed)
        report = write_report(store, store.folder)
    _finish(plan, store, tally, before, report, as_json, time.perf_counter() - begin)


def _with_logs(study: "Study", pattern: str | None) -> "Study":
    if pattern is None:
        return study
    if not study.logs:
        raise HydrostateError(f"--logs replaces the logs of a study, and {study.name} has none")
    return study.model_copy(update={"logs": tuple(one.model_copy(update={"glob": pattern}) for one in study.logs)})


def _say_plan(plan: "Plan", store: "PartStore", workers: int, again: bool, as_json: bool) -> None:
    wanted = plan.keys
    left = set(wanted) - (set() if store.manifest() is None else store.done(again=again)[0])
    seconds = plan.seconds * (len(left) / len(wanted)) / workers
    series = sum(len(one) for one, _ in plan.blocks)
    if as_json:
        entries = {"outcome": "ok", "study": plan.study.name, "store": store.name, "cases": len(wanted)}
        emit(json_text([{**entries, "series": series, "left": len(left), "seconds": seconds, "workers": workers}]))
        return
    emit(f"{plan.study.name}: {len(wanted)} cases on {series} series; {len(left)} are not in {store.name} yet")
    width = f"{workers} worker{'s' if workers > 1 else ''}"
    emit(f"about {duration(seconds)} with {width} (a rough guess from typical costs)")


def run_plan(
    plan: "Plan",
    store: "PartStore",
    source: str,
    workers: int,
    cluster: str | None = None,
    max_failures: int | None = None,
    resume: bool = True,
    again: bool = False,
) -> "tuple[Tally, int]":
    """Run what a store does not have yet, with progress on standard error.

    Parameters
    ----------
    source : str
        What the study is called in the manifest.

    Returns
    -------
    tuple of Tally and int
        What was run, and how many cases the store had before.
    """
    from experiments.batch.runner import manifest_of, run_batch
    from experiments.running.executors import open_executor

    manifest = manifest_of(plan, source)
    if resume:
        _say_differences(store.manifest(), manifest)
    else:
        store.clear()
    done, broken = store.done(again=again)
    for name in broken:
        note(f"part {name} of {store.name} cannot be read: it is set aside, and its cases are run again")
    wanted = plan.keys
    store.describe(manifest, wanted)
    before = len(done.intersection(wanted))
    if before:
        note(f"{before} of {len(wanted)} cases are in {store.name} already")
    with _shown(len(wanted), before) as advance, _interruptible() as stop:
        opener = partial(open_executor, workers, cluster)
        tally = run_batch(plan, store, done, opener, stop=stop, on_part=advance, max_failures=max_failures)
    return tally, before


def _say_differences(old: Any, new: Any) -> None:
    """Say where kept rows were made by other software than what is to be made now."""
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
    """Turn the first Ctrl-C, or the system's request to end, into a wish to stop; a second one stops at once."""
    stop = Event()

    def wish(number: int, frame: object) -> None:
        del number, frame
        stop.set()
        for one in ENDINGS:
            signal.signal(one, signal.default_int_handler)
        note("interrupted: finishing the running cases; press Ctrl-C again to stop at once")

    before = {one: signal.signal(one, wish) for one in ENDINGS}
    try:
        yield stop
    finally:
        for one, was in before.items():
            signal.signal(one, was)


@contextmanager
def _shown(total: int, before: int) -> "Generator[Callable[[int, Part], None]]":
    """Show cases done, their rate and the time left; failures are named as they come."""
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
        for case, reason in part.failures:
            named += 1
            if named <= MOST_NAMED:
                note(f"{case}: {reason}")
            elif named == MOST_NAMED + 1:
                note("more cases failed; the report names all")
        pace.done += count
        bar.update(task, advance=count, rate=f"{pace.rate:.3g}/s")
        if quiet and time.monotonic() - spoken > QUIET_SECONDS:
            spoken = time.monotonic()
            note(str(pace))

    with bar:
        yield advance


class Pace:
    """How fast cases are done, and how long the rest will take."""

    def __init__(self, total: int, before: int) -> None:
        self.total, self.done, self._before, self._begin = total, before, before, time.monotonic()

    @property
    def rate(self) -> float:
        """Cases a second since the beginning [1/s]."""
        return (self.done - self._before) / max(time.monotonic() - self._begin, 1e-9)

    def __str__(self) -> str:
        left = (self.total - self.done) / self.rate if self.rate > 0.0 else 0.0
        return f"{self.done} of {self.total} cases, {self.rate:.3g} a second, {duration(left)} left"


def duration(seconds: float) -> str:
    """Return a length of time as a person says it.

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


def _finish(
    plan: "Plan", store: "PartStore", tally: "Tally", before: int, report: str, as_json: bool, seconds: float
) -> None:
    total = len(plan.keys)
    failed = sum(outcome == "failed" for outcome in store.rows(["outcome"])["outcome"].to_pylist())
    done = before + tally.done
    if tally.stopped:
        note(f"{tally.stopped}: {done} of {total} cases are kept in {store.name}; the same command goes on from there")
    else:
        kept = f", {before} of them from before" if before else ""
        note(f"{done} of {total} cases done{kept}, {failed} failed")
    entries = {"study": plan.study.name, "store": store.name, "report": report, "cases": total, "done": done}
    if as_json:
        outcome = "interrupted" if tally.stopped else "ok"
        emit(json_text([{"outcome": outcome, **entries, "failed": failed, "ran": tally.done, "seconds": seconds}]))
    else:
        emit(report)
    if tally.stopped == "interrupted":
        raise typer.Exit(INTERRUPTED)
    if failed:
        raise typer.Exit(USAGE if failed == total else SOME_FAILED)
