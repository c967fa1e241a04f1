"""Runs calls of the command as a commit has it, and keeps what they print.

Every commit has a git worktree and a folder of compiled kernels of its own; site-packages are this environment's. A
process that compiles a function may run another copy of what it calls than later processes, which load the compiled
code, and sums are then reordered (2e-7 was seen in a standard deviation). So a call that compiled anything is run
again.
"""

import hashlib
import json
import os
import platform
import resource
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from llvmlite.binding import get_host_cpu_name

from benchmarks.same_numbers.same_numbers_calls import Call

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("plant", "estimation", "faults", "experiments")
LONGEST = 1800.0
"""Seconds after which a call is given up."""

GIVEN_UP = 124
"""The exit code that such a call is given."""

FINISHED = (0, 1, 2)
"""Exit codes of a command that was not stopped; only such results are kept."""


@dataclass(frozen=True)
class Commit:
    """A commit with a worktree.

    Parameters
    ----------
    sha : str
        Its full hash.
    worktree : Path
        Where its files are.
    kernels : Path
        Its folder of compiled kernels.
    """

    sha: str
    worktree: Path
    kernels: Path

    @classmethod
    def of(cls, name: str, folder: Path) -> "Commit":
        """Return a commit of this repository, with its worktree made or found, and seen to be what is imported.

        Parameters
        ----------
        name : str
            A hash, branch or tag.
        folder : Path
            Where worktrees and kernels are kept.

        Raises
        ------
        RuntimeError
            If the worktree was changed, or another folder's packages are imported.
        """
        sha = _git(ROOT, "rev-parse", "--verify", f"{name}^{{commit}}")
        commit = cls(sha, folder / "worktrees" / sha[:12], folder / "kernels" / sha[:12])
        if not (commit.worktree / ".git").exists():
            _git(ROOT, "worktree", "add", "--force", "--detach", str(commit.worktree), sha)
        if _git(commit.worktree, "rev-parse", "HEAD") != sha or _git(commit.worktree, "status", "--porcelain"):
            raise RuntimeError(f"{commit.worktree} is no longer {sha[:12]}: remove it with git worktree remove --force")
        for package in PACKAGES:
            found = commit.python("-c", f"import {package}; print({package}.__file__)").stdout.strip()
            if Path(found) != commit.worktree / package / "__init__.py":
                raise RuntimeError(f"{package} is wanted from {commit.worktree}, got {found!r}")
        return commit

    def python(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Python in the worktree, whose packages come first."""
        dropped = ("PYTHONPATH", "PYTHONSAFEPATH", "NUMBA_CACHE_DIR", "HYDROSTATE_DEBUG", "HYDROSTATE_SHARED")
        kept = {name: value for name, value in os.environ.items() if name not in dropped}
        one = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
        environment = {**kept, **one, "HYDROSTATE_CACHE": str(self.kernels), "COLUMNS": "120"}
        return subprocess.run(  # noqa: S603 -- our own command
            [sys.executable, *arguments],
            cwd=self.worktree,
            env=environment,
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=LONGEST,
        )

    def compiled(self) -> int:
        """Return how many functions are kept as machine code."""
        return sum(1 for folder in (self.worktree, self.kernels) for _ in folder.rglob("*.nbc"))

    def simulate(self, arguments: list[str]) -> None:
        """Write a log by the commit's `simulate`.

        Raises
        ------
        RuntimeError
            If it does not.
        """
        done = self.python("-m", "experiments.cli", "simulate", *arguments)
        if done.returncode != 0:
            raise RuntimeError(f"simulate {' '.join(arguments)}: {done.stderr[-500:]}")


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 -- our own command
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    return done.stdout.strip()


def uncommitted() -> bool:
    """Return whether this script's own repository holds changes that no commit has."""
    return bool(_git(ROOT, "status", "--porcelain", "--untracked-files=no"))


def environment() -> dict[str, str]:
    """Return what numbers depend on beside the code: processor and versions."""
    versions = {name: version(name) for name in ("numpy", "scipy", "llvmlite", "pandas")}
    return {"processor": get_host_cpu_name(), "python": platform.python_version(), **versions}


def found_by(commit: Commit, call: Call, logs: Path, kept: Path, *, again: bool) -> dict[str, Any]:
    """Return what a call prints, from the store if it is there.

    Parameters
    ----------
    commit : Commit
        Whose command it is.
    call : Call
        Verb, options, logs.
    logs : Path
        The folder of logs.
    kept : Path
        The folder of results.
    again : bool
        Run it though it is in the store, and leave the store as it is.

    Returns
    -------
    dict[str, Any]
        ``exit_code``, ``stdout`` (None where it is JSON), ``stderr``, ``results``, ``cpu_s``.
    """
    file = kept / commit.sha[:12] / f"{call.name.replace('/', '-')}-{_digest(call, logs)}.json"
    if file.exists() and not again:
        return json.loads(file.read_text(encoding="utf-8"))
    begin, before, found = _cpu_seconds(), commit.compiled(), _run(commit, call, logs)
    while before < (now := commit.compiled()):
        before, found = now, _run(commit, call, logs)
    found["cpu_s"] = _cpu_seconds() - begin
    print(f"{commit.sha[:7]} {call.name}: {len(call.logs)} logs, {found['cpu_s']:.1f} s CPU", flush=True)
    if found["exit_code"] in FINISHED and not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        partial = file.with_suffix(".part")
        partial.write_text(json.dumps(found, indent=1), encoding="utf-8")
        partial.replace(file)
    return found


def _run(commit: Commit, call: Call, logs: Path) -> dict[str, Any]:
    try:
        done = commit.python("-m", "experiments.cli", *call.arguments(logs))
    except subprocess.TimeoutExpired as error:
        done = subprocess.CompletedProcess(call.arguments(logs), GIVEN_UP, "", f"{error}")
    try:
        results, stdout = json.loads(done.stdout), None
    except json.JSONDecodeError:
        results, stdout = None, done.stdout
    return {
        "commit": commit.sha,
        "call": call.name,
        "environment": environment(),
        "exit_code": done.returncode,
        "stdout": stdout,
        "stderr": done.stderr,
        "results": results,
    }


def _cpu_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _digest(call: Call, logs: Path) -> str:
    """Return a name for all that a call's numbers depend on beside the commit."""
    asked = [call.verb, call.options, call.logs, environment()]
    digest = hashlib.sha256(json.dumps(asked).encode())
    for path in call.files(logs):
        content = path.read_bytes() if path.is_file() else b"no file"
        digest.update(hashlib.sha256(content).digest())
    return digest.hexdigest()[:16]
