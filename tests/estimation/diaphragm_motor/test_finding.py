"""When a number of the diaphragm motor is reported, and objections to all of them."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from estimation.diaphragm_motor.card import MOST_LEAKAGE
from estimation.diaphragm_motor.finding import (
    CLEARLY_NEGATIVE_DEVIATIONS,
    MOST_DEVIATION,
    SIZES,
    MotorCode,
    _pattern_notes,
    _quantity,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters

MOTOR = DiaphragmMotorParameters()


def estimate(
    value: float, deviation: float, name: str = "crossport_leakage", *, holds: bool = True, velocity: float = 1e-3
) -> Any:
    return SimpleNamespace(
        values={name: value}, deviations={name: deviation}, pattern_holds=holds, pattern=30.0, velocity=velocity
    )


def test_a_broken_pattern_takes_precedence_over_a_negative_leakage() -> None:
    (broken,) = _pattern_notes(estimate(-1e-12, 1e-15, holds=False), MOTOR)
    assert broken == MotorCode.PATTERN_BROKEN.note(chi_square=30.0)
    (faster,) = _pattern_notes(estimate(-1.01 * CLEARLY_NEGATIVE_DEVIATIONS * 1e-14, 1e-14), MOTOR)
    assert faster.code is MotorCode.FASTER_THAN_MAPS
    for leakage in (-0.99 * CLEARLY_NEGATIVE_DEVIATIONS * 1e-14, 1e-12):
        assert _pattern_notes(estimate(leakage, 1e-14), MOTOR) == ()


@pytest.mark.parametrize(
    ("velocity", "spool", "leakage", "refused"),
    [
        (-1e-3, 1.0, 1.1 * MOST_LEAKAGE, True),
        (1e-3, -1.0, 1.1 * MOST_LEAKAGE, True),
        (-1e-3, -1.0, 1.1 * MOST_LEAKAGE, False),  # a valve that retracts
        (-1e-3, 1.0, 0.9 * MOST_LEAKAGE, False),  # a heavy load pushes the rod back through a leak
        (1e-3, 1.0, 1.1 * MOST_LEAKAGE, False),
    ],
)
def test_a_rod_that_moves_against_the_flow_faster_than_a_leak_allows_is_refused(
    velocity: float, spool: float, leakage: float, refused: bool
) -> None:
    notes = _pattern_notes(estimate(leakage, 1e-14, velocity=velocity), replace(MOTOR, spool=spool))
    assert [note.code for note in notes] == ([MotorCode.ROD_BACKWARDS] if refused else [])


@pytest.mark.parametrize("name", SIZES)
def test_a_value_is_reported_only_if_its_deviation_is_small(name: str) -> None:
    unit, size = SIZES[name]
    for value, most in ((0.0, size), (-5.0 * size, 5.0 * size)):
        known = _quantity(name, estimate(value, 0.99 * MOST_DEVIATION * most, name), told=True)
        assert (known.value, known.unit) == (value, unit)
        assert known.ci95 is not None
        vague = _quantity(name, estimate(value, 1.01 * MOST_DEVIATION * most, name), told=True)
        assert vague.value is None
        assert vague.std == pytest.approx(1.01 * MOST_DEVIATION * most, rel=1e-6, abs=0.0)
    assert _quantity(name, estimate(0.0, 0.0, name), told=False).value is None
