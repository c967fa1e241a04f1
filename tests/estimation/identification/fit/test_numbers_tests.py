"""Tests of residuals, covariances, orders and masses from small records, kept in `numbers_tests.json`."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.fit import order
from estimation.identification.fit.covariances import covariances
from estimation.identification.fit.feedback import FEEDBACK_SAMPLES, feedback_note
from estimation.identification.fit.inverse_dynamics import fit_rigid_body, force_error
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.fit.residual_noise import noise_seen, noise_spectrum
from estimation.identification.fit.residual_tests import (
    ResidualTest,
    correlations,
    cross_correlation_test,
    feedback_test,
    ljung_box,
)
from estimation.identification.fit.validate import estimate_initial_state, fit_percent, rmse, validate
from estimation.identification.search.experiments import Experiments
from plant.arrays import Array
from tests.numbers import Numbers, refused, some

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(29)
N = 400
U: Array = 3.0 * np.repeat(RNG.choice([-1.0, 1.0], N // 4), 4) + 0.5
NOISE: Array = RNG.standard_normal(N)
LOST: Array = np.where(np.arange(N) % 9 == 4, np.nan, NOISE)
FORM = {"n_numerator": 2, "n_denominator": 2, "delay": 1}


def answer(noise: float = 0.1) -> Array:
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.3 * U[t - 1] - 0.1 * U[t - 2]
    return y + noise * NOISE


def told_of(found: ResidualTest) -> list[Any]:
    return [found.statistic, found.degrees_of_freedom, found.p_value, found.passed(), found.passed(0.9)]


@NUMBERS.case()
def residuals_that_are_tested() -> dict[str, Any]:
    follows = 0.05 * np.concatenate([np.zeros(3), U[:-3]]) + LOST
    columns = np.column_stack([U, np.cumsum(U) / N])
    told: dict[str, Any] = {
        "whiteness": [told_of(ljung_box(one)) for one in (NOISE, LOST, NOISE + 0.7 * np.roll(NOISE, 1))],
        "few lags": told_of(ljung_box(LOST, n_lags=5, n_parameters=2)),
        "mostly missing": told_of(ljung_box(np.where(np.arange(N) % 7 == 0, NOISE, np.nan))),
        "of the input": [told_of(cross_correlation_test(one, U)) for one in (NOISE, LOST, follows)],
        "absorbed": told_of(cross_correlation_test(follows, U, n_lags=6, jacobian=columns)),
        "one lag": told_of(cross_correlation_test(LOST, U, n_lags=1)),
        "steps of an input": told_of(cross_correlation_test(LOST, np.repeat([1.0, -1.0], N // 2), n_lags=9)),
        "rank of an input": [
            cross_correlation_test(LOST, np.repeat([1.0, -1.0], N // 2) + size * NOISE, n_lags=9).degrees_of_freedom
            for size in (1e-15, 1e-13, 3e-12, 1e-10)
        ],
        "correlations": correlations(LOST, U, [-3, -1, 0, 2, 5]),
    }
    for share in (0.0, 0.02, 0.1):
        fed = U + share * np.concatenate([[0.0], 30.0 * NOISE[:-1]])
        told[f"fed back by {share:g}"] = [
            told_of(feedback_test(LOST, fed)),
            told_of(feedback_test(LOST, fed, n_lags=5)),
        ]
    calls: dict[str, Callable[[], Any]] = {
        "as many samples as lags": partial(ljung_box, NOISE[:25]),
        "one more": partial(ljung_box, NOISE[:26]),
        "as many parameters": partial(ljung_box, NOISE, n_lags=3, n_parameters=3),
        "one less": partial(ljung_box, NOISE, n_lags=3, n_parameters=2),
        "other lengths": partial(cross_correlation_test, NOISE, U[:9]),
        "one too few for an input": partial(cross_correlation_test, NOISE[:13], NOISE[20:33], n_lags=5),
        "enough for an input": partial(cross_correlation_test, NOISE[:14], NOISE[20:34], n_lags=5),
        "as few as lags": partial(cross_correlation_test, NOISE[:5], NOISE[20:25], n_lags=5),
        "other lengths for feedback": partial(feedback_test, NOISE, U[:9]),
        "one too few for feedback": partial(feedback_test, NOISE[:39], U[:39], n_lags=5),
        "enough for feedback": partial(feedback_test, NOISE[:40], U[:40], n_lags=5),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


@NUMBERS.case()
def what_is_said_of_feedback() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for share in (0.0, 0.02, 0.025, 0.03, 0.05):
        note = feedback_note(LOST, U + share * np.concatenate([[0.0], 30.0 * NOISE[:-1]]), ("u", "y"))
        told[f"by {share:g}"] = None if note is None else dict(note.data)
    fed = np.concatenate([[0.0], NOISE[:-1]])
    for n in (199, 200):
        told[f"{n} samples"] = feedback_note(NOISE[:n], fed[:n], ("u", "y")) is None
    rng = np.random.default_rng(4)
    free, noise = rng.standard_normal((2, FEEDBACK_SAMPLES + 400))
    late = free.copy()
    late[FEEDBACK_SAMPLES + 1 :] += 9.0 * noise[FEEDBACK_SAMPLES:-1]
    told["beyond what is asked"] = feedback_note(noise, late, ("u", "y")) is None
    return told


@NUMBERS.case()
def covariances_of_residuals() -> dict[str, Any]:
    used = np.arange(N) % 9 != 4
    data = Experiments(U, answer(), used, np.array([0, 150, N]))
    columns = np.column_stack([U, np.roll(U, 2), np.cumsum(U) / 30.0])
    columns[~used] = 0.0
    residual = np.where(used, np.convolve(NOISE, [1.0, 0.8, 0.4])[:N], 0.0)
    told: dict[str, Any] = {}
    alike = np.column_stack([columns, columns[:, 0] - columns[:, 1]])
    unfelt = np.column_stack([columns, np.zeros(N)])
    for name, one in (("plain", columns), ("alike", alike), ("unfelt", unfelt)):
        white, robust, determined = covariances(one, residual, data)
        told[name] = [white, robust, determined]
    for n in (9, 10, 19, 20, 64, 128, 129):
        upright = np.linalg.qr(columns[:n, :2])[0]
        found = noise_spectrum([(residual[:n], upright, used[:n])])
        told[f"noise of {n}"] = [found.coefficients, found.variance, noise_seen(found, upright)]
    return told


@NUMBERS.case()
def orders() -> dict[str, Any]:
    y = answer()
    told: dict[str, Any] = {"impulse response": order.markov_parameters(U, y, 12)}
    for name, given in {
        "by default": {},
        "few rows": {"n_rows": 5},
        "told lags": {"n_lags": 30, "n_rows": 4},
        "one's own phases": {"rng": np.random.default_rng(5)},
    }.items():
        found = order.order_test(U, y, **given)
        told[name] = {
            "Hankel": [found.hankel_singular_values.size, some(found.hankel_singular_values), found.hankel_noise_floor],
            "projected": [some(found.projected_singular_values), found.projected_noise_floor],
            "order": found.suggested_order,
        }
    rng = np.random.default_rng(6)
    u = rng.standard_normal(1600)
    wide = order.order_test(u, np.convolve(u, 0.8 ** np.arange(30.0))[:1600] + 0.1 * rng.standard_normal(1600))
    told["lags of 1600 samples"] = [wide.hankel_singular_values.size, wide.hankel_noise_floor, wide.suggested_order]
    table = order.order_table(U, y, 0.01, orders=(1, 2, 3), delay=1)
    criteria = ("aic", "aicc", "bic", "fpe")
    told["table behind a delay"] = {
        str(n): {key: float(f"{row[key]:.5g}") if key in criteria else row[key] for key in (*criteria, "n_parameters")}
        for n, row in table.iterrows()
    }
    told["cancelled"] = table["cancellations"].astype(int).tolist()
    told["slowest poles"] = [round(float(one), 4) for one in table["slowest_pole"][:2]]
    told["table without"] = order.order_table(U, y, 0.01, orders=(1,))["n_parameters"].tolist()
    short = order.order_table(U[:40], y[:40], 0.01, orders=(2,))
    told["of few samples"] = [float(f"{short[key].iloc[0]:.4g}") for key in criteria]
    told["nothing"] = refused(lambda: order.order_table(U, NOISE, 0.01, orders=(1, 2)))
    calls: dict[str, Callable[[], Any]] = {
        "179 samples": partial(order.order_test, U[:179], y[:179]),
        "180 samples": partial(order.order_test, U[:180], y[:180]),
        "of few rows": partial(order.order_test, U[:59], y[:59], n_rows=4),
        "of many lags": partial(order.order_test, U[:200], y[:200], n_lags=67),
        "a response of two thirds": partial(order.markov_parameters, U[:35], y[:35], 12),
        "a response of a third": partial(order.markov_parameters, U[:36], y[:36], 12),
        "a table": partial(order.order_test, U[:, None], y[:, None]),
        "other lengths": partial(order.order_test, U, y[:300]),
        "gaps": partial(order.order_test, U, np.where(np.arange(N) == 3, np.nan, y)),
        "lost inputs": partial(order.order_test, np.where(np.arange(N) == 3, np.nan, U), y),
        "a constant": partial(order.order_test, np.ones(N), y),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


def moved(n: int = 600) -> tuple[Array, Array]:
    """Return the position of a body that is pushed to and fro, and the force that this takes."""
    t = 0.001 * np.arange(n)
    position = 0.01 * np.sin(40.0 * t) + 0.002 * np.sin(91.0 * t + 0.4)
    velocity = 0.4 * np.cos(40.0 * t) + 0.182 * np.cos(91.0 * t + 0.4)
    acceleration = -16.0 * np.sin(40.0 * t) - 16.562 * np.sin(91.0 * t + 0.4)
    force = 20.0 * acceleration + 300.0 * velocity + 50.0 * np.sign(velocity) + 7.0
    return position, force + 5.0 * np.resize(NOISE, n)


@NUMBERS.case()
def rigid_bodies() -> dict[str, Any]:
    position, force = moved()
    told: dict[str, Any] = {}
    for every, cutoff in ((5, 100.0), (10, 60.0)):
        body = fit_rigid_body(position, force, 0.001, every=every, cutoff_hz=cutoff)
        told[f"every {every}"] = [body.values, body.std, body.relative_force_error]
        told[f"every {every}, elsewhere"] = force_error(
            body, position[::-1], force + 3.0, 0.001, every=every, cutoff_hz=cutoff
        )
    calls: dict[str, Callable[[], Any]] = {
        "99 samples": partial(fit_rigid_body, position[:99], force[:99], 0.001, every=5),
        "100 samples": partial(fit_rigid_body, position[:100], force[:100], 0.001, every=5),
        "half the rate": partial(fit_rigid_body, position, force, 0.001, every=5, cutoff_hz=500.0),
        "nothing passes": partial(fit_rigid_body, position, force, 0.001, every=5, cutoff_hz=0.0),
        "gaps": partial(fit_rigid_body, position * np.nan, force, 0.001, every=5),
        "endless force": partial(fit_rigid_body, position, force + np.inf, 0.001, every=5),
        "a table": partial(fit_rigid_body, position[:, None], force[:, None], 0.001, every=5),
        "other lengths": partial(fit_rigid_body, position, force[1:], 0.001, every=5),
        "at rest": partial(fit_rigid_body, 0.0 * position, force, 0.001, every=5),
        "one way": partial(fit_rigid_body, 0.001 * np.arange(600.0), force, 0.001, every=5),
        "default": partial(fit_rigid_body, position[:500], force[:500], 0.001),
        "default, shorter": partial(fit_rigid_body, position[:499], force[:499], 0.001),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


@NUMBERS.case(relative=1e-5)
def validations() -> dict[str, Any]:
    y = np.where(np.arange(N) % 9 == 4, np.nan, answer())
    model = fit_output_error(U[:250], answer()[:250], 0.01, **FORM)
    told: dict[str, Any] = {
        "fit": [fit_percent(y, model.simulate(U)), rmse(y, model.simulate(U))],
        "initial state": estimate_initial_state(model, U[100:], y[100:]),
    }
    for name, found in {
        "elsewhere": validate(model, U[100:], y[100:]),
        "fitted": validate(model, U[:250], answer()[:250], fitted=True),
        "few lags": validate(model, U[100:], y[100:], n_lags=5),
    }.items():
        told[name] = [found.fit_percent, found.rmse, told_of(found.whiteness), told_of(found.cross_correlation)]
    told["refused"] = [
        refused(partial(rmse, np.ones(3), np.ones(4))),
        refused(partial(rmse, np.full(3, np.nan), np.ones(3))),
    ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
