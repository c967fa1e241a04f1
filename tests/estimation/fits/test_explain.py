"""Searches of a set of hypotheses, carried to their end."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits import explain
from estimation.fits.explain import CLOSE, ROUNDS


def ended(costs: Sequence[float], monkeypatch: pytest.MonkeyPatch) -> tuple[float, int]:
    """Return the cost at which searches end that reach these, one after another, and how many there were."""
    made: list[float] = []

    def descended(*_: Any) -> Any:
        made.append(costs[len(made)])
        return SimpleNamespace(cost=made[-1], point=SimpleNamespace(theta=np.zeros(1)))

    monkeypatch.setattr(explain, "_descended", descended)
    nothing: Any = None
    return explain._to_its_end(nothing, nothing, np.zeros(1)).cost, len(made)  # pyright: ignore[reportPrivateUsage]


def test_a_search_goes_on_while_it_gains_what_tells_hypotheses_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    costs = [9.0 * CLOSE, 6.0 * CLOSE, 4.5 * CLOSE, 4.0 * CLOSE, 0.0]
    assert ended(costs, monkeypatch) == (4.0 * CLOSE, 4)


def test_a_search_that_gains_nothing_keeps_what_it_had_and_is_not_endless(monkeypatch: pytest.MonkeyPatch) -> None:
    assert ended([3.0 * CLOSE, 3.5 * CLOSE], monkeypatch) == (3.0 * CLOSE, 2)
    assert ended([-2.0 * CLOSE * i for i in range(ROUNDS + 3)], monkeypatch)[1] == ROUNDS
