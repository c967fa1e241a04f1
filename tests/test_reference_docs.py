"""What the documents cite exists: sources of plants, notes on parameters, errata, and the tables of nomenclature."""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Annotated

import pytest

from plant.eha.model import EhaParameters
from plant.log.record import CHANNELS
from plant.units import SI, notes
from tests.test_documentation import is_unit

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("plant", "estimation", "faults", "experiments")
TEXTS = {".py", ".html", ".j2", ".md"}

PHYSICS = ("plant/components/", "plant/eha/model", "plant/piezo_stack/", "plant/diaphragm_motor/")
SOURCE = re.compile(
    r"\b(?:equations?\s+\(?\d|tables?\s+\d|sections?\s+\d|errata\s+[EPM]\d|sources?:\s+\w)", re.IGNORECASE
)

ERRATUM = r"[EPM]\d+(?:\s*(?:,|and|to)\s*(?:and\s+)?[EPM]\d+)*"
CITATION = re.compile(rf"\berrata[\s#]+({ERRATUM})")
ERRATA_ROW = re.compile(r"^\| ([EPM]\d+) \|.*\| (code departs|noted only) \|$", re.MULTILINE)


@dataclass(frozen=True)
class Cited:
    """A citation of one erratum."""

    path: str
    line: int
    number: str


def read_texts(*folders: str) -> dict[str, str]:
    """Return the text of every source, template and page in these folders, by path."""
    paths = [path for folder in folders for path in sorted((ROOT / folder).rglob("*")) if path.suffix in TEXTS]
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def citations(texts: Mapping[str, str]) -> Iterator[Cited]:
    """Find every ``errata E1, E2 and E3``, even across a line break."""
    for path, text in texts.items():
        for found in CITATION.finditer(text):
            line = text.count("\n", 0, found.start()) + 1
            yield from (Cited(path, line, number) for number in re.findall(r"[EPM]\d+", found[1]))


def unknown_errata(texts: Mapping[str, str], errata: str) -> list[str]:
    """Return citations of errata that are not in the list."""
    known = {number for number, _ in ERRATA_ROW.findall(errata)}
    return [
        f"{cited.path}:{cited.line}: cites errata {cited.number}, which docs/errata.md does not have"
        for cited in citations(texts)
        if cited.number not in known
    ]


def uncited_departures(texts: Mapping[str, str], errata: str) -> list[str]:
    """Return errata from which the code is said to depart, but which no code cites."""
    cited = {found.number for found in citations(texts)}
    departs = [number for number, mark in ERRATA_ROW.findall(errata) if mark == "code departs"]
    return [
        f"docs/errata.md: {number} is marked 'code departs', but no code cites it"
        for number in departs
        if number not in cited
    ]


def unsourced_physics(path: str, text: str) -> list[str]:
    """Return public functions of a plant that cite no source, unless their module does."""
    tree = ast.parse(text, filename=path)
    if not path.startswith(PHYSICS) or SOURCE.search(ast.get_docstring(tree) or ""):
        return []
    return [
        f"{path}:{node.lineno}: {node.name} cites no equation, table, section or erratum, and no Source:"
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
        if not SOURCE.search(ast.get_docstring(node) or "")
    ]


def is_parameters(found: object) -> bool:
    """Return whether an object is a dataclass with a note on at least one of its fields."""
    if not (isinstance(found, type) and is_dataclass(found)):
        return False
    hints = inspect.get_annotations(found)
    return any("si" in one.metadata or "SI(" in str(hints.get(one.name)) for one in fields(found))


def bad_notes(parameter_class: type) -> list[str]:
    """Return parameters without a note, or whose note has an unknown unit, no meaning, or no source."""
    where = f"{inspect.getsourcefile(parameter_class)}: {parameter_class.__name__}"
    try:
        noted = notes(parameter_class)
    except TypeError as error:
        return [f"{where}: {error}"]
    blank = [
        f"{where}.{name} has no {part} in its note, got {note}"
        for name, note in noted.items()
        for part in ("unit", "meaning", "source")
        if not getattr(note, part).strip()
    ]
    unread = [
        f"{where}.{name} has a unit that cannot be read, got {note.unit!r}"
        for name, note in noted.items()
        if note.unit.strip() and not is_unit(note.unit)
    ]
    return blank + unread


def parameter_table(parameter_class: type) -> str:
    """Return the notes on a parameter dataclass as a Markdown table."""
    given = {field.name: field.default for field in fields(parameter_class)}
    defaults = {name: "none" if value is None else f"{value:g}" for name, value in given.items()}
    rows = [
        f"| `{name}` | {note.unit} | {defaults[name]} | {note.meaning} | {note.source} |"
        for name, note in notes(parameter_class).items()
    ]
    return "\n".join(["| name | unit | default | meaning | source |", "|---|---|---|---|---|", *rows])


def rows_below(heading: str, page: str) -> list[tuple[str, ...]]:
    """Return the cells of the Markdown table under a heading, without its header row."""
    section = page.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    rows = re.findall(r"^\| `.*\|$", section, re.MULTILINE)
    return [tuple(cell.strip(" `") for cell in row.strip("|").split(" | ")) for row in rows]


