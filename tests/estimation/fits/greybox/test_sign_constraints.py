"""An unknown that cannot be negative does not widen an interval as if it could."""

from math import inf

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.sign_constraints import not_negative, square_about
from tests.estimation.fits.short_logs import PAPER, SPEED, log

SPREAD = np.array([[4.0, 1.2], [1.2, 1.0]])


@pytest.mark.parametrize(("low", "point"), [(-1.0, 0.0), (1.0, 1.0), (-0.5, 0.7)])
def test_the_mean_square_of_a_truncated_normal_is_that_of_draws(low: float, point: float) -> None:
    drawn = np.random.default_rng(1).standard_normal(400_000)
    assert square_about(low, point) == pytest.approx(np.mean((drawn[drawn > low] - point) ** 2), rel=0.02)


def test_the_mean_square_far_beyond_a_bound_follows_its_asymptote() -> None:
    assert square_about(7.99, 7.99) == pytest.approx(square_about(8.01, 8.01), rel=0.1)
    assert square_about(60.0, 60.0) == pytest.approx(2.0 / 60.0**2)


def test_a_covariance_far_from_the_bound_is_unchanged() -> None:
    assert not_negative(SPREAD, {}) == pytest.approx(SPREAD)
    assert not_negative(SPREAD, {1: (9.0, 9.0)}) == pytest.approx(SPREAD)


def test_the_covariance_at_a_bound_is_that_of_draws_above_it() -> None:
    wanted = np.array([0.3, -0.7])
    drawn = np.random.default_rng(2).multivariate_normal(wanted, SPREAD, 400_000)
    kept = drawn[drawn[:, 1] > 0.0]
    # the estimate with the second unknown at its bound, by the regression on it
    held = np.array([wanted[0] - SPREAD[0, 1] / SPREAD[1, 1] * wanted[1], 0.0])
    told = not_negative(SPREAD, {1: (0.0, -0.7)})
    assert told == pytest.approx((kept - held).T @ (kept - held) / len(kept), rel=0.02)
    assert told[0, 0] < SPREAD[0, 0] - 0.5


@pytest.mark.parametrize("beyond", [1e-12, 0.05])
def test_a_correlation_that_rounding_puts_beyond_one_leaves_variances_positive(beyond: float) -> None:
    alike = np.array([[4.0, 2.0 + 2.0 * beyond], [2.0 + 2.0 * beyond, 1.0]])
    told = not_negative(alike, {1: (0.0, -1e7)})
    assert np.all(np.diag(told) > 0.0)
    assert told[0, 0] == pytest.approx(4.0 * told[1, 1], abs=1e-12)


def test_an_undetermined_unknown_keeps_its_infinite_variance() -> None:
    assert np.isinf(not_negative(np.diag([1.0, inf]), {1: (0.0, 0.0)})[1, 1])


def test_an_apparent_lag_of_the_motor_does_not_widen_the_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    record = log(1.0, p=PAPER)
    speed = record[SPEED]
    early = record.replace(**{SPEED: 0.94 * speed + 0.06 * np.append(speed[1:], speed[-1:])})
    value, std = fit_flow(early, PAPER, 2e8).parameters["bulk_modulus"]
    monkeypatch.setattr("estimation.fits.greybox.deviations.sign_constrained_covariance", lambda *given: given[-1])
    same, wider = fit_flow(early, PAPER, 2e8).parameters["bulk_modulus"]
    assert same == pytest.approx(value, rel=1e-3)
    assert std < 0.93 * wider
