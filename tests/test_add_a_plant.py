"""The actuator of docs/add-a-plant.md, built from that page alone in a copy of the packages, and every verb on it."""

import io
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tokenize
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "add-a-plant.md").read_text(encoding="utf-8")
PACKAGES = ("plant", "estimation", "faults", "experiments")
MOST_LINES = 200
LAYOUT = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
DOCSTRINGS = re.compile(r'^\s*(?:"""(?:.|\n)*?""")$', re.MULTILINE)
REGISTRY = "experiments/actuators.py"


def files() -> dict[str, str]:
    """Return the files that the page contains, by path."""
    return dict(re.findall(r"^`([\w/]+\.py)`:\n\n```python\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE))


def blocks(language: str) -> list[str]:
    """Return the page's code blocks in a language."""
    return re.findall(rf"^```{language}\n(.*?)```", PAGE, re.DOTALL | re.MULTILINE)


def registry_line() -> str:
    (line,) = (block for block in blocks("python") if block.startswith("    "))
    return line


def code_lines(text: str) -> int:
    """Return the number of lines of code, without docstrings, comments and blank lines."""
    tokens = tokenize.generate_tokens(io.StringIO(DOCSTRINGS.sub("", text)).readline)
    return len(
        {line for token in tokens if token.type not in LAYOUT for line in range(token.start[0], token.end[0] + 1)}
    )


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the packages with the actuator added."""
    folder = tmp_path_factory.mktemp("checkout")
    for package in (*PACKAGES, "tests/contracts"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("conftest.py", "together.py"):
        shutil.copy(ROOT / "tests" / name, folder / "tests")
    shutil.copy(ROOT / "pyproject.toml", folder)
    subprocess.run(["/bin/sh", "-ec", blocks("sh")[0]], cwd=folder, check=True)  # noqa: S603 -- the page's own words
    for path, text in files().items():
        (folder / path).write_text(text, encoding="utf-8")
    registry = folder / REGISTRY
    others = registry.read_text(encoding="utf-8")
    last = '    "diaphragm-motor": "experiments.diaphragm_motor.kind:DIAPHRAGM_MOTOR",\n'
    assert last in others
    registry.write_text(others.replace(last, last + registry_line()), encoding="utf-8")
    (folder / "spring-study.toml").write_text(blocks("toml")[0], encoding="utf-8")
    return folder


def run(folder: Path, *command: str) -> "subprocess.CompletedProcess[str]":
    variables = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(  # noqa: S603 -- our own command
        [sys.executable, "-m", *command], cwd=folder, env=variables, capture_output=True, text=True, check=False
    )


def said(folder: Path, *words: str) -> dict[str, Any]:
    done = run(folder, "experiments.cli", *words, "--json")
    assert done.returncode == 0, done.stderr
    (entries,) = json.loads(done.stdout)
    return entries


def test_the_page_adds_one_folder_to_each_package_within_the_stated_lines() -> None:
    given = files()
    assert [path.split("/")[:2] for path in given] == [[package, "spring_cylinder"] for package in PACKAGES]
    assert sum(map(code_lines, given.values())) + code_lines(registry_line().strip()) <= MOST_LINES


@pytest.mark.slow
def test_every_verb_of_the_page_works(copy: Path) -> None:
    commands = [shlex.split(line) for line in blocks("sh")[-1].splitlines()]
    assert {"simulate", "estimate", "diagnose", "identifiability", "batch"} <= {words[1] for words in commands}
    for words in commands:
        done = run(copy, "experiments.cli", *words[1:])
        assert done.returncode == 0, f"{words}: {done.stderr}"
    page = (copy / "leaking.html").read_text(encoding="utf-8")
    assert all(word in page for word in ("Leaking", "leakage coefficient", "chamber_pressure_pa", "seal"))
    store = copy / "spring-study"
    assert "leaking" in (store / "report.html").read_text(encoding="utf-8")
    diagnosis = (store / "tables" / "diagnosis.csv").read_text(encoding="utf-8").splitlines()
    right = diagnosis[0].split(",").index("right_percent")
    assert len(diagnosis) > 3
    assert {float(row.split(",")[right]) for row in diagnosis[1:]} == {100.0}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("condition", "truth"),
    [
        ("normal", {"leakage_coefficient": 2e-12, "spring_stiffness": 4e4}),
        ("leaking", {"leakage_coefficient": 1e-11, "spring_stiffness": 4e4}),
        ("weak_spring", {"leakage_coefficient": 2e-12, "spring_stiffness": 2.8e4}),
    ],
)
def test_the_true_parameters_are_estimated_and_the_fault_is_diagnosed(
    condition: str, truth: dict[str, float], copy: Path
) -> None:
    log = f"{condition}.csv"
    words = ("--plant", "spring-cylinder")
    said(copy, "simulate", *words, "--condition", condition, "--seed", "5", "--out", log)
    found = said(copy, "estimate", *words, log)
    assert (found["outcome"], found["gate"]["passed"], found["channels"]) == (
        "ok",
        True,
        ["position_m", "chamber_pressure_pa"],
    )
    for name, value in truth.items():
        quantity = found["quantities"][name]
        assert abs(quantity["value"] - value) < 4.0 * quantity["std"] < 0.05 * value
    verdict = said(copy, "diagnose", *words, "--condition", condition, log)
    assert verdict["condition"] == condition
    assert verdict["probabilities"][condition] > 0.99
    assert "as expected" in verdict["message"]
    assert verdict["quantities"] == found["quantities"]


@pytest.mark.slow
def test_the_new_actuator_passes_the_contract_tests(copy: Path) -> None:
    done = run(
        copy, "pytest", "-q", "-p", "no:cacheprovider", "tests/contracts/test_actuators.py", "-k", "spring-cylinder"
    )
    assert done.returncode == 0, done.stdout[-3000:]
    assert " passed" in done.stdout


@pytest.mark.slow
def test_the_new_actuator_passes_ruff_and_pyright(copy: Path) -> None:
    given = list(files())
    for tool in (["ruff", "check"], ["pyright"]):
        done = run(copy, *tool, *given)
        assert done.returncode == 0, done.stdout
