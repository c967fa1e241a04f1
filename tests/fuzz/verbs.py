"""Mutated files given to the command, each in its own process: exit code, messages, time and memory are checked.

Run it as ``python -m tests.fuzz.verbs 5000 [FIRST]``; a failure is reported with kind, seed and verb.
"""

import json
import os
import resource
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.fuzz.guard import LONGEST
from tests.fuzz.seeds import seeds
from tests.fuzz.structures import struck

MOST = 2 << 30
"""Memory that a run may hold at once [bytes]."""

VERBS: Sequence[tuple[float, Sequence[str]]] = (
    (6.0, ("inspect", "LOG", "--json")),
    (1.0, ("inspect", "LOG", "--report", "page.html", "--write", "rig.toml")),
    (1.0, ("inspect", "LOG", "--with", "OTHER")),
    (2.0, ("estimate", "LOG", "--json")),
    (0.5, ("estimate", "LOG", "--form", "pressure", "--json")),
    (0.5, ("estimate", "LOG", "OTHER", "--out", "out")),
    (0.5, ("estimate", "LOG", "--sample-time", "1e-3", "--json")),
    (2.0, ("diagnose", "LOG", "--json")),
    (0.5, ("diagnose", "LOG", "--report", "page.html")),
    (2.0, ("identify", "LOG", "--json")),
    (1.0, ("identify", "LOG", "--input", "motor_speed_rad_s", "--output", "velocity_m_s", "--json")),
    (1.0, ("identify", "LOG", "--input", "Motor speed [rpm]", "--output", "Position [mm]", "--json")),
    (1.5, ("watch", "LOG")),
    (1.5, ("filter", "LOG")),
    (0.5, ("watch", "OTHER", "--healthy", "LOG")),
    (0.5, ("filter", "OTHER", "--like", "LOG")),
    (0.3, ("fleet", "FOLDER", "--workers", "1", "--out", "fleet")),
    (0.3, ("batch", "STUDY", "--workers", "1", "--out", "store", "--json")),
)
"""Weight of each command among the runs, and its words; LOG is the mutated file, OTHER an intact one."""

STUDY = """
name = "mutated"
[[logs]]
glob = "logs/*"
methods = [{ verb = "diagnose" }, { verb = "estimate" }]
"""


class Run(NamedTuple):
    """How a run of the command ended."""

    code: int
    signal: int
    seconds: float
    memory: int
    out: str
    err: str


def prepare(whole: Path) -> None:
    """Run each verb once on an intact log, so that forked processes inherit its imports and compiled code."""
    from typer.testing import CliRunner

    from experiments.cli import app

    for _, words in VERBS[:-2]:
        done = CliRunner().invoke(app, [str(whole) if word in ("LOG", "OTHER") else word for word in words])
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            raise done.exception
    for name in ("h5py", "nptdms", "openpyxl", "asammdf", "scipy.io", "pandas", "pyarrow.parquet", "pyarrow.feather"):
        __import__(name)


