"""Decimated logs, on which hypotheses are compared."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search import final_fits, ranking
from estimation.fits.hypothesis_search.coarse_search import coarse_log
from estimation.fits.hypothesis_search.decimation import (
    SHORT_LOG,
    Decimation,
    cost_over_noise,
    decimated,
    decimation_for,
)
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.wide_log import usual_values, widened_log
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem
from tests.estimation.fits.short_logs import PAPER, log


def seen() -> GreyBoxLog:
    """Return a log of 3 s for the wide form."""
    record, variances = without_strays(log(3.0))
    return widened_log(flow_log(record, PAPER, {}, variances), PAPER)


@pytest.mark.parametrize("every", [2, 4])
def test_decimation_keeps_the_pumped_and_swept_volumes(every: int) -> None:
    whole = seen()
    few = decimated(whole, every)
    assert few.sample_time == pytest.approx(every * whole.sample_time)
    last = (len(few.drives) - 1) * every
    assert few.drives[-1, 1] == whole.drives[last, 1]
    pumped = np.trapezoid(few.drives[:, 0], dx=every)
    assert pumped == pytest.approx(
        np.trapezoid(whole.drives[: last + 1, 0]), abs=2.0 * every * np.ptp(whole.drives[:, 0])
    )
    ramp = replace(whole, drives=np.linspace(0.0, 1.0, len(whole.drives))[:, None] * np.ones(whole.drives.shape[1]))
    inside = slice(1, -1)
    assert decimated(ramp, every).drives[inside, 0] == pytest.approx(ramp.drives[::every, 0][inside])


@pytest.mark.parametrize(("apart", "first", "every"), [(5, 3, 5), (6, 1, 6), (10, 0, 5), (3, 2, 3)])
def test_each_sample_of_a_slower_pressure_channel_counts_once(apart: int, first: int, every: int) -> None:
    """Of a pressure that was read in every sixth sample, no sample was left, or each counted four times."""
    whole = seen()
    held = np.full_like(whole.measured, np.nan)
    held[first::apart] = whole.measured[first::apart]
    few = decimated(replace(whole, measured=held), 4)
    assert few.sample_time == pytest.approx(every * whole.sample_time)
    there = np.isfinite(few.measured[:, 0])
    assert np.array_equal(few.measured[there], held[np.isfinite(held[:, 0])])
    assert few.stands_for == 1.0
    assert few.drives[0, 1] == whole.drives[first % every, 1]


def test_a_log_with_unevenly_spaced_pressure_is_not_decimated() -> None:
    whole = seen()
    uneven = np.full_like(whole.measured, np.nan)
    rows = np.cumsum(np.random.default_rng(2).integers(3, 8, 400))
    uneven[rows] = whole.measured[rows]
    assert len(decimated(replace(whole, measured=uneven), 4).drives) == len(whole.drives)


@pytest.mark.parametrize("every", [2, 4])
def test_decimation_keeps_the_variance_of_gaps_in_speed(every: int) -> None:
    whole = replace(seen(), gaps=np.array([[9.0, 20.0, 1e9], [401.0, 401.0, 2e9]]))
    first, last, variance = decimated(whole, every).gaps.T
    assert first.tolist() == [9 // every, 401 // every]
    assert last.tolist() == [20 // every, 401 // every]
    assert variance * (last - first + 1.0) == pytest.approx([12e9, 2e9])


def test_decimation_keeps_the_cost_if_residuals_far_exceed_noise() -> None:
    whole = seen()
    costs = []
    for every in (1, 2, 4):
        problem = hypothesis_problem(coarse_log(whole, {}, (), every), ())
        theta = problem.model.theta({**usual_values(whole), **flow_starts(PAPER, 1.2e8)[0]})
        costs.append(problem.at(theta).cost)
        assert problem.costs([theta])[0] == pytest.approx(costs[-1])
    assert costs[1:] == pytest.approx([costs[0]] * 2, rel=0.1)
    assert cost_over_noise(whole, costs[0]) > 10.0


def test_a_long_log_is_decimated_more_the_larger_its_residuals() -> None:
    long: Any = replace(seen(), drives=np.zeros((SHORT_LOG, 1)))
    assert [decimation_for(long, left) for left in (1.5, 5.0, 50.0)] == [1, 2, 4]
    assert decimation_for(replace(long, sample_time=2e-4), 50.0) == 20
    assert decimation_for(replace(long, sample_time=1e-2), 50.0) == 1
    assert decimation_for(replace(long, drives=long.drives[1:]), 50.0) == 1


def test_the_best_set_on_a_decimated_log_is_searched_again_with_all_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    place = Point(np.zeros(1), 90.0, np.zeros(1), np.eye(1))
    tried = Trial((), place, flow_starts(PAPER, 2e8)[0], {}, {})
    begun = replace(tried, point=replace(place, cost=80.0))
    led: list[float] = []

    def settled(_: Any, one: Trial, *__: Any) -> Trial:
        led.append(one.cost)
        return replace(one, point=replace(one.point, cost=5.0 if one is begun else one.cost))

    problem = hypothesis_problem(coarse_log(seen(), {}, ()), ())
    monkeypatch.setattr(ranking, "search_coarsely", settled)
    monkeypatch.setattr(ranking, "screen", lambda *_: [begun])
    monkeypatch.setattr(ranking, "hypothesis_problem", lambda *_: problem)
    monkeypatch.setattr(ranking, "cost_over_noise", lambda _, cost: cost)
    spared = Decimation(4, 1000.0, ())
    (found,) = ranking._searched_on_all_samples(seen(), [tried], np.inf, spared)  # pyright: ignore[reportPrivateUsage]
    assert (found.cost, led) == (5.0, [90.0, 80.0])
    led.clear()
    (kept,) = ranking._searched_on_all_samples(seen(), [tried], np.inf, spared._replace(left=100.0))  # pyright: ignore[reportPrivateUsage]
    assert (kept.cost, led) == (90.0, [])


@pytest.mark.parametrize(("ended", "anew"), [(1.12, False), (1.3, True)])
def test_a_set_with_larger_residuals_on_all_samples_is_searched_again(
    monkeypatch: pytest.MonkeyPatch, ended: float, anew: bool
) -> None:
    tried = Trial((), Point(np.zeros(1), 1.1, np.zeros(1), np.eye(1)), flow_starts(PAPER, 2e8)[0], {}, {})
    problem = hypothesis_problem(coarse_log(seen(), {}, ()), ())
    asked: list[Any] = []
    monkeypatch.setattr(
        ranking, "search_coarsely", lambda _, one, *__: replace(one, point=replace(one.point, cost=ended))
    )
    monkeypatch.setattr(ranking, "screen", lambda *_: asked.append(1) or [])
    monkeypatch.setattr(ranking, "hypothesis_problem", lambda *_: problem)
    monkeypatch.setattr(ranking, "cost_over_noise", lambda _, cost: cost)
    (found,) = ranking._searched_on_all_samples(seen(), [tried], np.inf, Decimation(4, 1000.0, ()))  # pyright: ignore[reportPrivateUsage]
    assert (found.cost, bool(asked)) == (ended, anew)  # no start leads elsewhere


def test_a_set_with_far_too_large_residuals_is_not_fitted_to_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    finished: list[float] = []
    monkeypatch.setattr(ranking, "search_coarsely", lambda _, one, *__: one)
    monkeypatch.setattr(final_fits, "SHORT_LOG", 0)
    monkeypatch.setattr(ranking, "final_fit", lambda _, one, __: finished.append(one.cost) or one)
    monkeypatch.setattr(final_fits, "cost_over_noise", lambda _, cost: cost)
    for cost in (9.0, 11.0):
        tried = Trial((), Point(np.zeros(1), cost, np.zeros(1), np.eye(1)), {}, {}, {})
        ranking.likeliest_sets(seen(), [[tried]])
    assert finished == [9.0]
