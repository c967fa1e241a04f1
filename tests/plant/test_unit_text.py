import math
import time

import pytest

from plant.errors import LogError, RigError
from plant.log.columns import parse_columns, resolve_columns
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
