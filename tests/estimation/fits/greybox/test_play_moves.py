"""Shift of the unknowns by a play that residuals show."""

import numpy as np
import pytest

from estimation.fits.greybox.play import shown_play
from plant.arrays import Array


def test_a_play_shifts_the_unknowns_by_the_share_that_they_absorb() -> None:
    errors, change = np.array([-3.0, 1.0, 2.0, 0.5]), np.array([1e-6, 0.0, -1e-6, 0.0])
    slope = np.array([1.0, 2.0, 0.0, 1.0])

    def taken(one: Array) -> list[tuple[str, float]]:
        return [("bulk_modulus", float(slope @ one / (slope @ slope)))]

    def left(one: Array) -> Array:
        return one - slope * taken(one)[0][1]

    found = shown_play([change], 9.0 * errors, left, taken)
    least = np.linalg.lstsq(np.column_stack([slope, change / 1e-6]), -9.0 * errors, rcond=None)[0]
    assert found.size == pytest.approx(least[1])
    assert found.moved == {"bulk_modulus": pytest.approx(least[0] - slope @ (-9.0 * errors) / (slope @ slope))}
