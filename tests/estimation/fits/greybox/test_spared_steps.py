"""Short model steps only where they matter lead a search to the same end as short steps throughout."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow import search
from estimation.fits.flow.search import balance_fits
from estimation.fits.greybox.descent import LEAST_GAIN
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.spared_steps import steps_where_needed, with_steps
from plant.arrays import Array
from tests.estimation.fits.flow.test_search import HEALTHY, STARTS, recorded, seen


@pytest.fixture(scope="module")
def log() -> GreyBoxLog:
    return seen(recorded("major_leakage"))


@pytest.fixture
def steps_taken(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Record the model steps of each side-by-side run that has short ones."""
    taken: list[int] = []
    run = FreedProblem._side_by_side  # pyright: ignore[reportPrivateUsage]

    def counted(problem: FreedProblem, rows: Array, drives: Array, variance: Array) -> Array:
        taken.append(int(np.sum(problem.log.steps)) if np.max(problem.log.steps) > 1 else 0)
        return run(problem, rows, drives, variance)

    monkeypatch.setattr(FreedProblem, "_side_by_side", counted)
    return taken


def test_short_steps_at_few_samples_suffice_for_the_misfit(log: GreyBoxLog) -> None:
    best = min(balance_fits(log, HEALTHY, STARTS), key=lambda fit: fit.cost)
    problem = FreedProblem.of(best.model, log)
    steps = steps_where_needed(problem, best.theta)
    assert 0.0 < np.mean(steps > 1) < 0.3
    assert np.all((steps == 1) | (steps == log.steps))
    here, spared, long = (with_steps(problem, each).at(best.theta) for each in (log.steps, steps, np.ones_like(steps)))
    curvature = here.gram + 1e-6 * np.eye(len(best.theta))

    def moved(other: Array) -> float:
        change = other - here.gradient
        return 0.5 * float(change @ np.linalg.solve(curvature, change))

    assert moved(spared.gradient) < LEAST_GAIN < moved(long.gradient)


def test_a_search_with_fewer_steps_reaches_the_fit_of_one_with_all_short_steps(
    log: GreyBoxLog, steps_taken: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = balance_fits(log, HEALTHY, STARTS)
    fewer = sum(steps_taken)
    steps_taken.clear()
    monkeypatch.setattr(search, "steps_where_needed", lambda problem, _: problem.log.steps)
    whole = balance_fits(log, HEALTHY, STARTS)
    assert fewer < 0.75 * sum(steps_taken)
    told, other = (min(fits, key=lambda fit: fit.cost) for fits in (quick, whole))
    assert told.cost == pytest.approx(other.cost, abs=2.0 * LEAST_GAIN)
    std = other.std["bulk_modulus"]
    assert told.values["bulk_modulus"] == pytest.approx(other.values["bulk_modulus"], abs=0.05 * std)
    assert told.std["bulk_modulus"] == pytest.approx(std, rel=0.01)


def test_no_steps_are_spared_across_gaps_or_with_one_step_per_sample(log: GreyBoxLog) -> None:
    fit = balance_fits(log, HEALTHY, STARTS)[0]
    for other in (log.coarsened(), replace(log, gaps=np.array([[10.0, 12.0, 1e6]]))):
        problem = FreedProblem.of(fit.model, other)
        assert steps_where_needed(problem, fit.theta) is other.steps
        assert with_steps(problem, other.steps) is problem
