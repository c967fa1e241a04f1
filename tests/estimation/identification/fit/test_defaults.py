"""The defaults of a fit are those of its signature and its docstring."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from estimation.identification import (
    LinearModel,
    fit_armax,
    fit_arx,
    fit_box_jenkins,
    fit_continuous,
    fit_instrumental,
    fit_output_error,
)
from estimation.identification.fit.inverse_dynamics import RigidBody, fit_rigid_body, force_error
from estimation.identification.fit.order import order_table, order_test
from estimation.identification.fit.profile_interval import dc_gain_interval
from estimation.identification.fit.residual_tests import ResidualTest, ljung_box

RNG = np.random.default_rng(3)
U = RNG.standard_normal(150)
Y = np.asarray(lfilter([0.5, 0.2], [1.0, -0.6], U)) + 0.05 * RNG.standard_normal(150)
FORM = {"n_numerator": 2, "n_denominator": 1}
TIME = 1e-3 * np.arange(3000)
POSITION = 0.1 * np.sin(9.0 * TIME) + 0.05 * np.sin(21.0 * TIME) + 1e-5 * RNG.standard_normal(3000)
FORCE = -50.0 * (8.1 * np.sin(9.0 * TIME) + 22.05 * np.sin(21.0 * TIME)) + RNG.standard_normal(3000)


def plain(found: Any) -> Any:
    """Return a result as values that can be compared."""
    if isinstance(found, LinearModel):
        return found.to_dict()
    if isinstance(found, pd.DataFrame):
        return found.to_dict()
    if isinstance(found, RigidBody):
        return found.values.tolist()
    return found if isinstance(found, int | float | tuple) else vars(found)


@pytest.mark.parametrize(
    ("fit", "named"),
    [
        (lambda **given: fit_arx(U, Y, 0.1, **FORM, **given), {"delay": 0}),
        (lambda **given: fit_output_error(U, Y, 0.1, **FORM, **given), {"delay": 0, "estimate_initial_state": True}),
        (lambda **given: fit_armax(U, Y, 0.1, **FORM, n_c=1, **given), {"delay": 0}),
        (lambda **given: fit_box_jenkins(U, Y, 0.1, **FORM, n_c=1, n_d=1, **given), {"delay": 0}),
        (lambda **given: fit_instrumental(U, Y, 0.1, **FORM, **given), {"delay": 0, "n_c": 0, "n_d": 0}),
        (lambda **given: fit_continuous(U, Y, 0.1, n_zeros=0, n_poles=1, **given), {"dead_time": 0.0}),
        (lambda **given: order_table(U, Y, 0.1, orders=(1,), **given), {"delay": 0}),
        (lambda **given: ljung_box(Y, **given), {"n_lags": 25, "n_parameters": 0}),
        (lambda **given: fit_rigid_body(POSITION, FORCE, 1e-3, **given), {"cutoff_hz": 100.0, "every": 25}),
        (
            lambda **given: force_error(RigidBody(50.0, 1.0, 1.0, 1.0, np.eye(4), 0.1), POSITION, FORCE, 1e-3, **given),
            {"cutoff_hz": 100.0, "every": 25},
        ),
        (
            lambda **given: dc_gain_interval(fit_output_error(U, Y, 0.1, **FORM), U, Y, **given),
            {"level": 0.95, "estimate_initial_state": True},
        ),
    ],
)
def test_omitted_arguments_have_the_expected_defaults(fit: Callable[..., Any], named: dict[str, Any]) -> None:
    np.testing.assert_equal(plain(fit()), plain(fit(**named)))


def test_the_order_test_uses_fifteen_rows_by_default() -> None:
    u, y = np.tile(U, 2), np.tile(Y, 2)
    found = [order_test(u, y, n_lags=30, rng=np.random.default_rng(0), **one) for one in ({}, {"n_rows": 15})]
    assert len(found[0].projected_singular_values) == len(found[1].projected_singular_values) == 15
    assert found[0].projected_noise_floor == found[1].projected_noise_floor


def test_a_residual_test_is_passed_above_five_percent_by_default() -> None:
    assert [ResidualTest(1.0, 1, p).passed() for p in (0.049, 0.051)] == [False, True]


def test_a_dead_time_shorter_than_a_sample_is_found() -> None:
    late = LinearModel([2.0], [1.0, 2.0], 0.1, "u", "y", continuous=True, dead_time=0.04)
    u = np.repeat(RNG.choice([-1.0, 1.0], 100), 4)
    y = late.simulate(u) + 0.01 * RNG.standard_normal(400)
    found = fit_continuous(u, y, 0.1, n_zeros=0, n_poles=1, dead_time=None)
    assert 0.0 < found.dead_time_std < 0.01
    assert found.dead_time == pytest.approx(0.04, abs=3.0 * found.dead_time_std)
