"""Do the tests bite? Faults are planted in a copy of the tree, and the tests that mirror each file are run on it.

`python -m benchmarks mutants --folder plant/eha --sample 40 --seed 0` draws faults at random from a folder's formulas
(see `benchmarks.mutation`), runs the fast tests of the mirrored folder for each, stops at the first that fails, and
lists the faults that none noticed. ``--own`` asks each file's own test alone. With ``--then-all`` survivors go to the
rest of the fast suite. A fault that makes the tests hang counts as noticed. Kernels go to ``HYDROSTATE_CACHE`` if that
is set, so that a second run finds them.
"""

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.mutation import Mutant, count_mutants, mirrored, mutants_of

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("plant", "estimation", "faults")
LEAST_SCORE = 0.9
"""Share of the faults that the fast tests are to notice [fraction]."""

PATIENCE, LEAST_WAIT = 5.0, 120.0
"""A run that takes so many times as long as without a fault hangs, but not before so many seconds [s]."""

LEFT_BEHIND = (".git", ".venv", ".peers", "results", "build", "dist", ".hypothesis", ".ruff_cache", "__pycache__")


def main(arguments: Sequence[str]) -> int:
    """Print the score and the survivors; return whether the score is too low."""
    given = _options().parse_args(arguments)
    chosen = draw(ROOT, given.folder or FOLDERS, given.sample, given.seed)
    with tempfile.TemporaryDirectory(prefix="mutants-") as kept:
        copy = Path(kept) / "tree"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*LEFT_BEHIND), symlinks=True)
        kernels = Path(os.environ.get("HYDROSTATE_CACHE", Path(kept) / "kernels"))
        survivors = _tried(copy, kernels, chosen, own=given.own, then_all=given.then_all)
    score = 1.0 - len(survivors) / max(len(chosen), 1)
    print(f"\n{len(chosen) - len(survivors)} of {len(chosen)} planted faults noticed: {score:.1%}")
    for one in survivors:
        print(f"  {one.path}:{one.line}  {one.change}")
    return int(score < LEAST_SCORE)


def _options() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks mutants", description=__doc__)
    parser.add_argument("--folder", action="append", help="folder or file of plant, estimation or faults; repeatable")
    parser.add_argument("--sample", type=int, default=40, help="how many faults are drawn")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--own", action="store_true", help="run a file's own test alone, where it has one: seconds a fault"
    )
    parser.add_argument("--then-all", action="store_true", help="give survivors to the whole fast suite")
    return parser


def draw(root: Path, folders: Sequence[str], sample: int, seed: int) -> list[Mutant]:
    """Draw faults at random, each as likely as any other.

    Parameters
    ----------
    root : Path
        The project.
    folders : sequence of str
        Folders or files, from there.
    sample : int
        How many [count]; all if there are fewer.
    seed : int
        Of the draw.

    Returns
    -------
    list of Mutant
        By file and line.
    """
    files = sorted({path for folder in folders for path in _sources(root / folder)})
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    all_of_them = [(path, number) for path in files for number in range(count_mutants(texts[path]))]
    drawn = random.Random(seed).sample(all_of_them, min(sample, len(all_of_them)))  # noqa: S311  no secret
    return [
        mutant
        for path in files
        for mutant in mutants_of(
            str(path.relative_to(root)), texts[path], sorted(number for at, number in drawn if at == path)
        )
    ]


def _sources(place: Path) -> list[Path]:
    return [place] if place.is_file() else [path for path in place.rglob("*.py") if path.name != "__init__.py"]


def _tried(copy: Path, kernels: Path, chosen: Sequence[Mutant], *, own: bool, then_all: bool) -> list[Mutant]:
    """Return the faults that no test noticed."""
    waits: dict[tuple[str, ...], float] = {}
    survivors: list[Mutant] = []
    for number, mutant in enumerate(chosen, start=1):
        tests = tuple(mirrored(copy, mutant.path))
        tests = tests[:-1] if own and len(tests) > 2 else tests
        if tests not in waits:
            begin = time.perf_counter()
            if not _passes(copy, kernels, tests, None):
                raise SystemExit(f"{' '.join(tests)} fail without any fault")
            waits[tests] = max(LEAST_WAIT, PATIENCE * (time.perf_counter() - begin))
        place = copy / mutant.path
        sound = place.read_text(encoding="utf-8")
        place.write_text(mutant.source, encoding="utf-8")
        begin = time.perf_counter()
        survives = _passes(copy, kernels, tests, waits[tests])
        if survives and then_all:
            survives = _passes(copy, kernels, ("tests", *FOLDERS), None)
        place.write_text(sound, encoding="utf-8")
        said = "SURVIVES" if survives else "noticed "
        took = time.perf_counter() - begin
        print(f"{number:4d} {said} {took:6.1f} s  {mutant.path}:{mutant.line}  {mutant.change}", flush=True)
        survivors += [mutant] if survives else []
    return survivors


def _passes(copy: Path, kernels: Path, tests: Sequence[str], wait: float | None) -> bool:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-m", "not slow", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "HYDROSTATE_CACHE": str(kernels), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        done = subprocess.run(  # noqa: S603  our own
            command, cwd=copy, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=wait
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0
