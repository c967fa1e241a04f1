from collections.abc import Callable
from dataclasses import make_dataclass
from math import pi
from typing import Annotated, Any

import numpy as np
import pytest

from plant.eha.model import EhaParameters
from plant.errors import RigError
from plant.unit_text import plain_unit
from plant.units import LITRE_PER_MINUTE, SI, USUAL, conversion_to, notes, pint_conversion, require_number


@pytest.mark.parametrize(
    ("unit", "wanted", "factor"),
    [
        ("mm", "m", 1e-3),
        ("rpm", "rad/s", 2.0 * pi / 60.0),
        ("rev/min", "rad/s", 2.0 * pi / 60.0),
        ("deg/s", "rad/s", 0.017453292519943295),
        ("bar", "Pa", 1e5),
        ("psi", "Pa", 6894.757293168361),
        ("mpa", "Pa", 1e6),
        ("mPa", "Pa", 1e-3),
        ("kpa", "Pa", 1e3),
        ("mv", "V", 1e-3),
        ("lpm", "m^3/s", LITRE_PER_MINUTE),
    ],
)
def test_units_of_the_bench_convert_to_si(unit: str, wanted: str, factor: float) -> None:
    assert conversion_to(unit, wanted) == (pytest.approx(factor, rel=1e-14), 0.0)


def test_conversion_carries_the_offset_of_a_temperature() -> None:
    factor, offset = conversion_to("degC", "kelvin")
    assert (factor, offset) == (pytest.approx(1.0), pytest.approx(273.15))


@pytest.mark.parametrize("unit", ["furlongz", "kg", "", "2 mm", "(", "5", "mm +"])
def test_a_unit_that_is_no_length_is_refused(unit: str) -> None:
    with pytest.raises(ValueError, match="unit"):
        conversion_to(unit, "m")


def test_hertz_does_not_convert_to_angular_speed() -> None:
    with pytest.raises(ValueError, match="leaves the angle out"):
        conversion_to("Hz", "rad/s")


def test_angular_speed_does_not_convert_to_hertz() -> None:
    with pytest.raises(ValueError, match="angle"):
        conversion_to("rad/s", "Hz")


@pytest.mark.parametrize("value", [1e-190, 1e209, 1e300])
def test_a_parameter_of_impossible_magnitude_is_refused(value: float) -> None:
    with pytest.raises(RigError, match=r"piston_area must be from 1e-40 to 1e\+40 in size"):
        require_number("piston_area", value)


def test_a_parameter_without_a_unit_is_refused_by_name() -> None:
    made = make_dataclass("Own", [("mass", Annotated[float, SI("kg", "of the piston", "own")]), ("length", float)])
    with pytest.raises(TypeError, match=r"Own\.length must carry an SI note, got <class 'float'>"):
        notes(made)


def test_common_units_convert_without_pint_as_pint_converts_them() -> None:
    for name in USUAL:
        for wanted in {si for si, _ in USUAL.values()}:
            assert _converted(conversion_to, name, wanted) == _converted(
                pint_conversion, name, plain_unit(name), wanted
            )


def _converted(convert: Callable[..., tuple[float, float]], *units: str) -> object:
    try:
        return convert(*units)
    except ValueError as error:
        return str(error)


@pytest.mark.parametrize("value", [np.float32(1.5e9), np.int64(1_500_000_000)])
def test_a_number_of_numpy_becomes_a_float(value: Any) -> None:
    p = EhaParameters(bulk_modulus=value)
    assert type(p.bulk_modulus) is float
    assert p.bulk_modulus == 1.5e9
    with pytest.raises(RigError, match="bulk_modulus must be a finite number, got nan"):
        EhaParameters(bulk_modulus=np.float32("nan"))  # type: ignore[arg-type]
