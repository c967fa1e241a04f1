"""Searches with two structures of friction take turns, and end if one explains the log or if none can."""

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.motion import search as motion_search
from estimation.fits.motion.fit import unseen_shift
from estimation.fits.motion.search import (
    FINALISTS,
    FOREIGN,
    HOPELESS,
    MOST_WORK,
    SLIGHT_SHARE,
    WAYS,
    MotionSearch,
    SharedState,
    explained_cost,
    search_results,
)
from tests.estimation.fits.motion.test_fit import searches_of, seen, short_log

SHORT, PART = 100, 400
Misfit = Callable[[float], float]


class Search:
    """A search with starts at 0, 1, 2, ..., `WAYS` for each rank, and with descents that end where they begin."""

    def __init__(self, misfit: Misfit, name: str, asked: list[str], steps: int = 1) -> None:
        self._steps = steps
        self.guesses, self.bounds = [np.zeros(1)], (np.full(1, -9.0), np.full(1, 99.0))
        self.near = self.bounds
        self.short, self.part = (self._problem(misfit, samples) for samples in (SHORT, PART))
        self._name, self._asked = name, asked

    def _problem(self, misfit: Misfit, samples: int) -> SimpleNamespace:
        def at(theta: np.ndarray) -> Point:
            return Point(theta, 0.5 * samples * misfit(float(theta[0])), np.zeros(1), np.eye(1))

        log = SimpleNamespace(measured=np.zeros((samples, 1)), steps=[self._steps], with_larger_noise=lambda *_: None)
        return SimpleNamespace(at=at, log=log, on=lambda _: SimpleNamespace(at=at, log=log))

    def is_same_basin(self, one: Point, other: Point) -> bool:
        return bool(one.theta[0] == other.theta[0])

    def ends_of_approach(self, rank: int, begun: SharedState, worth: Callable[[], bool]) -> Iterator[np.ndarray]:
        assert isinstance(begun, SharedState)
        self._asked.append(f"{self._name}{rank}")
        for way in range(len(WAYS)):
            if rank + way > 0 and not worth():
                return
            yield np.array([float(len(WAYS) * rank + way)])


def ended(*misfits: Misfit, steps: int = 1) -> tuple[list[motion_search.SearchResult], list[str]]:
    asked: list[str] = []
    searches = [Search(misfit, name, asked, steps) for misfit, name in zip(misfits, "ab", strict=True)]
    return search_results(cast("list[MotionSearch]", searches)), asked


def test_the_second_structure_is_tried_before_the_less_likely_starts_of_the_first() -> None:
    (first, second), asked = ended(lambda _: 2.0, lambda at: 1.0 if at == 1.0 else 2.0)
    assert asked == ["a0", "b0"]
    assert not first.explains
    assert second.explains
    assert second.point.theta[0] == 1.0
    assert second.point.cost < 0.5 * 1.1 * PART


def test_less_likely_starts_are_tried_if_the_misfit_is_not_hopeless() -> None:
    found, asked = ended(lambda _: 2.0, lambda at: 1.0 if at == 7.0 else 2.0)
    assert asked == ["a0", "b0", "a1", "b1", "a2", "b2"]
    assert [one.explains for one in found] == [False, True]


def test_a_log_far_from_both_is_given_up_after_the_likeliest_starts() -> None:
    far = 1.2 * HOPELESS
    found, asked = ended(lambda at: far + at, lambda at: far + (at - 2.0) ** 2)
    assert asked == ["a0", "b0"]
    assert [float(one.point.theta[0]) for one in found] == [0.0, 2.0]
    assert not any(one.explains for one in found)


def test_every_start_is_tried_before_a_log_that_is_nearly_explained_is_given_up() -> None:
    found, asked = ended(lambda _: 1.2, lambda _: 1.3)
    assert len(asked) == 2 * FINALISTS
    assert not any(one.explains for one in found)


def test_no_other_start_is_tried_once_the_work_limit_is_reached() -> None:
    for steps, ranks in ((1, FINALISTS), (MOST_WORK, 1)):
        found, asked = ended(lambda _: 1.2, lambda _: 1.3, steps=steps)
        assert len(asked) == 2 * ranks
        assert not any(one.explains for one in found)


