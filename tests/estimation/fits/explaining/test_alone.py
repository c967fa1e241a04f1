"""What is tried by itself, and in pairs, where little is left of a long log, or much."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.explaining import explain
from estimation.fits.explaining.promises import Promise
from estimation.fits.explaining.thinned import FEW, Spared
from estimation.fits.explaining.tried import Tried
from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import DELIVERY, OFFSET, Hypothesis

LONG: Any = SimpleNamespace(drives=np.zeros((FEW, 1)))


def hypothesis(name: str, *, far: bool = False) -> Hypothesis:
    return Hypothesis(name, ("anything",), far=far)


def tried(cost: float, place: float = 0.0, together: Any = ()) -> Tried:
    return Tried(together, Point(np.full(1, place), cost, np.zeros(1), np.eye(1)), {}, {}, {})


LIKELY, FAR, SOME, NONE = hypothesis("likely"), hypothesis("far", far=True), hypothesis("some"), hypothesis("none")


@pytest.fixture(autouse=True)
def reached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(explain, "within_reach", lambda _, __, asked: asked)


@pytest.mark.parametrize(("every", "asked"), [(1, "far some"), (2, "far some none")])
def test_what_promises_too_little_is_not_tried_where_little_is_left(
    every: int, asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, list[Any]]] = []

    def nearing(_: Any, given: Any, starts: Any, *__: Any) -> Any:
        told.append((" ".join(one.name for one in given), starts))
        return [[tried(900.0)]]

    ends = {"a": tried(800.0), "the same": tried(800.0, 0.1), "elsewhere": tried(9e3, 3.0)}
    monkeypatch.setattr(explain, "screened", lambda _, __, starts, **___: [ends[one] for one in starts])
    monkeypatch.setattr(explain, "nearing", nearing)
    monkeypatch.setattr(explain, "settled_each", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "led_on", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "likeliest", lambda *_, **__: [])
    monkeypatch.setattr(explain, "left_by", lambda *_: 1.5)
    starts: Any = [*ends]
    # 120 are needed of 1000 to come as low as what is known
    gains = {"far": 0.0, "some": 121.0 / explain.TRUSTED, "none": 119.0 / explain.TRUSTED}
    spared = Spared(every, 1.5, starts)
    explain._alone(LONG, 1000.0, ([LIKELY], [FAR, SOME, NONE], gains), spared, lambda _: False)  # pyright: ignore[reportPrivateUsage]
    assert told == [(asked, ["a"] if every == 1 else [*ends])]


@pytest.mark.parametrize(("likely", "other", "order"), [(500.0, 50.0, [50.0, 500.0]), (50.0, 500.0, [50.0, 500.0])])
def test_what_leaves_less_on_few_samples_is_led_on_first(
    likely: float, other: float, order: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    ends, led = [tried(likely), tried(other)], list[tuple[float, float]]()

    def led_on(_: Any, ended: Any, known: float = np.inf, *__: Any, **___: Any) -> Any:
        led.append((ended[0].cost, known))
        return [tried(0.9 * ended[0].cost)]

    monkeypatch.setattr(explain, "screened", lambda *_, **__: [tried(900.0)])
    monkeypatch.setattr(explain, "nearing", lambda *_, **__: [])
    monkeypatch.setattr(explain, "settled_each", lambda *_, **__: [ends.pop(0)])
    monkeypatch.setattr(explain, "led_on", led_on)
    monkeypatch.setattr(explain, "left_by", lambda _, cost: cost / 10.0)
    found = explain._alone(LONG, 900.0, ([LIKELY], [FAR], {}), Spared(4, 90.0, [{}]), lambda _: False)  # pyright: ignore[reportPrivateUsage]
    assert led == [(order[0], np.inf), (order[1], 0.9 * order[0])]
    assert [one.cost for one in found] == [0.9 * cost for cost in order]


def test_beside_what_leaves_little_no_pair_is_tried_that_cannot_explain_the_log(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def screened(_: Any, together: Any, *__: Any, **___: Any) -> Any:
        asked.append(together[-1].name)
        return [tried(990.0 if together[-1] is LIKELY else 9e3, together=together)] * 2

    # the first leaves 1.8 times the noise of 1000, a pair that explains it at most 1.5
    gains = {"some": 301.0 / explain.TRUSTED, "none": 299.0 / explain.TRUSTED}
    monkeypatch.setattr(explain, "delayed", lambda log, _: log)
    monkeypatch.setattr(explain, "promising", lambda *_: ([LIKELY], [FAR, SOME, NONE], gains))
    monkeypatch.setattr(explain, "own_starts", lambda *_: [{}])
    monkeypatch.setattr(explain, "_begun_again", lambda *_: {})
    monkeypatch.setattr(explain, "skipping", lambda *_: 1)
    monkeypatch.setattr(explain, "left_by", lambda _, cost: cost / 1000.0)
    monkeypatch.setattr(explain, "screened", screened)
    monkeypatch.setattr(explain, "likeliest", lambda *given, **_: [*map(list, given[1])] and [])
    first = tried(1800.0, together=(hypothesis("first"),))
    explain._paired(LONG, first, {}, lambda _: False)  # pyright: ignore[reportPrivateUsage]
    assert asked == ["likely", "far", "some"]


@pytest.mark.parametrize(("left", "asked"), [(1.1, ["far"]), (1.04, [])])
def test_where_a_cause_explains_a_log_but_leaves_more_than_noise_what_slopes_do_not_see_is_tried_too(
    left: float, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []

    def nearing(_: Any, given: Any, *__: Any) -> Any:
        told.extend(one.name for one in given)
        return [[tried(700.0)]]

    monkeypatch.setattr(explain, "screened", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "nearing", nearing)
    monkeypatch.setattr(explain, "settled_each", lambda *_, **__: [tried(800.0)])
    monkeypatch.setattr(explain, "led_on", lambda *_, **__: [replace(tried(800.0), fits=(LONG,))])
    monkeypatch.setattr(explain, "likeliest", lambda *_, **__: [tried(700.0)])
    monkeypatch.setattr(explain, "left_by", lambda *_: left)
    gains = {"far": 0.0, "some": 900.0}
    found = explain._alone(LONG, 1000.0, ([LIKELY], [FAR, SOME], gains), Spared(1, left, [{}]), lambda _: True)  # pyright: ignore[reportPrivateUsage]
    assert told == asked
    assert [one.cost for one in found] == ([700.0, 800.0] if asked else [800.0])


@pytest.mark.parametrize(("rival", "asked"), [(False, ["far"]), (True, [])])
def test_beside_a_rival_nothing_is_tried_that_is_out_of_reach(
    rival: bool, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[str] = []
    monkeypatch.setattr(explain, "within_reach", lambda _, __, asked: [one for one in asked if one.far][:1])
    monkeypatch.setattr(explain, "delayed", lambda log, _: log)
    monkeypatch.setattr(explain, "promising", lambda *_: ([], [FAR], {}))
    monkeypatch.setattr(explain, "own_starts", lambda *_: [{}])
    monkeypatch.setattr(explain, "_begun_again", lambda *_: {})
    monkeypatch.setattr(explain, "skipping", lambda *_: 1)
    monkeypatch.setattr(explain, "left_by", lambda _, cost: cost / 1000.0)

    def screened(_: Any, together: Any, *__: Any, **___: Any) -> Any:
        given.append(together[-1].name)
        return [tried(9e3, together=together)]

    monkeypatch.setattr(explain, "screened", screened)
    first = tried(1800.0, together=(hypothesis("first"),))
    assert not explain._paired(LONG, first, {}, lambda _: False, rival=rival)  # pyright: ignore[reportPrivateUsage]
    assert given == asked


def test_a_speed_that_is_late_and_one_that_is_early_are_one_where_they_came_to_one_place() -> None:
    late, early = (Hypothesis(name, ("speed_lag",)) for name in ("speed_late", "speed_early"))
    one = tried(800.0, together=(late,))
    again = replace(tried(800.0, 0.1, together=(early,)), delays={"motor_speed_rad_s": 0.0})
    assert explain._same(one, again)  # pyright: ignore[reportPrivateUsage]
    assert not explain._same(one, replace(again, delays={"motor_speed_rad_s": -1e-3}))  # pyright: ignore[reportPrivateUsage]
    assert not explain._same(one, replace(again, together=(OFFSET,)))  # pyright: ignore[reportPrivateUsage]


@pytest.mark.parametrize(
    ("one", "gain", "alone"), [(DELIVERY, 49.0, True), (DELIVERY, 51.0, False), (OFFSET, 51.0, True)]
)
def test_a_pump_that_delivers_less_beside_another_volume_may_be_a_wrong_area(
    one: Any, gain: float, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(explain, "_explained", lambda *_: True)
    monkeypatch.setattr(explain, "promised_beside", lambda *_: Promise(gain, 1.0, 1.0))
    assert explain._by_itself(LONG, tried(9.0, together=(one,)), lambda _: True) is alone  # pyright: ignore[reportPrivateUsage]
