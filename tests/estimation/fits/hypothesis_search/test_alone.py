"""Which hypotheses are tried alone and in pairs if little of a long log is unexplained, or much."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import DELIVERY, OFFSET, Hypothesis
from estimation.fits.hypothesis_search import explain
from estimation.fits.hypothesis_search.decimation import FAINT, SHORT_LOG, Decimation
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import REQUIRED_GAIN
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain

COST = attrgetter("cost")

LONG: Any = SimpleNamespace(drives=np.zeros((SHORT_LOG, 1)), sample_time=1e-3)


def hypothesis(name: str, *, far: bool = False) -> Hypothesis:
    return Hypothesis(name, ("anything",), far=far)


def tried(cost: float, place: float = 0.0, together: Any = ()) -> Trial:
    return Trial(together, Point(np.full(1, place), cost, np.zeros(1), np.eye(1)), {}, {}, {})


LIKELY, FAR, SOME, NONE = hypothesis("likely"), hypothesis("far", far=True), hypothesis("some"), hypothesis("none")


@pytest.fixture(autouse=True)
def reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explain, "decimation_limit", lambda _, __, every, *___: every)


@pytest.mark.parametrize("left", [1.5, 5.0])
def test_poor_and_duplicate_starts_are_dropped_if_the_misfit_is_small(
    left: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[list[Any]] = []

    def nearing(_: Any, __: Any, starts: Any, *___: Any) -> Any:
        told.append(starts)
        return [[tried(900.0)]]

    ends = {"a": tried(800.0), "the same": tried(800.0, 0.1), "elsewhere": tried(9e3, 3.0)}
    monkeypatch.setattr(explain, "screen", lambda _, __, starts, **___: [ends[one] for one in starts])
    monkeypatch.setattr(explain, "screened_hypotheses", nearing)
    monkeypatch.setattr(explain, "ranked_optima", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "refined_sets", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "likeliest_sets", lambda *_, **__: [])
    monkeypatch.setattr(explain, "cost_over_noise", lambda *_: 1.5)
    starts: Any = [*ends]
    spared = Decimation(1, left, starts)
    explain._single_hypotheses(LONG, 1000.0, [LIKELY], [FAR, SOME], spared, lambda _: False)  # pyright: ignore[reportPrivateUsage]
    assert told == [["a"] if left < FAINT else [*ends]]


@pytest.mark.parametrize(
    ("plain", "left", "asked"), [(1000.0, 1.1, ["far"]), (1000.0, 1.04, []), (805.0, 1.04, ["far", "some"])]
)
def test_more_hypotheses_are_tested_if_an_explanation_leaves_more_than_noise_or_gains_little(
    plain: float, left: float, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All are tried if it gains too little to be accepted: a worn pump that gained 3 hid a speed that gains 34."""
    told: list[str] = []

    def nearing(_: Any, given: Any, *__: Any) -> Any:
        told.extend(one.name for one in given)
        return [[tried(700.0)]]

    monkeypatch.setattr(explain, "screen", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "screened_hypotheses", nearing)
    monkeypatch.setattr(explain, "ranked_optima", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "refined_sets", lambda *_, **__: [replace(tried(800.0), fits=(LONG,))])
    monkeypatch.setattr(explain, "likeliest_sets", lambda *_, **__: [tried(700.0)])
    monkeypatch.setattr(explain, "cost_over_noise", lambda *_: left)
    found = explain._single_hypotheses(LONG, plain, [LIKELY], [FAR, SOME], Decimation(1, left, [{}]), lambda _: True)  # pyright: ignore[reportPrivateUsage]
    assert told == asked
    assert [one.cost for one in found] == ([700.0, 800.0] if asked else [800.0])


Pairing = Callable[..., list[Trial]]


@pytest.fixture
def pairing(monkeypatch: pytest.MonkeyPatch) -> Pairing:
    """Return a search for pairs beside a hypothesis of cost 5,000, with given trials and fits; noise costs 1,000."""

    def paired(every: int, screened: Any, led_on: Any, rivalled: float = np.inf) -> list[Trial]:
        monkeypatch.setattr(explain, "without_delays", lambda log, _: log)
        monkeypatch.setattr(explain, "by_predicted_gain", lambda *_: ([LIKELY], [FAR, SOME, NONE], {}))
        monkeypatch.setattr(explain, "own_starts", lambda *_: [{}])
        monkeypatch.setattr(explain, "_restart_values", lambda *_: {"from": 1.0})
        monkeypatch.setattr(explain, "decimation_for", lambda *_: every)
        monkeypatch.setattr(explain, "cost_over_noise", lambda _, cost: cost / 1000.0)
        monkeypatch.setattr(explain, "screen", screened)
        monkeypatch.setattr(explain, "ranked_optima", lambda _, ways, *__: [min(way, key=COST) for way in ways])
        monkeypatch.setattr(explain, "refined_sets", led_on)
        monkeypatch.setattr(
            explain, "likeliest_sets", lambda log, ways, *_: led_on(log, [next(iter(way)) for way in ways])
        )
        first = tried(5000.0, together=(hypothesis("first"),))
        return explain._hypothesis_pairs(LONG, first, {}, lambda _: False, rivalled=rivalled)  # pyright: ignore[reportPrivateUsage]

    return paired


def test_a_pair_beside_a_rival_must_gain_over_the_best_known_pair(pairing: Pairing) -> None:
    useful: list[float] = []

    def screened(_: Any, together: Any, starts: Any, *__: Any, **___: Any) -> list[Trial]:
        return [tried(1450.0, together=together)] * len(starts)

    def led_on(_: Any, ended: Sequence[Trial], *given: Any) -> list[Trial]:
        useful.extend(given[2:])
        return [*ended]

    assert [one.cost for one in pairing(2, screened, led_on, 1461.0)] == [1450.0] * 4
    assert not pairing(2, screened, led_on, 1459.0)
    assert useful == [1461.0 - REQUIRED_GAIN, 1459.0 - REQUIRED_GAIN]


def test_a_late_and_an_early_speed_with_the_same_optimum_count_as_one() -> None:
    late, early = (Hypothesis(name, ("speed_lag",)) for name in ("speed_late", "speed_early"))
    one = tried(800.0, together=(late,))
    again = replace(tried(800.0, 0.1, together=(early,)), delays={"motor_speed_rad_s": 0.0})
    assert explain._is_same_fit(one, again)  # pyright: ignore[reportPrivateUsage]
    assert not explain._is_same_fit(one, replace(again, delays={"motor_speed_rad_s": -1e-3}))  # pyright: ignore[reportPrivateUsage]
    assert not explain._is_same_fit(one, replace(again, together=(OFFSET,)))  # pyright: ignore[reportPrivateUsage]


@pytest.mark.parametrize(
    ("one", "gain", "alone"), [(DELIVERY, 49.0, True), (DELIVERY, 51.0, False), (OFFSET, 51.0, True)]
)
def test_a_worn_pump_does_not_suffice_by_itself_if_another_volume_would_gain_much(
    one: Any, gain: float, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explain, "is_explained", lambda *_: True)
    monkeypatch.setattr(explain, "predicted_gain_beside", lambda *_: PredictedGain(gain, 1.0, 1.0))
    assert explain._explains_by_itself(LONG, tried(9.0, together=(one,)), lambda _: True) is alone  # pyright: ignore[reportPrivateUsage]
