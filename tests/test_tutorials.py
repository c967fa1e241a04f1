"""Every block of every tutorial runs, in order, in one folder; the site lists each tutorial once."""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.c_compiler import compiler

ROOT = Path(__file__).resolve().parents[1]
TUTORIALS = ROOT / "docs" / "tutorials"
PAGES = sorted(path.stem for path in TUTORIALS.glob("*.md"))
EXPLAINED = ("method", "severities")
WORKED = {name: TUTORIALS / f"{name}.md" for name in PAGES} | {name: ROOT / "docs" / f"{name}.md" for name in EXPLAINED}
"""Pages whose blocks run: the tutorials, and those that explain an answer and an interval."""

BLOCK = re.compile(r"```(sh|python)\n(.*?)```", re.DOTALL)


def blocks(name: str) -> list[tuple[str, str]]:
    return BLOCK.findall(WORKED[name].read_text("utf-8"))


def ran(kind: str, text: str, folder: Path) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}
    command = ["sh", "-e", "-c", text] if kind == "sh" else [sys.executable, "-c", text]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    return done.stdout


def worked_through(name: str, folder: Path) -> str:
    """Run a tutorial and return what it printed."""
    command = folder / "hydrostate"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m experiments.cli "$@"\n')
    command.chmod(0o755)
    return "".join(ran(kind, text, folder) for kind, text in blocks(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in WORKED if name != "log-to-controller"])
def test_every_block_of_a_tutorial_runs_in_order_and_its_claims_hold(name: str, tmp_path: Path) -> None:
    assert worked_through(name, tmp_path)


@pytest.mark.slow
def test_the_controller_tutorial_gives_the_same_numbers_in_c_and_python(tmp_path: Path) -> None:
    compiler("gcc")
    if shutil.which("make") is None:
        pytest.skip("make is not installed")
    said = worked_through("log-to-controller", tmp_path)
    found = re.search(r"bulk modulus (\S+) Pa, C and Python differ by (\S+)", said)
    assert found is not None
    assert 1.8e8 < float(found[1]) < 2.3e8
    assert float(found[2]) < 1e-12
    assert (tmp_path / "plant.fmu").is_file()


@pytest.mark.parametrize("name", WORKED)
def test_tutorials_use_existing_verbs_and_options_and_valid_python(name: str) -> None:
    options = json.loads((ROOT / "docs" / "interface.json").read_text("utf-8"))["options"]
    for kind, text in blocks(name):
        if kind == "python":
            ast.parse(text)
            continue
        for line in text.splitlines():
            if not line.startswith("hydrostate "):
                continue
            words = line.split("#")[0].split()[1:]
            verb = next(verb for verb in (" ".join(words[:2]), words[0]) if verb in options)
            assert {word for word in words if word.startswith("--")} <= set(options[verb]), line


def test_the_site_names_every_tutorial_once() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    assert [index.count(f"\ntutorials/{name}\n") for name in PAGES] == [1] * len(PAGES)
