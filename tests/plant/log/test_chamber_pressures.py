"""The pressures of both chambers give the differential pressure; one alone does not."""

import numpy as np

from plant.log.chamber_pressures import CHAMBERS, PRESSURE, has_pressure_difference, with_pressure_difference

A, B = (np.array([3.0, 5.0, 8.0]), np.array([1.0, 1.0, np.nan]))
BOTH = dict(zip(CHAMBERS, (A, B), strict=True))


def test_both_chambers_give_their_difference_as_the_last_channel() -> None:
    found = with_pressure_difference(BOTH)
    assert list(found) == [*CHAMBERS, PRESSURE]
    np.testing.assert_array_equal(found[PRESSURE], [2.0, 4.0, np.nan])


def test_a_logged_differential_pressure_is_kept_and_one_chamber_pressure_adds_none() -> None:
    logged = {**BOTH, PRESSURE: np.zeros(3)}
    alone = {CHAMBERS[0]: A}
    assert with_pressure_difference(logged) is logged
    assert with_pressure_difference(alone) is alone
    assert [has_pressure_difference(one) for one in (BOTH, logged, alone, {})] == [True, True, False, False]
