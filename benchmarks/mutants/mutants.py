"""Mutation tests: faults are planted in a copy of the tree, and the fast tests that can notice them run on it.

`make coverage` records which test executes which line. Then `python -m benchmarks mutants --sample 600 --results FILE`
draws faults at random from the formulas of `plant`, `estimation` and `faults` (see `benchmarks.mutants.mutation`). Each
fault runs against the tests that execute its line, its own file's tests first, until one fails
(`benchmarks.mutants.executed`). A fault that makes the tests hang counts as noticed. Faults come in random order, so a
partial run is a fair sample too; faults already in ``--results`` are skipped. Without coverage data, or if a file was
edited since, a fault runs against the tests of the mirrored folder.

Kernels go to ``HYDROSTATE_CACHE`` if it is set, so that a second run finds them.
"""

import argparse
import hashlib
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from benchmarks.mutants.executed import Executed
from benchmarks.mutants.mutation import Mutant, count_mutants, mirrored_tests, mutants_of

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("plant", "estimation", "faults")
LEAST_SCORE = 0.9
"""Minimum share of faults that the fast tests must notice [fraction]."""

COVERAGE_DATA = "build/coverage/data"
"""Where `make coverage` stores which test executes which line."""

FIRST_FILES = 5
"""Number of test files that run before all others [count]."""

NOT_COPIED = (".git", ".venv", ".peers", "results", "build", "dist", ".hypothesis", ".ruff_cache", "__pycache__")


def main(arguments: Sequence[str]) -> int:
    """Print the score and the survivors; return whether the score is too low."""
    given = _options().parse_args(arguments)
    record = ROOT / given.record
    executed = Executed(ROOT, record) if record.is_file() else None
    if executed is None:
        print(f"no {given.record}: run `make coverage` first to try each fault on all tests that execute its line")
    chosen = draw(ROOT, given.folder or FOLDERS, given.sample, given.seed)
    results = Results(None if given.results is None else Path(given.results))
    with ExitStack() as stack:
        free: SimpleQueue[Tree] = SimpleQueue()
        for _ in range(given.workers):
            free.put(stack.enter_context(Tree()))

        def tried(mutant: Mutant) -> None:
            tree = free.get()
            tests = _tests(executed, mutant)
            verdict = tree.verdict(mutant, tests, given.seconds)
            free.put(tree)
            results.add(mutant, verdict)

        with ThreadPoolExecutor(given.workers) as threads:
            list(threads.map(tried, [mutant for mutant in chosen if results.verdict(mutant) is None]))
    return _print_score(chosen, results)


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks mutants", description=__doc__)
    parser.add_argument("--folder", action="append", help="folder or file of plant, estimation or faults; repeatable")
    parser.add_argument("--sample", type=int, default=40, help="how many faults are drawn")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--record", default=COVERAGE_DATA, help="what `make coverage` left")
    parser.add_argument("--results", help="file of verdicts, one a line; those it has are not tried again")
    parser.add_argument("--workers", type=int, default=1, help="how many faults are tried at once")
    parser.add_argument("--seconds", type=float, default=120.0, help="processor time after which a fault has survived")
    return parser


def draw(root: Path, folders: Sequence[str], sample: int, seed: int) -> list[Mutant]:
    """Draw faults at random, all equally likely.

    Parameters
    ----------
    folders : sequence of str
        Folders or files, relative to the root.
    sample : int
        Number of faults [count]; all if there are fewer.
    seed : int
        Seed of the draw.
    """
    files = sorted({path for folder in folders for path in _sources(root / folder)})
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    all_of_them = [(path, number) for path in files for number in range(count_mutants(texts[path]))]
    drawn = random.Random(seed).sample(all_of_them, min(sample, len(all_of_them)))  # noqa: S311  no secret
    return [
        mutant for path, number in drawn for mutant in mutants_of(str(path.relative_to(root)), texts[path], [number])
    ]


def _sources(place: Path) -> list[Path]:
    return [place] if place.is_file() else [path for path in place.rglob("*.py") if path.name != "__init__.py"]


def _tests(executed: Executed | None, mutant: Mutant) -> list[str]:
    return mirrored_tests(ROOT, mutant.path) if executed is None else executed.tests(mutant.path, mutant.line)


