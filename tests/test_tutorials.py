"""Every block of a tutorial runs, in turn, in one folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.c_compiler import compiler

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"```(sh|python)\n(.*?)```", re.DOTALL)


def ran(kind: str, text: str, folder: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}
    command = ["sh", "-e", "-c", text] if kind == "sh" else [sys.executable, "-c", text]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_from_a_log_to_a_controller_with_the_same_numbers(tmp_path: Path) -> None:
    compiler("gcc")
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    command = tmp_path / "hydrostate"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m experiments.cli "$@"\n')
    command.chmod(0o755)
    page = (ROOT / "docs/tutorials/log-to-controller.md").read_text("utf-8")
    said = "".join(ran(kind, text, tmp_path) for kind, text in BLOCK.findall(page))
    found = re.search(r"bulk modulus (\S+) Pa, C and Python differ by (\S+)", said)
    assert found is not None
    assert 1.8e8 < float(found[1]) < 2.3e8
    assert float(found[2]) < 1e-12
    assert (tmp_path / "plant.fmu").is_file()