def run(words: Sequence[str], folder: Path, stdin: bytes = b"") -> Run:
    """Run the command in a fork of this process, in a folder."""
    out, err = folder / ".out", folder / ".err"
    (folder / ".in").write_bytes(stdin)
    child = os.fork()
    if not child:
        try:
            os.chdir(folder)
            for path, number, flags in (
                (folder / ".in", 0, os.O_RDONLY),
                (out, 1, os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
                (err, 2, os.O_WRONLY | os.O_CREAT | os.O_TRUNC),
            ):
                os.dup2(os.open(path, flags), number)
            # pytest replaced the standard streams and the floating-point settings
            np.seterr(all="warn", under="ignore")
            sys.stdin, sys.stdout, sys.stderr = (os.fdopen(k, mode, closefd=False) for k, mode in enumerate("rww"))
            resource.setrlimit(resource.RLIMIT_AS, (3 * MOST, 3 * MOST))
            resource.setrlimit(resource.RLIMIT_CPU, (int(2 * LONGEST), int(2 * LONGEST) + 1))
            sys.argv = ["hydrostate", *words]
            from experiments.cli import main

            main()
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            os._exit(99)
    _, status, used = os.wait4(child, 0)
    said = [path.read_text(errors="surrogateescape") for path in (out, err)]
    seconds = used.ru_utime + used.ru_stime
    code = os.waitstatus_to_exitcode(status)
    return Run(max(code, 0), max(-code, 0), seconds, used.ru_maxrss << 10, *said)


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no JSON")


def wrong_with(words: Sequence[str], ended: Run) -> str:
    """Return what is wrong with the end of a run, or an empty string."""
    if ended.signal or ended.code not in (0, 1, 2):
        return f"exit code {ended.code}, signal {ended.signal}: {ended.err[-300:]!r}"
    if ended.seconds > LONGEST:
        return f"{ended.seconds:.1f} s"
    if ended.memory > MOST:
        return f"{ended.memory / 2**20:.0f} MB"
    for token in ("internal error", "Traceback", "\x1b", "Warning: ", "Error: <", " at 0x7f"):
        if token in ended.err or token in ended.out:
            return f"{token!r} in {ended.err[-300:]!r}"
    if ended.code and not ended.err.strip():
        return f"exit code {ended.code} without a word"
    if len(ended.err) > 6000:
        return f"{len(ended.err)} characters of errors: {ended.err[:200]!r}"
    try:
        if "--json" in words and ended.out.strip():
            found = json.loads(ended.out, parse_constant=_no_constant)
            outcomes = [one.get("outcome", "") for one in found if isinstance(one, dict)]
            if ended.code == 0 and {"failed", "diverged"} & set(outcomes):
                return f"exit code 0 with {outcomes}"
        if words[0] in ("watch", "filter"):
            lines = [json.loads(line, parse_constant=_no_constant) for line in ended.out.splitlines()]
            if ended.out and lines[-1]["event"] != "end":
                return f"the last line is {ended.out[-200:]!r}"
    except (ValueError, KeyError, AttributeError) as error:
        return f"no JSON ({error}): {ended.out[:200]!r}"
    return ""


def typed(words: Sequence[str], name: str, other: str) -> list[str]:
    """Return the words of a command for a file with this name."""
    named = f"./logs/{name}"
    places = {"LOG": named, "OTHER": other, "FOLDER": "logs", "STUDY": "study.toml"}
    return [places.get(word, word) for word in words]


def fuzz(count: int, first: int = 0, *, only: int | None = None) -> list[str]:
    """Mutate a number of files, run a verb on each, and return the failures with kind and seed."""
    shares = np.array([one for one, _ in VERBS])
    wrong: list[str] = []
    home = Path(tempfile.mkdtemp())  # not a TemporaryDirectory: each child would remove it at exit
    try:
        made = seeds(home)
        other = home / "whole.csv"
        other.write_bytes(made["csv"][1])
        os.chdir(home)
        prepare(other)
        took: dict[str, list[float]] = {}
        for seed in [only] if only is not None else range(first, first + count):
            rng = np.random.default_rng(seed)
            kind = list(made)[seed % len(made)]
            name, content = struck(*made[kind], made, rng)
            words = VERBS[int(rng.choice(len(VERBS), p=shares / shares.sum()))][1]
            folder = home / "run"
            shutil.rmtree(folder, ignore_errors=True)
            (folder / "logs").mkdir(parents=True)
            (folder / "study.toml").write_text(STUDY)
            (folder / "logs" / name).write_bytes(content)
            ended = run(typed(words, name, str(other)), folder)
            took.setdefault(" ".join(words), []).append(ended.seconds)
            if said := wrong_with(words, ended):
                wrong.append(f"{kind}, seed {seed}, {' '.join(words)}, {name!r}: {said}")
                sys.stderr.write(f"{wrong[-1]}\n")
            if only is not None:
                shutil.copytree(folder, Path(tempfile.gettempdir()) / f"seed_{seed}", dirs_exist_ok=True)
                sys.stdout.write(f"{words} {name!r}\n{ended}\n")
        for one, times in took.items():
            sys.stderr.write(f"{sum(times):6.1f} s, {len(times)} of {max(times):.2f} s at most: {one}\n")
    finally:
        os.chdir("/")
        shutil.rmtree(home, ignore_errors=True)
    return wrong


if __name__ == "__main__":
    begun, total = time.monotonic(), int(sys.argv[1])
    start = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    found = fuzz(total, start, only=start if total == 0 else None)
    sys.stdout.write("\n".join([*found, f"{total} files, {len(found)} wrong, {time.monotonic() - begun:.0f} s\n"]))
    sys.exit(bool(found))
