"""Final fits of sets of hypotheses."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import AIR, AIR_MIDWAY, CHECKS_CRACK, MAKEUP_BLOCKED, OFFSET
from estimation.fits.hypothesis_search import final_fits
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import EQUAL_DISTANCE, FAR_BEHIND, RIVAL_DISTANCE, leaves_oil
from estimation.models.completed_flow import CRACKS
from tests.estimation.fits.short_logs import made_fit


@pytest.mark.parametrize(("by_mass", "order"), [(True, [1.0, 0.0]), (False, [0.0, 1.0])])
def test_a_set_is_fitted_first_by_the_balance_of_its_search_and_the_other_must_be_as_good(
    by_mass: bool, order: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    led: list[tuple[float, float]] = []

    def to_its_end(problem: Any, tried: Trial, *_: Any, useful: float = np.inf) -> Trial:
        led.append((problem.share, useful))
        return replace(tried, point=replace(tried.point, cost=50.0 * len(led)))

    model = SimpleNamespace(theta=lambda _: np.zeros(1))
    monkeypatch.setattr(final_fits, "without_delays", lambda log, _: log)
    monkeypatch.setattr(final_fits, "coarse_log", lambda *_: None)
    monkeypatch.setattr(final_fits, "balances_mass", lambda _: by_mass)
    monkeypatch.setattr(final_fits, "with_balance", lambda _, share: share)
    monkeypatch.setattr(final_fits, "hypothesis_problem", lambda share, *_: SimpleNamespace(model=model, share=share))
    monkeypatch.setattr(final_fits, "usual_values", lambda _: {})
    monkeypatch.setattr(final_fits, "_completed_search", to_its_end)
    monkeypatch.setattr(final_fits, "flow_bounds", lambda *_: (np.zeros(1), np.ones(1)))
    monkeypatch.setattr(final_fits, "fit_at_solution", lambda *_, **__: made_fit(50.0, 2e8, 1e5))
    nothing: Any = SimpleNamespace(passes_on=False)
    begun = Trial((), Point(np.zeros(1), 90.0, np.zeros(1), np.eye(1)), {}, {}, {})
    assert final_fits.final_fit(nothing, begun).cost == 50.0
    assert led == [(order[0], np.inf), (order[1], 50.0 + EQUAL_DISTANCE)]


@pytest.mark.parametrize(("cost", "searches"), [(0.9, 2), (1.1, 1)])
def test_a_set_far_behind_the_best_is_given_up(cost: float, searches: int, monkeypatch: pytest.MonkeyPatch) -> None:
    useful = 100.0 * RIVAL_DISTANCE
    costs = [cost * FAR_BEHIND * useful] * 2

    def descended(*_: Any, **__: Any) -> Any:
        return SimpleNamespace(cost=costs.pop(), point=SimpleNamespace(theta=np.zeros(1)))

    monkeypatch.setattr(final_fits, "after_descent", descended)
    nothing: Any = SimpleNamespace(drives=(), steps=None)
    begun: Any = SimpleNamespace(cost=np.inf)
    ended: list[Any] = []

    def to_all_short_steps(at: Any, theta: Any, *_: Any, **__: Any) -> Any:
        ended.append(at)
        return SimpleNamespace(theta=theta)

    problem: Any = SimpleNamespace(log=nothing, model=SimpleNamespace(values=lambda _: {}), at="all short steps")
    monkeypatch.setattr(final_fits, "with_steps_where_needed", lambda one, _: one)
    monkeypatch.setattr(final_fits, "flow_bounds", lambda *_: (np.zeros(1), np.ones(1)))
    monkeypatch.setattr(final_fits, "descend", to_all_short_steps)
    monkeypatch.setattr(final_fits, "replace", lambda one, **_: one)
    final_fits._completed_search(problem, begun, np.zeros(1), useful=useful)  # pyright: ignore[reportPrivateUsage]
    assert len(costs) == 2 - searches
    assert ended == [problem.at]


@pytest.mark.parametrize(("cost", "std", "kept"), [(80.0, 1.1e5, True), (80.0, 3e4, False), (95.0, 1.1e5, False)])
def test_valves_are_freed_at_the_end_unless_they_chatter_or_the_set_fits_worse(
    cost: float, std: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = Trial((OFFSET,), Point(np.zeros(1), 90.0, np.zeros(1), np.eye(1)), {}, {}, {}, (made_fit(90.0, 2e8, 1e5),))
    before = replace(before, values={OFFSET.free[0]: 1e5})
    freed: list[str] = []

    def further(_: Any, tried: Trial, __: float, *details: str) -> Trial:
        freed.extend(details)
        return replace(tried, point=replace(tried.point, cost=cost), fits=(made_fit(cost, 2e8, std),))

    monkeypatch.setattr(final_fits, "final_fit", further)
    nothing: Any = SimpleNamespace(passes_on=False)
    told = final_fits.with_details(nothing, before)
    assert {*CRACKS} < {*freed}
    assert told.cost == (cost if kept else before.cost)


def test_valves_that_a_set_frees_itself_are_not_freed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(final_fits, "final_fit", lambda *_: pytest.fail("fitted again"))
    nothing: Any = SimpleNamespace(passes_on=False)
    for own in (CHECKS_CRACK, AIR_MIDWAY):
        tried = Trial((own,), Point(np.zeros(1), 90.0, np.zeros(1), np.eye(1)), {}, {}, {})
        assert final_fits.with_details(nothing, tried) is tried


@pytest.mark.parametrize(
    ("share", "cost", "alone"),
    [
        (1.02, 95.0, True),
        (1.07, 95.0, True),  # its 3.5 deviations gain less than a hypothesis must
        (1.02, 101.0, False),  # the hypothesis is needed
        (80.0, 95.0, False),  # the valve is stuck
    ],
)
def test_a_hypothesis_whose_effect_vanished_is_dropped_from_a_pair(
    share: float, cost: float, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In oil with air, a sound make-up valve was said to be stuck shut."""
    fit = made_fit(90.0, 2e8, 1e5)
    fit = replace(fit, std={**fit.std, "air_softness": 3.0, "makeup_share_b": 0.02})
    absent = {"air_softness": 0.0, "makeup_share_b": 1.0}
    values = {"air_softness": 2764.0, "makeup_share_b": share}
    point = Point(np.zeros(1), 90.0, np.zeros(1), np.eye(1))
    both = Trial((AIR, MAKEUP_BLOCKED), point, values, {}, absent, (fit,))

    def fewer(_: Any, tried: Trial, useful: float) -> Trial:
        assert useful == 100.0
        assert tried.values == {**values, "makeup_share_b": 1.0}
        return replace(tried, point=replace(tried.point, cost=cost))

    monkeypatch.setattr(final_fits, "final_fit", fewer)
    nothing: Any = None
    told = final_fits.without_vanished_effect(nothing, both)
    assert told.together == ((AIR,) if alone else (AIR, MAKEUP_BLOCKED))


