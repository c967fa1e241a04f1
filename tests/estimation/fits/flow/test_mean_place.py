"""Where the means of a pressure may lie, which place is the likeliest, and what stays open."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.fits.flow.mean_place import MOST_ROWS, SURE_PLACE, placed_means
from estimation.fits.flow.plain import FitStart, Logged
from estimation.log_checks.channel_names import PRESSURE
from plant.log.record import Record


def logged(sample_time: float) -> Logged:
    return Logged(Record(sample_time, {PRESSURE: np.zeros(MOST_ROWS + 5)}), {})


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> dict[int, tuple[float, float]]:
    """Return cost and bulk modulus by the rows from a mean's first one to its own, for a test to fill in."""
    by_place = dict[int, tuple[float, float]]()

    def plain_fits(part: Logged, _: FitStart) -> Any:
        assert len(part.record) == MOST_ROWS
        cost, modulus = by_place[part.mean.after]
        fit = SimpleNamespace(cost=cost, values={"bulk_modulus": modulus})
        return SimpleNamespace(best=fit, swinging=fit, explains=lambda one: one.cost < 100.0)

    monkeypatch.setattr("estimation.fits.flow.mean_place.plain_fits", plain_fits)
    return by_place


def placed(rows: int, sample_time: float = 1e-3) -> tuple[list[tuple[int, int]], float]:
    found, doubt = placed_means(logged(sample_time), cast("FitStart", None), rows)
    return [(one.mean.after, one.mean.first) for one in found], doubt


def test_means_of_an_even_count_may_lie_about_either_row_in_their_middle(told: dict[int, tuple[float, float]]) -> None:
    told.update({1: (20.0, 2.0e8), 2: (40.0, 2.2e8), 3: (60.0, 2.4e8)})
    assert placed(4) == ([(1, 0)], 0.0)
    assert placed(4, 1e-4)[0] == [(1, 3)]  # a fast log keeps the rows before its first block
    told.clear()
    told.update({2: (20.0, 2.0e8), 4: (40.0, 2.2e8)})
    assert placed(5) == ([(2, 0)], 0.0)


def test_a_place_that_is_hardly_less_likely_widens_bulk_modulus(told: dict[int, tuple[float, float]]) -> None:
    told.update({1: (20.0, 2.0e8), 2: (20.0 + 0.9 * SURE_PLACE, 2.1e8), 3: (20.0 + 1.1 * SURE_PLACE, 3.0e8)})
    assert placed(4) == ([(1, 0)], pytest.approx(0.05))


def test_a_log_that_no_place_explains_keeps_all_the_likeliest_first(told: dict[int, tuple[float, float]]) -> None:
    told.update({1: (300.0, 2.0e8), 2: (200.0, 2.1e8), 3: (400.0, 3.0e8)})
    assert placed(4) == ([(2, 0), (1, 0), (3, 0)], 0.0)
    assert placed(1) == ([(0, 0)], 0.0)
