"""Promises to contributors and users: stable names, matching versions, a complete index, valid files."""

import ast
import importlib.util
import json
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml

from tests.together import DIAGNOSE_A_MOTOR, SHOW_A_STUDY, backwards, from_its_end, in_one_order

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CITATION: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))


def script(name: str) -> ModuleType:
    """Import a script from docs, which is not in a package."""
    spec = importlib.util.spec_from_file_location(f"_{name}_page", ROOT / "docs" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_every_promised_public_name_exists() -> None:
    promised = json.loads((ROOT / "docs" / "interface.json").read_text("utf-8"))
    found = script("interface").interface()
    missing = [
        f"{part} {key}: {name}"
        for part, entries in promised.items()
        for key, names in entries.items()
        for name in names
        if name not in found[part].get(key, ())
    ]
    assert not missing, "see 'Versions' in CONTRIBUTING.md"
    assert len(promised["faces"]["plant"]) > 10
    assert "bulk_modulus_pa" in promised["json"]["diagnose"]


def test_the_page_of_decisions_is_current_and_lists_every_decision() -> None:
    index, docs = script("decisions_index"), ROOT / "docs"
    themes = tomllib.loads((docs / "decision_themes.toml").read_text("utf-8"))
    page = (docs / "decisions.md").read_text("utf-8")
    assert index.by_subject(index.headings(), themes) == page, "run: python docs/decisions_index.py"
    assert {int(number) for number in re.findall(r"^- \[(\d+)\. ", page, re.MULTILINE)} == {*index.headings()}
    assert all(int(number) < by for number, changes in themes["later"].items() for by, _ in changes)


def test_a_decision_has_its_number_in_its_heading() -> None:
    for number, heading in script("decisions_index").headings().items():
        assert heading.startswith(f"{number}. "), heading


def test_the_citation_file_follows_its_schema_and_has_the_version_of_the_project() -> None:
    assert {"cff-version", "message", "title", "authors"} <= set(CITATION)
    assert CITATION["cff-version"] == "1.2.0"
    assert CITATION["type"] == "software"
    assert CITATION["license"] == PROJECT["license"]
    assert str(CITATION["version"]) == PROJECT["version"]
    assert [author["name"] for author in CITATION["authors"]] == [author["name"] for author in PROJECT["authors"]]


def test_the_hooks_are_the_tools_of_make_lint() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    (repo,) = hooks["repos"]
    assert repo["repo"] == "local"
    lint = re.findall(r"^\t\$\(BIN\)/(\w+)", (ROOT / "Makefile").read_text("utf-8").split("lint:")[1], re.MULTILINE)[:3]
    assert [hook["entry"].split()[0].removeprefix(".venv/bin/") for hook in repo["hooks"]] == lint
    assert all(hook["language"] == "system" for hook in repo["hooks"])


@pytest.mark.parametrize("path", [path for path in FORMS if path.name != "config.yml"], ids=lambda path: path.stem)
def test_every_issue_form_is_valid_and_has_a_required_field(path: Path) -> None:
    form = yaml.safe_load(path.read_text("utf-8"))
    assert {"name", "description", "body"} <= set(form)
    ids = [field["id"] for field in form["body"]]
    assert len(ids) == len(set(ids))
    assert all({"type", "attributes"} <= set(field) and field["attributes"]["label"] for field in form["body"])
    assert any(field.get("validations", {}).get("required") for field in form["body"])


@pytest.mark.parametrize(
    "target", re.findall(r"(?:^|`)make ([\w-]+)", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.M)
)
def test_every_make_target_named_in_contributing_exists(target: str) -> None:
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)


def test_run_time_dependencies_are_locked_with_hashes_at_the_constrained_versions() -> None:
    locked = re.findall(r"^([\w.-]+)==(\S+)((?:.*\\\n)*.*)", (ROOT / "locked.txt").read_text("utf-8"), re.MULTILINE)
    held = re.findall(r"^([\w.-]+)==(\S+)$", (ROOT / "constraints.txt").read_text("utf-8"), re.MULTILINE)
    pinned = {normal(name): version for name, version in held}
    versions = {normal(name): version for name, version, _ in locked}
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", rest) for _, _, rest in locked)
    assert {name: version for name, version in versions.items() if pinned.get(name, version) != version} == {}
    wanted = {normal(re.split(r"[><=\[;]", one)[0]) for one in PROJECT["dependencies"]}
    assert wanted <= versions.keys() & pinned.keys()


def normal(name: str) -> str:
    """Return a package's name as registries compare it."""
    return re.sub(r"[-_.]+", "-", name.strip()).lower()


def test_files_that_share_fixtures_go_to_one_worker() -> None:
    folder = ROOT / "tests" / "experiments"
    made = _fixtures(folder / "conftest.py") - {"browser"}
    assert len(made) > 5
    show = {file for file in folder.rglob("test_*.py") if made & (_asked(file) - _fixtures(file))}
    assert {file.relative_to(ROOT).as_posix() for file in show} == SHOW_A_STUDY
    assert all((ROOT / file).is_file() for file in DIAGNOSE_A_MOTOR)


def test_every_second_worker_collects_in_reverse_and_all_report_the_same_order() -> None:
    workers = ("", "master", "gw0", "gw1", "gw2", "gw11")
    assert [from_its_end(worker) for worker in workers] == [False, False, False, True, False, True]
    folder: Any = SimpleNamespace(collect=lambda: iter("abc"))
    backwards(folder)
    assert list(folder.collect()) == ["c", "b", "a"]
    forwards: list[Any] = [SimpleNamespace(nodeid=name) for name in ("a.py::z", "a.py::b[::]", "b.py::a", "c/d.py::e")]
    turned = [*forwards[3:], *forwards[2:3], *forwards[:2]]
    in_one_order(turned)
    assert turned == forwards


def _functions(file: Path) -> dict[str, ast.FunctionDef]:
    tree = ast.parse(file.read_text("utf-8"))
    return {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}


def _fixtures(file: Path) -> set[str]:
    functions = _functions(file).items()
    return {name for name, one in functions if any("fixture" in ast.unparse(by) for by in one.decorator_list)}


def _asked(file: Path) -> set[str]:
    """Return the argument names of the tests and fixtures in a file."""
    functions, made = _functions(file), _fixtures(file)
    asking = [one for name, one in functions.items() if name in made or name.startswith("test_")]
    return {argument.arg for one in asking for argument in one.args.args}
