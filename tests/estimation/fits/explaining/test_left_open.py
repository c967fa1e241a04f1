"""A make-up valve that never opened in a log is told of, and wear of the pump that a log does not exclude."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.explaining.left_open import OPEN_DELIVERY, valves_unseen, wear_open
from estimation.fits.explaining.promises import NOTHING_PROMISED, Promise
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


@pytest.mark.parametrize(
    ("size", "deviation", "percent"),
    [
        (0.0, 0.5 * OPEN_DELIVERY, None),
        (0.0, 0.15, 30.0),
        (-0.08, 0.02, 12.0),  # known well, but well below a sound pump
        (0.08, 0.08, None),  # as much above one
        (-0.05, 0.02, 9.0),
        (-0.05, 0.024, 9.8),  # two deviations below
        (-0.04, 0.025, None),
        (-0.029, 0.001, None),
    ],
)
def test_wear_is_open_where_two_deviations_below_what_is_likeliest_come_to_the_limit(
    size: float, deviation: float, percent: float | None
) -> None:
    said = wear_open(Promise(1.0, size, deviation))
    assert [note.data["percent"] for note in said] == ([] if percent is None else [pytest.approx(percent)])
    assert wear_open(NOTHING_PROMISED) == ()
