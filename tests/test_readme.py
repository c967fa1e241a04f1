"""The README and the page of verbs run as printed, their quoted output is right, and their numbers are measured."""

import json
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from benchmarks.__main__ import ALL

ROOT = Path(__file__).parent.parent
README, VERBS, MEASURED = ROOT / "README.md", ROOT / "docs" / "verbs.md", ROOT / "docs" / "benchmarks.md"
COMMAND = Path(sys.executable).parent / "hydrostate"
BLOCK = re.compile(r"```(sh|text)\n(.*?)```", re.DOTALL)

Run = subprocess.CompletedProcess[str]


def commands(page: Path) -> list[list[str]]:
    blocks = [text for kind, text in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == "sh"]
    lines = [line.split("#")[0].strip() for block in blocks for line in block.splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("hydrostate ")]


def quoted(page: Path) -> list[tuple[str, str]]:
    """Return each command whose output is quoted below it, with that output."""
    blocks = BLOCK.findall(page.read_text(encoding="utf-8"))
    pairs = pairwise(blocks)
    return [(command.strip(), text) for (one, command), (two, text) in pairs if (one, two) == ("sh", "text")]


def words(text: str) -> str:
    """Return a text without its line breaks, because the README wraps long lines."""
    return " ".join(text.split())


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], list[Run]]:
    """Return a function that runs a page's commands in order, once, in a folder of its own."""

    @cache
    def of(page: Path) -> list[Run]:
        folder = tmp_path_factory.mktemp(page.stem)
        return [
            subprocess.run([COMMAND, *line], cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603 - the page's own commands
            for line in commands(page)
        ]

    return of


def test_the_first_screen_is_two_sentences_a_picture_and_two_commands() -> None:
    first = README.read_text(encoding="utf-8").split("\n## ")[0]
    opening, picture, block, *_ = first.split("\n\n", 1)[1].split("\n\n")
    assert len(re.findall(r"\.(?=\s|$)", opening)) == 2
    assert picture.startswith("![")
    assert [line.split("#")[0].strip() for line in block.splitlines()[1:-1]] == ["make study", "make test"]
    assert first.count("![") == first.count("```sh") == 1


def test_the_pages_show_every_verb_that_works_on_logs() -> None:
    assert {"simulate", "estimate", "identify", "diagnose"} <= {line[0] for line in commands(README)}
    assert {"inspect", "watch", "isolability", "conditions"} <= {line[0] for line in commands(VERBS)}


@pytest.mark.parametrize("page", [README, pytest.param(VERBS, marks=pytest.mark.slow)], ids=["readme", "verbs"])
def test_every_command_runs_as_printed_and_in_order(page: Path, done: Callable[[Path], list[Run]]) -> None:
    for line, one in zip(commands(page), done(page), strict=True):
        assert one.returncode == 0, f"hydrostate {' '.join(line)}: {one.stderr}"


def test_the_readme_quotes_what_its_five_commands_print(done: Callable[[Path], list[Run]]) -> None:
    shown = quoted(README)
    assert [command.split()[1] for command, _ in shown] == [
        "simulate",
        "estimate",
        "diagnose",
        "identify",
        "identifiability",
    ]
    for (command, text), one in zip(shown, done(README), strict=True):
        assert words(text) in words(one.stdout + one.stderr), command


@pytest.mark.parametrize(
    "page", ["README.md", *(f"docs/{name}.md" for name in ("identification", "limits", "severities"))]
)
def test_inline_commands_use_existing_verbs_and_options(page: str) -> None:
    options = json.loads((ROOT / "docs" / "interface.json").read_text(encoding="utf-8"))["options"]
    told = re.findall(r"`hydrostate ([^`]+)`", (ROOT / page).read_text(encoding="utf-8"))
    assert told
    for line in told:
        said = line.split()
        verb = next((verb for verb in (" ".join(said[:2]), said[0]) if verb in options), None)
        assert verb is not None, line
        assert {word.partition("=")[0] for word in said if word.startswith("--")} <= set(options[verb]), line


def test_the_readmes_script_runs_as_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (script,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(script, str(README), "exec"), {"__name__": "__main__"})  # noqa: S102 - the README's own lines
    shown = capsys.readouterr().out
    assert "minor_leakage" in shown
    assert "TransferFunction" in shown or "z^2" in shown
    assert sum(bool(line) and not line.startswith("#") for line in script.splitlines()) <= 10


def rows(page: Path, columns: int) -> list[list[str]]:
    """Return the cells of a page's tables that have the given number of columns, without headings."""
    lines = [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in cells if len(row) == columns and row[0] != "what"]


def test_every_measurement_of_the_readme_is_on_the_page_of_measurements() -> None:
    measured = [row[:3] for row in rows(MEASURED, 7)]
    shown = rows(README, 3)
    assert 0 < len(shown) <= 10
    for row in shown:
        assert row in measured, row[0]


def test_every_measurement_names_an_existing_command_a_machine_and_a_date() -> None:
    machines = [machine[0] for machine in rows(MEASURED, 2)]
    for what, _, measured, command, machine, _, date in rows(MEASURED, 7):
        name, *options = command.strip("`").split()
        script = (ROOT / "benchmarks" / f"{ALL[name].replace('.', '/')}.py").read_text(encoding="utf-8")
        assert all(option in script for option in options if option.startswith("--")), (command, what)
        assert machine in machines, (command, what)
        assert re.fullmatch(r"20\d\d-\d\d-\d\d", date), (command, what)
        assert re.search(r"\d", measured), (command, what)


def test_every_link_of_the_readme_leads_somewhere() -> None:
    links = set(re.findall(r"\]\(([\w/.-]+)", README.read_text(encoding="utf-8")))
    assert links
    assert [link for link in sorted(links) if not (README.parent / link).exists()] == []
