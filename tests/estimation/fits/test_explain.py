"""Searches of a set of hypotheses, carried to their end."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits import explain
from estimation.fits.explain import CLOSE, ROUNDS
from plant.eha.model import EhaParameters

HEALTHY = EhaParameters()


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


def test_what_promises_most_is_settled_even_where_its_starts_are_not_what_it_says(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def tried(cost: float) -> Any:
        return SimpleNamespace(cost=cost)

    settled: list[float] = []
    monkeypatch.setattr(explain, "_settled", lambda _, start, __: settled.append(start.cost) or start)
    monkeypatch.setattr(explain, "_finished", lambda _, one: one)
    nothing: Any = None
    found = explain._likeliest(nothing, [[tried(np.inf), tried(np.inf)], [tried(9.0), tried(10.0), tried(90.0)]])  # pyright: ignore[reportPrivateUsage]
    assert [one.cost for one in found] == [9.0]
    assert settled == [np.inf, 9.0, 10.0]
    alone = explain._likeliest(nothing, [[tried(np.inf)]])  # pyright: ignore[reportPrivateUsage]
    assert [one.cost for one in alone] == [np.inf]


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.5, True), (0.59, True), (0.61, False), (0.8, False), (1.0, False), (1.24, False), (1.26, True), (2.0, True)],
)
def test_a_flow_that_no_worn_pump_and_no_rounded_rig_file_gives_is_objected_to(share: float, said: bool) -> None:
    displacement = share * HEALTHY.pump_displacement
    found: Any = SimpleNamespace(values={"pump_displacement": (displacement, 0.01 * displacement)})
    objections = explain.contradicted(found, HEALTHY)
    assert [note.data["percent"] for note in objections] == pytest.approx([100.0 * share] * said)
    other: Any = SimpleNamespace(values={"pressure_offset": (1e5, 1e3)})
    assert explain.contradicted(other, HEALTHY) == ()
