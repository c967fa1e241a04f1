"""A search that ended in one of several minima along the scale of forces also tries the others."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion import force_scale
from estimation.fits.motion.force_scale import Way, disagree, optimum_on_other_scales
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS

MODEL = replace(MOTION_FORMS[0], unknowns=UNKNOWNS, linear=tuple(LINEAR.items()))
HERE = MODEL.theta({name: 2e8 if name == "bulk_modulus" else 1.0 for name in UNKNOWNS})
FAR = np.full(len(UNKNOWNS), 40.0)


def problem_of(at_each: Callable[[list[np.ndarray]], list[Point]], duration: float = 20.0) -> FreedProblem:
    """Return the problem of a log at 1 kHz with a given misfit and duration [s]."""
    log = SimpleNamespace(measured=np.zeros(round(1e3 * duration)), sample_time=1e-3)
    return cast("FreedProblem", SimpleNamespace(model=MODEL, at_each=at_each, log=log))


def searched(
    at: Callable[[np.ndarray], Point], explained: float = np.inf, duration: float = 20.0
) -> tuple[Point, list[float], list[Point]]:
    """Return a misfit's best optimum from the point `HERE`, the bulk moduli of the others, and the points evaluated."""
    seen: list[Point] = []

    def at_each(thetas: list[np.ndarray]) -> list[Point]:
        seen.extend(points := [at(theta) for theta in thetas])
        return points

    problem = problem_of(at_each, duration)
    return *optimum_on_other_scales(problem, at(HERE), Way(problem, 12, 0.01, 25, 0.1, (-FAR, FAR), explained)), seen


def valleys(scale: float, lower: float) -> Callable[[np.ndarray], Point]:
    """Return a misfit with a minimum at bulk modulus here and one on another scale, which is lower by ``lower``."""
    second = np.log(scale)

    def at(theta: np.ndarray) -> Point:
        off, tilt = theta[0] - HERE[0], np.sqrt(2.0 * lower) / abs(second)
        errors = np.array([200.0 * off * (off - second), tilt * (off - second)])
        slopes = np.zeros((2, len(theta)))
        slopes[:, 0] = 200.0 * (2.0 * off - second), tilt
        return Point(theta, 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)

    return at


def flat(cost: Callable[[np.ndarray], float]) -> Callable[[np.ndarray], Point]:
    """Return a misfit whose slopes are zero, so that each search stays where it begins."""
    return lambda theta: Point(theta, cost(theta), np.zeros(len(theta)), np.zeros((len(theta), len(theta))))


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_a_lower_optimum_on_another_scale_replaces_the_best(scale: float) -> None:
    best, others, _ = searched(valleys(scale, lower=7.0))
    assert best.theta[0] - HERE[0] == pytest.approx(np.log(scale), abs=1e-3)
    assert any(other == pytest.approx(2e8, rel=1e-2) for other in others)


@pytest.mark.parametrize("scale", [0.7, 1.4])
def test_an_equally_good_optimum_on_another_scale_is_reported(scale: float) -> None:
    best, others, _ = searched(valleys(scale, lower=1.0))
    found = [MODEL.values(best.theta)["bulk_modulus"], *others]
    for there in (2e8, 2e8 * scale):
        assert any(one == pytest.approx(there, rel=1e-2) for one in found)


def test_an_optimum_that_does_not_explain_the_log_is_not_reported() -> None:
    worse = valleys(1.4, lower=1.0)
    _, others, _ = searched(lambda theta: replace(worse(theta), cost=worse(theta).cost + 100.0), explained=100.0)
    assert others == []


@pytest.mark.parametrize("scale", [0.95, 1.05])
def test_a_lower_minimum_a_few_percent_away_is_found(scale: float) -> None:
    best, _, _ = searched(valleys(scale, lower=7.0))
    assert best.theta[0] - HERE[0] == pytest.approx(np.log(scale), abs=1e-3)