def _modules() -> Iterator[ModuleType]:
    for layer in LAYERS:
        for path in sorted((ROOT / layer).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if parts[-1] != "__main__":
                yield importlib.import_module(".".join(parts[:-1] if parts[-1] == "__init__" else parts))


@pytest.fixture(scope="module")
def errata() -> str:
    return (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def nomenclature() -> str:
    return (ROOT / "docs" / "nomenclature.md").read_text(encoding="utf-8")


LIST = "| E1 | Table 2 | a | b | code departs |\n| E2 | 5.8 | a | b | noted only |\n"


@pytest.mark.parametrize(
    "text", ["# errata E3", "errata E1, E2, E3.", "(errata E1 and E3)", "(errata\n# E3)", "errata E1 to E3"]
)
def test_an_unknown_erratum_is_found_with_file_and_line(text: str) -> None:
    (offence,) = unknown_errata({"plant/a.py": f"x\n{text}"}, LIST)
    assert offence.startswith("plant/a.py:2: cites errata E3")


def test_a_departure_that_no_code_cites_is_found() -> None:
    assert uncited_departures({"plant/a.py": "errata E1"}, LIST) == []
    (offence,) = uncited_departures({"plant/a.py": "errata E2, E10; see E1"}, LIST)
    assert "E1 is marked" in offence


def test_physics_without_a_source_is_found() -> None:
    function = 'def flow():\n    """Return the flow{}."""\n'
    (offence,) = unsourced_physics("plant/components/a.py", function.format(" of the pressure source"))
    assert offence.startswith("plant/components/a.py:1: flow cites no")
    for said in (", equation 5.8", ". Table 3", " (errata\n    E8)", ".\n\n    Source: judged"):
        assert unsourced_physics("plant/eha/model.py", function.format(said)) == []
    assert unsourced_physics("plant/eha/model.py", '"""Section 5."""\n' + function) == []
    assert unsourced_physics("plant/log/record.py", function) == []


@dataclass(frozen=True)
class _Partly:
    noted: Annotated[float, SI("Pa", "pressure", "Table 1")] = 1.0
    bare: float = 2.0


@dataclass(frozen=True)
class _Careless:
    fine: Annotated[float, SI("1", "ratio", "judged")] = 1.0
    no_unit: Annotated[float, SI(" ", "pressure", "Table 1")] = 1.0
    odd_unit: Annotated[float, SI("Pascals per fortnite", "pressure", "Table 1")] = 1.0
    no_meaning: Annotated[float, SI("Pa", "", "Table 1")] = 1.0
    no_source: Annotated[float, SI("Pa", "pressure", "")] = 1.0


def test_missing_or_incomplete_notes_on_parameters_are_reported() -> None:
    assert is_parameters(_Partly)
    assert not is_parameters(Cited)
    (missing,) = bad_notes(_Partly)
    assert "_Partly.bare must carry an SI note" in missing
    offences = "\n".join(bad_notes(_Careless))
    assert offences.count("\n") == 3
    for name in ("no_unit has no unit", "odd_unit has a", "no_meaning has no m", "no_source has no s"):
        assert f"_Careless.{name}" in offences


def test_every_cited_erratum_is_in_the_list(errata: str) -> None:
    offences = unknown_errata(read_texts(*LAYERS, "tests/plant", "tests/experiments", "docs"), errata)
    assert not offences, "\n".join(offences)


def test_every_departure_in_the_list_is_cited_by_code(errata: str) -> None:
    offences = uncited_departures(read_texts(*LAYERS), errata)
    assert not offences, "\n".join(offences)


def test_errata_are_numbered_in_order_and_marked(errata: str) -> None:
    marked = [number for number, _ in ERRATA_ROW.findall(errata)]
    for paper, count in (("E", 21), ("P", 17), ("M", 31)):
        rows = re.findall(rf"^\| {paper}\d.*$", errata, re.MULTILINE)
        numbers = [number for number in marked if number.startswith(paper)]
        assert numbers == [f"{paper}{number}" for number in range(1, len(rows) + 1)]
        assert len(rows) == count


def test_every_plant_function_cites_its_source() -> None:
    texts = {path: text for path, text in read_texts("plant").items() if path.endswith(".py")}
    assert any(path.startswith(PHYSICS) for path in texts)
    offences = [offence for path, text in texts.items() for offence in unsourced_physics(path, text)]
    assert not offences, "\n".join(offences)


def test_every_parameter_says_unit_meaning_and_source() -> None:
    found = {item for module in _modules() for item in vars(module).values() if is_parameters(item)}
    assert EhaParameters in found
    offences = [offence for item in sorted(found, key=str) for offence in bad_notes(item)]
    assert not offences, "\n".join(offences)


def test_parameters_in_the_nomenclature_are_those_of_the_code(nomenclature: str) -> None:
    wanted = parameter_table(EhaParameters)
    assert wanted in nomenclature, f"docs/nomenclature.md should hold:\n\n{wanted}"


def test_channels_in_the_nomenclature_are_those_of_the_code(nomenclature: str) -> None:
    rows = [row[:2] for row in rows_below("Channels", nomenclature)]
    assert rows == [("time_s", "s"), *CHANNELS.items()]


def test_outcomes_in_the_nomenclature_are_those_of_the_code(nomenclature: str) -> None:
    found = {item for module in _modules() for name, item in vars(module).items() if name == "Outcome"}
    assert len(found) == 1, f"the packages should define Outcome once, got {found}"
    names = {member.value for member in found.pop()}
    assert {row[0] for row in rows_below("Outcomes", nomenclature)} == names
