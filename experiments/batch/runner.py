"""`run_batch(plan, store, ...)`: runs every case that the store lacks, and stores each task when it is done."""

import hashlib
import platform
import shutil
import subprocess
from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Event
from typing import Any

from experiments.batch.cases import Plan, Task, config_hash, package_version
from experiments.batch.part_store import PartStore
from experiments.batch.series import Group
from experiments.batch.work import Part, lost_task, run_task
from plant.errors import HydrostateError

ROOT = Path(__file__).resolve().parents[2]

METHODS = ("plant", "estimation", "faults")
"""Packages whose code computes the numbers of a row."""

WORKER_ENDED = "the worker process ended while it ran this case, as when memory runs out"

Opener = Callable[[], AbstractContextManager[tuple[Executor, int]]]
OnPart = Callable[[int, Part], None]


@dataclass
class Tally:
    """Progress of a batch.

    Parameters
    ----------
    stopped : str
        Why tasks were left unstarted; empty if all were started.
    """

    done: int = 0
    failed: int = 0
    stopped: str = ""


@dataclass(eq=False)
class _Batch:
    store: PartStore
    tasks: Iterator[Task]
    stop: Event
    on_part: OnPart
    max_failures: int | None
    tally: Tally = field(default_factory=Tally)
    suspects: deque[Task] = field(default_factory=deque[Task])
    """Tasks that were in flight when a worker died; they are run alone to find out which of them kills it."""

    def next_task(self) -> Task | None:
        if self.stop.is_set() or self.tally.stopped:
            return None
        return self.suspects.popleft() if self.suspects else next(self.tasks, None)

    def has_tasks_left(self) -> bool:
        """Return whether a task was not started; an interruption after the last task stops nothing."""
        return bool(self.suspects) or next(self.tasks, None) is not None

    def keep(self, task: Task, part: Part) -> None:
        self.store.add(part.content, task.keys)
        self.tally.done += len(task.keys)
        self.tally.failed += len(part.failures)
        self.on_part(len(task.keys), part)
        if self.max_failures is not None and self.tally.failed > self.max_failures:
            self.tally.stopped = f"{self.tally.failed} cases failed, --max-failures is {self.max_failures}"

    def suspect(self, task: Task, *, alone: bool) -> None:
        """Record a task whose worker died. A task that killed it alone is halved; a single case is given up."""
        if not alone:
            self.suspects.append(task)
        elif len(task.keys) == 1:
            self.keep(task, lost_task(task, WORKER_ENDED))
        else:
            self.suspects.extendleft(reversed(_halves(task)))


def run_batch(
    plan: Plan,
    store: PartStore,
    done: Collection[str],
    opener: Opener,
    *,
    stop: Event,
    on_part: OnPart,
    max_failures: int | None = None,
) -> Tally:
    """Run the cases of a study that are not done.

    A part is written when its task is done, so if this process ends for any reason, only the tasks in flight are lost.

    Parameters
    ----------
    store : PartStore
        Where rows go; the caller holds the right to write to it.
    done : collection of str
        Keys of cases that need not be run.
    opener : callable
        Opens an executor and returns how many tasks it runs at a time, see
        `experiments.running.executors.open_executor`.
    stop : Event
        When it is set, no new task is started; those in flight are finished and kept.
    on_part : callable
        Called with the number of cases and the part, after the part has been stored.
    max_failures : int, optional
        No new task is started once more cases than this have failed.

    Raises
    ------
    HydrostateError
        If the store cannot be written, or the cluster goes away.
    """
    batch: _Batch | None = None
    while True:
        with opener() as (executor, width):
            if batch is None:
                batch = _Batch(store, plan.tasks(done, width), stop, on_part, max_failures)
            if not _run_all_tasks(batch, executor, width):
                continue
        if stop.is_set() and not batch.tally.stopped and batch.has_tasks_left():
            batch.tally.stopped = "interrupted"
        return batch.tally


def _run_all_tasks(batch: _Batch, executor: Executor, width: int) -> bool:
    """Run tasks until none is left; return False if the executor broke and must be reopened."""
    flying: dict[Future[Part], Task] = {}
    while True:
        alone = bool(batch.suspects)
        whole = _launch(batch, executor, flying, 1 if alone or width == 1 else 2 * width)
        if not flying:
            return whole
        finished, _ = wait(flying, timeout=0.5, return_when=FIRST_COMPLETED)
        for future in finished:
            task = flying.pop(future)
            try:
                part = future.result()
            except CancelledError as error:
                raise HydrostateError("the cluster went away; run the same command again to go on") from error
            except Exception as error:
                broken = isinstance(error, BrokenExecutor)
                if not broken and type(error).__name__ != "KilledWorker":  # Dask's error; Dask need not be installed
                    raise
                whole = whole and not broken
                batch.suspect(task, alone=alone)
            else:
                batch.keep(task, part)
        if not whole:
            for task in flying.values():
                batch.suspect(task, alone=alone)
            return False


def _launch(batch: _Batch, executor: Executor, flying: dict[Future[Part], Task], most: int) -> bool:
    """Submit tasks until a number are in flight; return False if the executor is broken."""
    while len(flying) < most:
        task = batch.next_task()
        if task is None:
            return True
        try:
            flying[executor.submit(run_task, task)] = task
        except BrokenExecutor:
            batch.suspects.appendleft(task)
            return False
    return True


def _halves(task: Task) -> list[Task]:
    cases = [Group(one.series, (key,), (work,)) for one in task.groups for key, work in zip(*one[1:], strict=True)]
    middle = len(cases) // 2
    return [replace(task, groups=tuple(half)) for half in (cases[:middle], cases[middle:])]


def manifest_of(plan: Plan, source: str) -> Mapping[str, Any]:
    """Return the manifest needed to reproduce a study.

    Returns
    -------
    Mapping[str, Any]
        The study, its hash, its seeds, versions and commit.
    """
    packages = ("hydrostate", "numpy", "scipy", "llvmlite", "pyarrow", "pandas")
    return {
        "study": plan.study.name,
        "source": source,
        "question": plan.study.question,
        "cases": len(plan.keys),
        "config_hash": config_hash(plan.study, plan.rig, plan.rigs),
        "seeds": sorted({seed for runs in plan.study.runs for seed in runs.seed_list}),
        "config": plan.study.model_dump(mode="json"),
        "rig": plan.rig.name,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "versions": {name: package_version(name) for name in packages},
        "commit": _commit(),
        "sources": sources(ROOT),
    }


def _commit() -> str | None:
    """Return the commit of the sources, or None if they are not a git checkout."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        return None
    command = [git, "-C", str(ROOT), "rev-parse", "HEAD"]
    found = subprocess.run(command, capture_output=True, text=True, check=False, timeout=10)  # noqa: S603 -- fixed words
    return found.stdout.strip() or None


def sources(root: Path) -> str:
    """Return a hash of the code and data that affect the results, because an edit does not change the version.

    Returns
    -------
    str
        Sixteen digits.
    """
    files = sorted(one for name in METHODS for kind in ("*.py", "*.json") for one in (root / name).rglob(kind))
    digest = hashlib.sha256()
    for file in files:
        digest.update(f"{file.relative_to(root)}\0".encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
