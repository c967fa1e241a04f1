"""What of several sets of hypotheses is brought to its optimum."""

from typing import Any

import numpy as np
import pytest

from estimation.fits.explaining import likeliest as ranking
from estimation.fits.explaining.finished import CLOSE
from estimation.fits.explaining.tried import Tried
from estimation.fits.greybox.descent import Point


def tried(cost: float, place: float, **delays: float) -> Tried:
    return Tried((), Point(np.full(1, place), cost, np.zeros(1), np.eye(1)), {}, delays, {})


def test_two_starts_that_came_to_one_place_are_led_on_once(monkeypatch: pytest.MonkeyPatch) -> None:
    led: list[tuple[float, float]] = []

    def settled(_: Any, start: Tried, wanted: float, *__: Any) -> Tried:
        led.append((float(start.point.theta[0]), wanted))
        return start

    monkeypatch.setattr(ranking, "settled", settled)
    nothing: Any = None
    for second in (tried(1000.1, 0.5), tried(1000.1, 2.0), tried(1500.0, 0.5), tried(1000.1, 0.5, pressure=1e-3)):
        led.clear()
        ranking.settled_each(nothing, [[tried(1000.0, 0.0), second]], known=2e3)
        first = (0.0, 2e3 * ranking.NEARLY_AS_GOOD + CLOSE)
        apart = second.cost > 1001.0 or second.delays or second.point.theta[0] > 1.5
        # the second has to come lower than the first
        assert led == ([first, (float(second.point.theta[0]), 1000.0)] if apart else [first])
