"""A make-up valve that never opened in a log is told of, and wear of the pump that a log does not exclude."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.explaining.left_open import OPEN_DELIVERY, valves_unseen, wear_open
from estimation.notes import RigCode
from tests.estimation.fits.short_logs import made_fit

FELT, UNFELT = 900.0, np.inf


@pytest.mark.parametrize(
    ("stds", "sides"),
    [
        ({"crack_a": FELT, "crack_b": UNFELT}, ["B"]),
        ({"crack_a": UNFELT, "crack_b": FELT}, ["A"]),
        ({"crack_a": FELT, "crack_b": FELT}, []),
        ({"crack_a": UNFELT, "crack_b": UNFELT}, []),  # an actuator without make-up, or a log that needs none
        ({}, []),
    ],
)
def test_one_valve_that_is_not_felt_beside_one_that_is(stds: dict[str, float], sides: list[str]) -> None:
    fit = made_fit(100.0, 2e8, 1e5)
    said = valves_unseen(replace(fit, std={**fit.std, **stds}))
    assert [note.data["side"] for note in said] == sides
    assert all(note.code is RigCode.MAKEUP_UNSEEN for note in said)


def test_wear_is_open_by_two_deviations_from_the_limit_on() -> None:
    assert wear_open(OPEN_DELIVERY) == ()
    assert [note.data["percent"] for note in wear_open(0.15)] == [pytest.approx(30.0)]
