"""Runs tests in forks of a process that has imported everything outside the tree, which saves seconds in each run.

`python -m benchmarks.mutants.forked` reads one task on each line of standard input and answers each on one line, both
in JSON. It imports nothing of the packages itself, so each fork reads their files as they are at that moment.
"""

import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

MOST_EXCESS_SECONDS = 60
"""A run counts as hanging if it exceeds its allowed processor time by this much [s]."""

MOST_SECONDS = 900
"""A run counts as hanging after this time, however little it does [s]."""

OPTIONS = ("-q", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:terminalreporter", "-p", "no:xdist")
WARNING_OPTIONS = ("-W", "ignore::pytest.PytestAssertRewriteWarning")
"""Modules imported before pytest sees them keep their assertions unrewritten; this silences the warning."""


class Chosen:
    """Keeps the chosen tests, in the given order, and stops when time is up.

    Parameters
    ----------
    tests : sequence of str
        Names of tests; empty for all tests of the files.
    allowed : float
        Processor time [s].
    """

    def __init__(self, tests: Sequence[str], allowed: float) -> None:
        self.place = {name: i for i, name in enumerate(tests)}
        self.allowed = allowed
        self.failed: list[str] = []
        self.tried = 0
        self.cut_short = False

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Deselect tests that were not chosen."""
        if self.place:
            items[:] = sorted(
                (item for item in items if item.nodeid in self.place), key=lambda item: self.place[item.nodeid]
            )

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record failures."""
        self.tried += report.when == "call"
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Record import errors."""
        if report.failed:
            self.failed.append(report.nodeid)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Any:
        """Stop when time is up."""
        yield
        if time.process_time() > self.allowed:
            self.cut_short = True
            item.session.shouldstop = "time is up"


def run_forked(task: Mapping[str, Any]) -> dict[str, Any]:
    """Run tests in a fork and return their results.

    Parameters
    ----------
    task : Mapping[str, Any]
        ``tests``: names, the first file's first; ``files``; ``seconds`` of processor time; ``all``: do not stop at the
        first failure; ``collect``: run no tests, but report which modules were imported.

    Returns
    -------
    dict
        ``code`` of pytest, or None if it hung; ``failed`` tests; ``tried`` [count]; ``cut_short``; ``modules``.
    """
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="forked-") as folder:
        answer = Path(folder) / "answer.json"
        child = os.fork()
        if not child:
            _run_in_fork(task, answer)
        signal.signal(signal.SIGALRM, lambda *_: _kill_group(child))
        signal.alarm(MOST_SECONDS)
        os.waitpid(child, 0)
        signal.alarm(0)
        _kill_group(child)  # also ends the processes that it started
        hung = {"code": None, "failed": [], "tried": 0, "cut_short": False}
        told = json.loads(answer.read_text()) if answer.exists() else hung
    return {**told, "seconds": time.monotonic() - begin}


def _kill_group(child: int) -> None:
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)


def _run_in_fork(task: Mapping[str, Any], answer: Path) -> None:
    os.setsid()
    # With bytecode left behind, a fault of the same size within a second of the last one would be taken for that one.
    sys.dont_write_bytecode = True
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    limit = int(task["seconds"] + time.process_time()) + MOST_EXCESS_SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    plugin = Chosen(task["tests"], task["seconds"] + time.process_time())
    how = ["--collect-only"] if task.get("collect") else [] if task.get("all") else ["-x"]
    code = int(pytest.main([*OPTIONS, *WARNING_OPTIONS, *how, *task["files"]], plugins=[plugin]))
    told: dict[str, Any] = {"code": code, "failed": plugin.failed, "tried": plugin.tried}
    if task.get("collect"):
        told["modules"] = _modules_outside_tree()
    answer.write_text(json.dumps({**told, "cut_short": plugin.cut_short}))
    os._exit(0)


def _modules_outside_tree() -> list[str]:
    here = str(Path.cwd())
    files = {name: getattr(module, "__file__", None) for name, module in list(sys.modules.items())}
    return [name for name, file in files.items() if file and not (file.startswith(here) and ".venv" not in file)]


def main() -> int:
    """Answer tasks until input ends."""
    for line in sys.stdin:
        task = json.loads(line)
        answer = run_forked(task)
        for name in answer.pop("modules", []):
            with suppress(Exception):
                importlib.import_module(name)
        print(json.dumps(answer), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