class Tree:
    """A copy of the project in which one fault at a time is planted, and a process that runs tests there."""

    def __enter__(self) -> "Tree":
        self._stack = ExitStack()
        kept = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="mutants-")))
        self.place = kept / "tree"
        shutil.copytree(ROOT, self.place, ignore=shutil.ignore_patterns(*NOT_COPIED), symlinks=True)
        environment = {
            "HYDROSTATE_CACHE": str(kept / "kernels"),
            **os.environ,
            "PYTHONPATH": str(self.place),
            "OPENBLAS_NUM_THREADS": "1",
        }
        self._runner = self._stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "benchmarks.mutants.forked"],
                cwd=self.place,
                env=environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        )
        self._sound: dict[str, bool] = {}
        self._planted = 0
        # collects these tests, so that the runner has imported their modules
        self.ran([], ["tests/plant/eha", "tests/faults/diagnosis"], 300.0, collect=True)
        return self

    def __exit__(self, *_: object) -> None:
        assert self._runner.stdin is not None  # noqa: S101  it is a pipe
        self._runner.stdin.close()
        self._stack.close()

    def ran(self, tests: Sequence[str], files: Sequence[str], seconds: float, **how: bool) -> dict[str, Any]:
        """Run tests in the current state of the copy, see `benchmarks.mutants.forked.run_forked`."""
        assert self._runner.stdin is not None  # noqa: S101  it is a pipe
        assert self._runner.stdout is not None  # noqa: S101  likewise
        print(
            json.dumps({"tests": tests, "files": files, "seconds": seconds, **how}),
            file=self._runner.stdin,
            flush=True,
        )
        return json.loads(self._runner.stdout.readline())

    def verdict(self, mutant: Mutant, tests: Sequence[str], seconds: float) -> dict[str, Any]:
        """Plant a fault, run tests until one fails that passes without the fault, then remove the fault.

        Returns
        -------
        dict
            ``noticed``, ``by`` which test, ``tried`` tests [count], whether ``cut_short``, and ``seconds``.
        """
        place, spent = self.place / mutant.path, 0.0
        sound, dated = place.read_text(encoding="utf-8"), place.stat()
        while True:
            self._planted += 1
            chosen = [test for test in tests if self._sound.get(test, True)]
            place.write_text(mutant.source, encoding="utf-8")
            os.utime(place, (self._planted, self._planted))  # so that no two faults share compiled code
            found = self._run_tests(chosen, seconds)
            place.write_text(sound, encoding="utf-8")
            os.utime(place, ns=(dated.st_atime_ns, dated.st_mtime_ns))
            spent += found["seconds"]
            by = next(iter(found["failed"]), None)
            if found["code"] in {0, 5} or by is None or self._passes(by):
                noticed = found["code"] not in {0, 5} and not found["cut_short"]
                told = {key: found[key] for key in ("code", "tried", "cut_short")}
                return {"noticed": noticed or by is not None, "by": by, **told, "seconds": round(spent, 1)}

    def _run_tests(self, tests: Sequence[str], seconds: float) -> dict[str, Any]:
        """Run the tests of a few files first: importing a hundred files takes longer than most faults survive."""
        files = list(dict.fromkeys(test.partition("::")[0] for test in tests))
        told = {"code": 5, "failed": [], "tried": 0, "cut_short": False, "seconds": 0.0}
        for some in (files[:FIRST_FILES], files[FIRST_FILES:]):
            if some and told["code"] in {0, 5} and not told["cut_short"]:
                named = [test for test in tests if "::" in test and test.partition("::")[0] in some]
                found = self.ran(named, some, seconds)
                told = found | {"seconds": told["seconds"] + found["seconds"], "tried": told["tried"] + found["tried"]}
        return told

    def _passes(self, test: str) -> bool:
        """Return whether a test passes without any fault."""
        if test not in self._sound:
            self._sound[test] = self._run_tests([test], 300.0)["code"] in {0, 5}
            if not self._sound[test]:
                print(f"fails without any fault: {test}", flush=True)
        return self._sound[test]


class Results:
    """Verdicts, saved to a file as they arrive.

    Parameters
    ----------
    file : Path or None
        File with one verdict on each line; None keeps them only in memory.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._lock = threading.Lock()
        lines = file.read_text(encoding="utf-8").splitlines() if file is not None and file.exists() else []
        self._known: dict[str, dict[str, Any]] = {one["id"]: one for one in map(json.loads, lines)}

    def verdict(self, mutant: Mutant) -> dict[str, Any] | None:
        """Return the verdict on a fault, if there is one."""
        return self._known.get(_id(mutant))

    def add(self, mutant: Mutant, verdict: dict[str, Any]) -> None:
        """Save and print a verdict."""
        with self._lock:
            self._known[_id(mutant)] = one = {"id": _id(mutant), "fault": _name(mutant), **verdict}
            said = "noticed " if verdict["noticed"] else "SURVIVES"
            print(f"{len(self._known):4d} {said} {verdict['seconds']:6.1f} s  {_name(mutant)}", flush=True)
            if self._file is not None:
                with self._file.open("a", encoding="utf-8") as file:
                    print(json.dumps(one), file=file)


def _id(mutant: Mutant) -> str:
    """Return a key that distinguishes a fault from all others, including those of earlier versions of the file."""
    return hashlib.sha256(f"{mutant.path}\n{mutant.source}".encode()).hexdigest()[:16]


def _name(mutant: Mutant) -> str:
    return f"{mutant.path}:{mutant.line}  {mutant.change}"


def _print_score(chosen: Sequence[Mutant], results: Results) -> int:
    verdicts = [(mutant, found) for mutant, found in _with_verdicts(chosen, results)]
    survivors = [mutant for mutant, found in verdicts if not found["noticed"]]
    score = 1.0 - len(survivors) / max(len(verdicts), 1)
    print(f"\n{len(verdicts) - len(survivors)} of {len(verdicts)} planted faults noticed: {score:.1%}")
    for mutant in survivors:
        print(f"  {_name(mutant)}")
    return int(score < LEAST_SCORE)


def _with_verdicts(chosen: Sequence[Mutant], results: Results) -> Iterator[tuple[Mutant, dict[str, Any]]]:
    for mutant in chosen:
        found = results.verdict(mutant)
        if found is not None:
            yield mutant, found
