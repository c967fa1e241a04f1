"""Codes are unique, raised somewhere with all the fields that their sentence needs, and listed on docs/notes.md."""

import importlib.util
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import pytest

from plant.notes import Code

ROOT = Path(__file__).resolve().parents[1]


def load(path: Path) -> ModuleType:
    """Import a script that is not in a package."""
    spec = importlib.util.spec_from_file_location(f"_{path.stem}_page", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


notes = load(ROOT / "docs" / "notes.py")


@pytest.fixture(scope="module")
def enums() -> Mapping[str, type[Code]]:
    return {enum.__name__: enum for enum in notes.enums()}


def test_every_layer_that_raises_notes_is_seen(enums: Mapping[str, type[Code]]) -> None:
    assert {"LogCode", "SensorCode", "EstimateCode", "IdentificationCode", "AgainstCode", "ClassCode"} <= set(enums)
    assert len(enums) == len(notes.enums())


def test_no_code_occurs_twice(enums: Mapping[str, type[Code]]) -> None:
    codes = [name for enum in enums.values() for name in enum.__members__]
    assert sorted(codes) == sorted(set(codes))


def test_sentences_of_notes_are_unique_clauses(enums: Mapping[str, type[Code]]) -> None:
    templates = [member.template for enum in enums.values() for member in enum]
    assert sorted(templates) == sorted(set(templates))
    assert [said for said in templates if said.endswith(".") or "\n" in said or said[0].isupper()] == []


def test_every_code_is_raised_somewhere(enums: Mapping[str, type[Code]]) -> None:
    raised = {code for site in notes.sites(enums) for code in site.codes}
    assert {f"{name}.{member.name}" for name, enum in enums.items() for member in enum} == raised


def test_every_note_is_raised_with_all_fields_of_its_sentence(enums: Mapping[str, type[Code]]) -> None:
    found = [
        f"{site.path}:{site.line}: {code} lacks {name}"
        for site in notes.sites(enums)
        for code in site.codes
        for name in notes.fields_of(enums[code.split(".")[0]][code.split(".")[1]].template) - site.fields
    ]
    assert found == []


def test_the_page_on_notes_is_current() -> None:
    written = (ROOT / "docs" / "notes.md").read_text(encoding="utf-8")
    assert written == notes.page(), "run python docs/notes.py"


class Weather(Code):
    """Codes of an example."""

    RAIN = "{depth_mm:.1f} mm of rain in {place}"
    SNOW = "snow in {place}"
    DRY = "no rain"


EXAMPLE = """
def said(wet, where):
    known = {"place": where, "depth_mm": 3.0}
    code = Weather.RAIN if wet else Weather.SNOW
    return code.note(**known), Weather.RAIN.note(place=where), (Weather.SNOW if wet else Weather.DRY).note(**at(where))

def at(where):
    return {"place": where}

def asked(note):
    return note.code == Weather.DRY
"""


def test_the_scan_finds_codes_chosen_by_a_condition_and_fields_given_by_a_dictionary() -> None:
    known = {"Weather": Weather}
    by_codes = {site.codes: site.fields for site in notes.sites_in("a.py", EXAMPLE, known)}
    assert by_codes == {
        ("Weather.RAIN", "Weather.SNOW"): {"place", "depth_mm"},
        ("Weather.RAIN",): {"place"},
        ("Weather.SNOW", "Weather.DRY"): {"place"},
    }
    assert notes.fields_of(Weather.RAIN.template) - by_codes["Weather.RAIN",] == {"depth_mm"}


def test_the_scan_refuses_fields_from_a_dictionary_made_elsewhere() -> None:
    with pytest.raises(ValueError, match=r"line 1: what \*\* gives"):
        list(notes.sites_in("a.py", "Weather.RAIN.note(**elsewhere.known())", {"Weather": Weather}))


def test_a_converted_number_in_a_sentence_is_followed_by_its_unit(enums: Mapping[str, type[Code]]) -> None:
    """The unit follows the field, or the range of which the field is an end; no pressure is shown in pascal."""
    for member in (member for enum in enums.values() for member in enum):
        for said in re.split(r"[:,;] ", member.template.replace(":.", "=").replace(":+.", "=")):
            units = re.findall(r"\{[a-z_]+=[0-9]g\|([^}]+)\}", said)
            behind = re.split(r"\{[a-z_]+=[0-9]g\|[^}]+\}", said)[1:]
            joined = [text for text in behind if text not in (" ± ", " to ", " and at ", " and chamber B ")]
            assert all(text.lstrip().startswith(tuple(units)) for text in joined), member
        assert not re.search(r"\} (Pa|rad/s|m/s|m\^3/\(s Pa\))(?![a-z])", member.template), member


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        (".3g|bar", 250000.0, "2.5"),
        ("+.3g|rpm", 10.0, "+95.5"),
        (".2g|L/(min bar)", 2.5e-11, "0.15"),
        (".3g|MPa", 2.07e8, "207"),
        (".2g|mm/s", 0.012, "12"),
    ],
)
def test_a_sentence_gives_numbers_in_bar_rpm_and_other_workshop_units(field: str, value: float, said: str) -> None:
    class Told(Code):
        NUMBER = f"it is {{number:{field}}}"

    note = Told.NUMBER.note(number=value)
    assert (str(note), note.data) == (f"it is {said}", {"number": value})
