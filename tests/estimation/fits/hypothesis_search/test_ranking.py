"""Which of several sets of hypotheses are searched to their optimum."""

from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypothesis_search import ranking
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import RIVAL_DISTANCE


def tried(cost: float, place: float, **delays: float) -> Trial:
    return Trial((), Point(np.full(1, place), cost, np.zeros(1), np.eye(1)), {}, delays, {})


def test_two_starts_that_reached_the_same_point_are_searched_further_once(monkeypatch: pytest.MonkeyPatch) -> None:
    led: list[tuple[float, float]] = []

    def settled(_: Any, start: Trial, wanted: float, *__: Any) -> Trial:
        led.append((float(start.point.theta[0]), wanted))
        return start

    monkeypatch.setattr(ranking, "search_coarsely", settled)
    nothing: Any = None
    for second in (tried(1000.1, 0.5), tried(1000.1, 2.0), tried(1500.0, 0.5), tried(1000.1, 0.5, pressure=1e-3)):
        led.clear()
        ranking.ranked_optima(nothing, [[tried(1000.0, 0.0), second]], known=2e3)
        first = (0.0, 2e3 * ranking.NEARLY_AS_GOOD + RIVAL_DISTANCE)
        apart = second.cost > 1001.0 or second.delays or second.point.theta[0] > 1.5
        # the second must end lower than the first
        assert led == ([first, (float(second.point.theta[0]), 1000.0)] if apart else [first])