@pytest.mark.parametrize(
    ("share", "doubt", "onset", "possible"),
    [
        (0.9, 0.001, -1.0, True),
        (1.1, 0.001, -1.0, False),  # the liquid alone would have a negative bulk modulus
        (3.4, 0.01, -1.0, False),
        (1.1, 0.1, -1.0, True),  # by chance
        (1.1, 0.001, 0.4, True),  # `bulk_modulus` is that of the liquid
        (0.0, 0.0, -1.0, True),
    ],
)
def test_air_that_is_surely_softer_than_the_oil_that_contains_it_is_no_explanation(
    share: float, doubt: float, onset: float, possible: bool
) -> None:
    stiffness, pressure = 4e8, 1e6
    values = {
        "bulk_modulus": stiffness,
        "air_softness": share * pressure**2 / stiffness,
        "air_onset": onset,
        "air_quickness": 0.0,
        "stated_pressure": pressure,
    }
    std = {"bulk_modulus": 0.5 * doubt * stiffness, "air_softness": 0.5 * doubt * values["air_softness"]}
    assert leaves_oil(values, std) is possible


def test_air_that_is_compressed_quickly_is_stiffer_and_leaves_more_liquid() -> None:
    values = {"bulk_modulus": 4e8, "air_softness": 2750.0, "air_onset": -1.0, "stated_pressure": 101325.0 * 2.0}
    share = 4e8 * 2750.0 / (101325.0 * 2.0) ** 2
    assert not leaves_oil({**values, "air_quickness": 0.0}, {})
    scale = 1.05 / share  # isothermal air of 105 % of the compliance; 96 % with an exponent of 1.25
    assert not leaves_oil({**values, "air_softness": 2750.0 * scale, "air_quickness": 0.0}, {})
    assert leaves_oil({**values, "air_softness": 2750.0 * scale, "air_quickness": 0.2}, {})
