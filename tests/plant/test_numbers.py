"""Results of units and of runs of every actuator on either side of their limits, kept in `numbers.json`."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from plant.runs import (
    MOST_SAMPLES,
    checked_series,
    require_drivable,
    require_finite,
    require_frequency,
    require_positive,
    sample_count,
    steps_a_sample,
    with_noise,
)
from plant.unit_text import plain_unit
from plant.units import LITRE_PER_MINUTE, conversion_to, converts, notes, require_number, require_numbers, si
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)


@dataclass(frozen=True)
class Rod:
    area: float = si(3e-4, "m^2", "area of the rod", "drawing 7")
    slope: float = si(-1.0, "1", "slope", "judged", signed=True)
    play: float = si(0.0, "m", "play", "judged")
    limit: float | None = si(None, "m", "limit", "judged")
    row: tuple[float, ...] = si((1.0, 2.0), "1", "row", "judged")


def refused(made: Any) -> bool:
    return isinstance(or_refused(made), str)


@NUMBERS.case()
def conversions() -> dict[str, Any]:
    pairs = (
        ("mm", "m"),
        ("-rpm", "rad/s"),
        ("1/min", "rad/s"),
        ("bar", "Pa"),
        ("degC", "K"),
        ("kPa", "Pa"),
        ("mpa", "Pa"),
        ("mv", "V"),
        ("l/min", "m^3/s"),
        ("lpm", "m^3/s"),
        ("cm/s", "m/s"),
        ("deg/s", "rad/s"),
        ("psi", "Pa"),
        ("Hz", "rad/s"),
        ("rev/s", "rad/s"),
        ("foo", "m"),
        ("kg", "m"),
        ("m*", "m"),
        ("rad", "m"),
        ("kN", "N"),
        ("us", "s"),
    )
    spelt = (
        "mm/s²",
        "kgf/cm^2",
        "U/min",
        "m3/h",
        "s-1",
        "m^10",
        "9",
        "1/s",
        "a" * 24,
        "a" * 25,
        "m/s/s/s",
        "m/s/s/s/s",
        "(m*s)",
        "m/(s*kg)",
        "°C",
        "Mm",
        "MM",
        "m·s",
        "m" + "*m" * 19,
        "m" + "*m" * 20,
        "Sekunden",
    )
    return {
        "factors": {
            f"{unit} in {wanted}": or_refused(
                lambda unit=unit, wanted=wanted: dict(
                    zip(("factor", "offset"), conversion_to(unit, wanted), strict=True)
                )
            )
            for unit, wanted in pairs
        },
        "convert": [converts(*pair) for pair in pairs],
        "spelt": {unit: or_refused(lambda unit=unit: plain_unit(unit)) for unit in spelt},
        "one litre a minute [m^3/s]": LITRE_PER_MINUTE,
    }


@NUMBERS.case()
def numbers_that_are_allowed() -> dict[str, Any]:
    def takes(value: Any, **how: bool) -> bool:
        return not refused(lambda: require_number("x", value, **how))

    values = (-1.0, 0.0, 1e-41, 1.0, 1e41, np.inf, np.nan, True, "a", 3)
    return {
        "positive": [takes(one) for one in values],
        "signed": [takes(one, signed=True) for one in values],
        "zero": [takes(one, zero=True) for one in values],
        "smallest": edge(takes, 1e-42, 1e-38),
        "largest": edge(takes, 1e38, 1e42),
        "notes": {name: [one.unit, one.meaning, one.source, one.signed, one.zero] for name, one in notes(Rod).items()},
        "sets": [
            refused(lambda one=one: require_numbers(Rod(**one)))
            for one in (
                {},
                {"area": 0.0},
                {"slope": 0.0},
                {"play": -1.0},
                {"limit": 1.0},
                {"limit": -1.0},
                {"row": (1.0, 0.0)},
                {"row": (1.0,)},
                {"area": None},
            )
        ],
        "second of a row": or_refused(lambda: require_numbers(Rod(row=(1.0, -2.0)))),
    }


@NUMBERS.case()
def samples_and_drives() -> dict[str, Any]:
    states = np.zeros((6, 2))
    states[4, 1] = np.nan
    noisy = with_noise(
        {"a": np.zeros(3), "b": np.ones(3)}, {"a": 0.5, "b": 2.0}, np.random.default_rng(1), keep_truth=True
    )
    return {
        "counts": [
            or_refused(lambda one=one: sample_count(*one))
            for one in (
                (10.0, 1e-4),
                (1.4, 1.0),
                (1.5, 1.0),
                (1.51, 1.0),
                (2.0, 1.0),
                (float(MOST_SAMPLES), 1.0),
                (MOST_SAMPLES + 1.0, 1.0),
                (0.0, 1.0),
                (1.0, -1.0),
                (np.inf, 1.0),
            )
        ],
        "steps": [
            steps_a_sample(*one)
            for one in ((1e-3, 1e-4), (1e-5, 1e-4), (1e-3, 3e-4), (3e-4, 1e-4), (1.0000001e-3, 1e-4))
        ],
        "positive": [
            refused(lambda one=one: require_positive("x", one, "s")) for one in (-1.0, 0.0, 1e-9, np.inf, np.nan)
        ],
        "frequency to [Hz]": edge(lambda one: refused(lambda: require_frequency("f", one, 1e-3)), 1.0, 900.0),
        "frequencies": [refused(lambda one=one: require_frequency("f", one, 1e-3)) for one in (499.9, 500.0)],
        "drivable": [
            refused(lambda one=one: require_drivable(one, 480.0)) for one in (-1.0, 0.0, 1e-9, 480.0, 480.1, np.nan)
        ],
        "series": [
            or_refused(lambda one=one: checked_series(np.asarray(one)).tolist())
            for one in ([1, 2], [1.0], [[1.0, 2.0]], [1.0, np.nan, 2.0])
        ],
        "finite": or_refused(lambda: require_finite(states, 0.5, "x")),
        "finite states": or_refused(lambda: require_finite(states[:3], 0.5, "x")),
        "noise": noisy,
        "without noise": with_noise({"a": np.zeros(2)}, {"a": 0.0}, None, keep_truth=False),
        "noise without chance": or_refused(lambda: with_noise({"a": np.zeros(2)}, {"a": 1.0}, None, keep_truth=False)),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
