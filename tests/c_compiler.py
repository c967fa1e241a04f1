"""The C compilers on this machine, and the programs that they build from exported files."""

import contextlib
import hashlib
import os
import platform
import shutil
import subprocess
import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import pytest

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")
PROGRAMS = Path(__file__).resolve().parents[1] / ".pytest_cache" / "programs"
"""Next to the compiled kernels, which also outlive a test run."""
UNUSED = 30 * 86400
"""Age after which a program that no test has used is deleted [s]."""
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def compiler(name: str) -> str:
    """Return the path of a compiler; skip the test if it is not installed."""
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


@cache
def _version(path: str) -> bytes:
    return subprocess.run([path, "--version"], capture_output=True, check=True).stdout  # noqa: S603


def _kept_as(files: Mapping[str, str], command: Sequence[str]) -> Path:
    """Return the path under which the program that this compiler builds from these files is kept between test runs."""
    made_by = repr((_version(command[0]), command, sorted(files.items()), platform.machine()))
    return PROGRAMS / hashlib.sha256(made_by.encode()).hexdigest()[:32]


def _forget() -> None:
    """Delete programs that no test has used for a month; each change of an exported file leaves an old one."""
    for one in PROGRAMS.iterdir():
        with contextlib.suppress(FileNotFoundError):  # another worker may have just deleted it
            if one.stat().st_mtime < time.time() - UNUSED:
                one.unlink()


def compiled(folder: Path, files: Mapping[str, str], *flags: str, using: str = "gcc") -> Path:
    """Return the program built from exported files without compiler warnings; later calls reuse it."""
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    sources = [file for file in files if file.endswith(".c")]
    command = [compiler(using), *STRICT, *flags, "-o", "program", *sources, "-lm"]
    kept = _kept_as(files, command)
    if kept.is_file():
        kept.touch()
    if not kept.is_file() or "-march=native" in flags:
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)  # noqa: S603 - our own files
        assert (done.returncode, done.stderr) == (0, "")
        PROGRAMS.mkdir(parents=True, exist_ok=True)
        _forget()
        shutil.copy2(folder / "program", beside := kept.with_suffix(f".{os.getpid()}"))
        beside.replace(kept)
    return kept


def ran(program: Path, lines: Sequence[str]) -> tuple[str, str]:
    """Return what a program writes to standard output and standard error, given lines on standard input."""
    done = subprocess.run(  # noqa: S603 - our own program
        [str(program)], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True
    )
    return done.stdout, done.stderr
