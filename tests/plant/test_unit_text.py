import math
import time

import pytest

from plant.errors import LogError, RigError
from plant.log.columns import parse_columns, resolve_columns
from plant.log.headings import Heading
from plant.unit_text import plain_unit
from plant.units import conversion_to

HOSTILE = [
    "m*9**9**9",
    "m**9**9",
    "m±1",
    "m^99",
    "2 m",
    "m;import os",
    "m" * 60,
    "__import__('os')",
    "m/(s/(m/(s",
    "m^-",
]


@pytest.mark.parametrize("unit", HOSTILE)
def test_a_unit_that_is_no_product_of_names_is_refused_before_it_is_evaluated(unit: str) -> None:
    begun = time.process_time()
    with pytest.raises(ValueError, match="is unknown, wanted names with whole powers"):
        conversion_to(unit, "m")
    assert time.process_time() - begun < 5.0  # the evaluation used to run for ever


@pytest.mark.parametrize("unit", HOSTILE[:3])
def test_an_invalid_unit_is_refused_in_a_header_and_on_the_command_line(unit: str) -> None:
    with pytest.raises(LogError, match="cannot become position_m"):
        resolve_columns([f"position_{unit}"], None, "a.csv")
    with pytest.raises(LogError, match="cannot become position_m"):
        resolve_columns([f"Position [{unit}]"], None, "a.csv")
    with pytest.raises(RigError, match="is unknown"):
        parse_columns([f"position_m=POS:{unit}"])


@pytest.mark.parametrize("unit", ["rpm", "RPM", "U/min", "1/min", "min-1", "min^-1", "rev/min", "r/min"])
def test_every_spelling_of_revolutions_per_minute_is_read(unit: str) -> None:
    assert conversion_to(unit, "rad/s") == (pytest.approx(math.pi / 30.0, rel=1e-14), 0.0)


@pytest.mark.parametrize(("unit", "spelt"), [("m/s²", "m/s^2"), ("kgf/cm2", "kgf/cm^2"), ("BAR", "bar"), ("Mm", "Mm")])
def test_units_of_benches_are_converted_to_the_spelling_of_the_library(unit: str, spelt: str) -> None:
    assert plain_unit(unit) == spelt


@pytest.mark.parametrize(
    ("spelling", "unit"),
    [
        ("mm/Sec", "mm/s"),
        ("Sec", "s"),
        ("psid", "psi"),
        ("psig", "psi"),
        ("kg/cm2", "kgf/cm^2"),
        ("Grad/s", "degree/s"),
    ],
)
def test_spellings_of_benches_mean_a_unit(spelling: str, unit: str) -> None:
    assert plain_unit(spelling) == unit


@pytest.mark.parametrize(
    ("spelling", "wanted", "factor"),
    [
        ("Inches", "m", 0.0254),
        ("IN.", "m", 0.0254),
        ("mil", "m", 2.54e-5),
        ("feet", "m", 0.3048),
        ("microns", "m", 1e-6),
        ("Millimeter", "m", 1e-3),
        ("ips", "m/s", 0.0254),
        ("fpm", "m/s", 0.3048 / 60.0),
        ("KSI", "Pa", 6894757.2931683635),
        ("PSIG", "Pa", 6894.7572931683635),
        ("psia", "Pa", 6894.7572931683635),
        ("bar abs", "Pa", 1e5),
        ("MPag", "Pa", 1e6),
        ("mPa", "Pa", 1e-3),
        ("kp/cm²", "Pa", 98066.5),
        ("krpm", "rad/s", 1000.0 * math.pi / 30.0),
        ("rps", "rad/s", 2.0 * math.pi),
        ("revs/min", "rad/s", math.pi / 30.0),
        ("об/мин", "rad/s", math.pi / 30.0),  # noqa: RUF001
        ("МПа", "Pa", 1e6),
        ("Sek.", "s", 1.0),
        ("msecs", "s", 1e-3),
        ("hours", "s", 3600.0),
    ],
)
def test_what_workshops_call_a_unit_is_read_in_brackets_as_well(spelling: str, wanted: str, factor: float) -> None:
    assert conversion_to(spelling, wanted) == (pytest.approx(factor, rel=1e-12), 0.0)
    assert Heading(f"x ({spelling})").unit == spelling


@pytest.mark.parametrize("word", ["actual", "CH1", "filtered", "Min", "abs", "a", "0.1 mm", "x10 bar"])
def test_other_words_in_brackets_are_no_units(word: str) -> None:
    assert Heading(f"x ({word})").unit is None