def test_another_scale_raises_all_forces_and_lowers_all_conductances_in_proportion() -> None:
    _, _, seen = searched(flat(lambda theta: float(theta[0] != HERE[0])), explained=0.5)
    before, fixed = MODEL.values(HERE), ("flow_bias", "speed_lead")
    falls = ("leakage_coefficient", "makeup_conductance", "case_leakage")
    changes = [{name: MODEL.values(point.theta)[name] / before[name] for name in UNKNOWNS} for point in seen]
    for factor, changed in zip((0.8, 1.25), changes[:2], strict=True):
        expected = {name: 1.0 if name in fixed else 1.0 / factor if name in falls else factor for name in UNKNOWNS}
        assert changed == pytest.approx(expected)
    for factor, changed in zip((0.93, 1.07), changes[-2:], strict=True):
        assert changed == pytest.approx({name: factor if name == "bulk_modulus" else 1.0 for name in UNKNOWNS})


def test_another_bulk_modulus_alone_is_not_tried_if_force_scales_disagree() -> None:
    _, _, seen = searched(flat(lambda _: 0.0))
    moduli = {round(MODEL.values(point.theta)["bulk_modulus"] / 2e8, 6) for point in seen}
    assert moduli == {0.8, 1.25}


def test_the_search_along_an_endless_valley_ends_after_three_rounds() -> None:
    best, _, _ = searched(flat(lambda theta: 100.0 * theta[0]), explained=-np.inf)
    assert best.theta[0] - HERE[0] == pytest.approx(3.0 * np.log(0.8))


@pytest.mark.parametrize(
    ("moved", "duration", "rounds"), [(0.04, 20.0, 1), (0.07, 20.0, 3), (0.04, 4.1, 1), (0.04, 4.0, 3), (0.004, 4.0, 1)]
)
def test_further_rounds_need_a_distinct_optimum_which_may_be_nearer_in_short_logs(
    moved: float, duration: float, rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(force_scale, "SCALES", ())
    monkeypatch.setattr(force_scale, "STIFFNESS_SCALES", (1.0 - moved,))
    best, _, _ = searched(flat(lambda theta: 2000.0 * theta[0]), explained=-np.inf, duration=duration)
    assert best.theta[0] - HERE[0] == pytest.approx(rounds * np.log(1.0 - moved))


def test_optima_that_disagree_end_the_search() -> None:
    best, others, _ = searched(flat(lambda theta: 100.0 * theta[0]))
    assert best.theta[0] - HERE[0] == pytest.approx(np.log(0.8))
    assert disagree([2e8, *others])


def test_moduli_disagree_if_they_differ_by_more_than_a_twentieth() -> None:
    assert not disagree([2.0e8, 2.099e8])
    assert disagree([2.0e8, 1.95e8, 2.101e8])


def test_an_optimum_that_is_hardly_better_ends_the_search_where_it_is() -> None:
    best, _, _ = searched(flat(lambda theta: 10.0 * theta[0]), explained=-np.inf)  # 2.2 lower a round; 5 are required
    assert best.theta[0] - HERE[0] == pytest.approx(np.log(0.8))


def test_a_search_that_ends_close_by_is_continued_before_it_counts_as_disagreeing() -> None:
    """Steps are a quarter of what they should be, so the first descent ends seven to nine percent away."""

    def slow(theta: np.ndarray) -> Point:
        off, slopes = theta[0] - HERE[0], np.zeros((1, len(theta)))
        slopes[0, 0] = 10.0
        return Point(theta, 50.0 * off**2, 10.0 * slopes[0] * off, 4.0 * slopes.T @ slopes)

    def each(at: Callable[[np.ndarray], Point]) -> FreedProblem:
        return problem_of(lambda thetas: [at(one) for one in thetas])

    way = Way(each(flat(lambda _: 0.0)), 12, 0.01, 25, 0.1, (-FAR, FAR), np.inf)
    _, others = optimum_on_other_scales(each(slow), slow(HERE), way)
    assert len(others) == 4
    assert not disagree([2e8, *others])
