"""C compilers of this machine, and what they make of exported files."""

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def compiler(name: str) -> str:
    """The path of a compiler, or a skip where there is none."""
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def compiled(folder: Path, files: Mapping[str, str], *flags: str, using: str = "gcc") -> Path:
    """The program that exported files make, compiled without a warning."""
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    sources = [str(folder / file) for file in files if file.endswith(".c")]
    program = folder / "program"
    command = [compiler(using), *STRICT, *flags, "-I", str(folder), "-o", str(program), *sources, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own files
    assert (done.returncode, done.stderr) == (0, "")
    return program


def ran(program: Path, lines: Sequence[str]) -> tuple[str, str]:
    """What a program prints, and says on standard error, given lines on standard input."""
    done = subprocess.run(  # noqa: S603 - our own program
        [str(program)], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True
    )
    return done.stdout, done.stderr