@pytest.mark.parametrize(("share", "first", "later"), [(0.1, 3, 3), (0.3, 2, 2), (0.6, 1, 1)])
def test_a_structure_that_explains_no_beginning_leaves_work_to_the_other(share: float, first: int, later: int) -> None:
    tried: list[str] = []

    def noted(name: str) -> Misfit:
        def misfit(at: float) -> float:
            tried.append(f"{name}{at:g}")
            return 1.2 * HOPELESS

        return misfit

    ended(noted("a"), noted("b"), steps=int(share * MOST_WORK) // 2)  # two evaluations for each start
    assert len({one for one in tried if one[0] == "a"}) == first
    assert len({one for one in tried if one[0] == "b"}) == later


def test_a_structure_that_explains_the_beginning_goes_on_while_any_work_is_left() -> None:
    tried: list[float] = []

    def first(at: float) -> float:
        tried.append(at)
        return 1.0 if len(tried) < 4 else 9.0  # it explains only the beginning

    ended(first, lambda _: 9.0, steps=MOST_WORK // 4)  # three quarters are spent on the first start
    assert set(tried) == {0.0, 1.0}


def test_at_the_work_limit_the_best_search_continues_only_while_its_steps_gain_a_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shares: list[float] = []
    descended = motion_search.descend

    def noted(*given: Any, least_share: float = 0.0, **named: Any) -> Point:
        shares.append(least_share)
        return descended(*given, least_share=least_share, **named)

    monkeypatch.setattr(motion_search, "descend", noted)
    for steps, share in ((1, 0.0), (MOST_WORK, SLIGHT_SHARE)):
        shares.clear()
        ended(lambda _: 1.2, lambda _: 1.3, steps=steps)
        assert shares.count(share) == (len(shares) if share == 0.0 else 1)


def test_an_annealed_point_that_explains_the_beginning_is_searched_on_the_longer_part(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(motion_search, "annealed", lambda problem, *_: problem.at(np.array([7.5])))
    (first, second), _ = ended(lambda at: 1.0 if at == 7.5 else 2.0, lambda _: 2.5)
    assert (first.explains, second.explains) == (True, False)
    assert first.point.theta[0] == 7.5
    assert first.point.cost == 0.5 * PART


@pytest.mark.parametrize(("factor", "left"), [(0.9, True), (1.1, False)])
def test_a_result_is_not_annealed_if_the_misfit_of_the_longer_part_is_too_large(
    monkeypatch: pytest.MonkeyPatch, factor: float, left: bool
) -> None:
    def of_part(problem: SimpleNamespace) -> float:
        here = explained_cost(cast("motion_search.FreedProblem", problem))
        return here * 2.0 / (1.1 * factor * FOREIGN) if len(problem.log.measured) == PART else here

    ends: list[Point] = []
    monkeypatch.setattr(motion_search, "explained_cost", of_part)
    monkeypatch.setattr(motion_search, "annealed", lambda _, point, *__: ends.append(point) or point)
    ended(lambda _: 2.0, lambda _: 2.5)
    assert bool(ends) is left


def test_a_result_that_explains_only_the_first_seconds_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    def longer(problem: SimpleNamespace) -> float:
        return explained_cost(cast("motion_search.FreedProblem", problem)) * (
            0.5 if len(problem.log.measured) == PART else 1.0
        )

    monkeypatch.setattr(motion_search, "explained_cost", longer)
    found, _ = ended(lambda _: 1.0, lambda _: 1.0)
    assert not any(one.explains for one in found)


def test_the_allowance_for_an_undetected_misfit_grows_with_the_residuals() -> None:
    assert unseen_shift(0.9, 20_000) == pytest.approx((1.0 + 200.0) ** 0.5)
    assert unseen_shift(1.05, 20_000) == pytest.approx((1.0 + 200.0 + 1000.0) ** 0.5)


def test_only_the_likeliest_start_is_tried_once_the_work_limit_is_reached() -> None:
    search, begun = searches_of(seen(short_log(0.2)))[0], SharedState()
    assert len(list(search.ends_of_approach(0, begun, lambda: False))) == 1
    assert set(begun.screened) == {0}
    assert list(search.ends_of_approach(1, begun, lambda: False)) == []
