"""A short log is not refused for residuals that noise alone explains."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.chance import correlation_by_chance, largest_chi_square
from estimation.fits.greybox.fit import Asked, explains_log, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.hypothesis_search.fit_objections import fit_explains, fit_explains_all
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.flow import FLOW_FORM
from plant.log.record import Record
from tests.estimation.fits.short_logs import PRESSURE, log, made_fit, problem, seen, usual

ROWS = 400


def test_few_short_logs_of_pure_noise_exceed_the_limits_of_the_gate() -> None:
    """Without wider limits, one in a hundred left more than 1.2, and one in twenty had correlated residuals."""
    rng = np.random.default_rng(0)
    left, alike = [], []
    for noise in rng.normal(size=(3000, ROWS)):
        variance = measurement_variances(Record(1e-3, {PRESSURE: 1e4 * noise}), [PRESSURE])[PRESSURE]
        left.append(1e8 * np.mean(noise**2) / variance)
        alike.append(abs(np.sum(noise[1:] * noise[:-1]) / np.sum(noise**2)))
    assert np.sum(np.array(left) > 1.2) > 25
    assert np.sum(np.array(left) > largest_chi_square(ROWS)) < 20
    assert np.sum(np.array(alike) > 0.1) > 80
    assert np.sum(np.array(alike) > correlation_by_chance(ROWS)) < 10


@pytest.mark.parametrize(("chi", "correlated"), [(1.22, 0.0), (1.0, 0.14), (1.0, -0.14)])
def test_the_fit_of_a_short_log_may_have_larger_residuals_than_that_of_a_long_one(
    chi: float, correlated: float
) -> None:
    fit = made_fit(100.0, 2e8, 1e5, chi=chi, correlated=correlated)
    for rows, explains in ((ROWS, True), (20_000, False)):
        assert fit_explains(replace(fit, seen=float(rows)), noisy=False) == explains
        assert fit_explains_all(replace(fit, seen=float(rows)), noisy=False) == explains


@pytest.mark.parametrize(("chi", "correlated"), [(1.28, 0.0), (1.0, 0.2), (1.0, -0.2)])
def test_a_fit_of_a_short_log_that_leaves_more_than_chance_is_refused(chi: float, correlated: float) -> None:
    fit = replace(made_fit(100.0, 2e8, 1e5, chi=chi, correlated=correlated), seen=float(ROWS))
    assert not fit_explains(fit, noisy=False)


def test_a_search_in_a_short_log_ends_once_its_residuals_are_within_chance() -> None:
    one = problem()
    point = one.at(usual(one))
    for share, ends in ((0.99, True), (1.01, False)):
        cost = 0.5 * share * largest_chi_square(one.blocks) * one.blocks
        assert explains_log(one, replace(point, cost=cost)) == ends
    assert largest_chi_square(one.blocks) > 1.2


def test_a_fit_counts_only_the_residuals_of_logged_samples() -> None:
    record = log(0.5)
    pressure = record[PRESSURE].copy()
    pressure[::4] = np.nan
    one = FreedProblem.of(FLOW_FORM, seen(record.replace(**{PRESSURE: pressure})))
    fit = fit_at_solution(one, one.at(usual(one)), asked=Asked(disturbed=False))
    assert fit.seen == np.count_nonzero(np.isfinite(pressure))
