"""Each balance recovers the law that generated its series, from the regressors of that law."""

import numpy as np
import pytest

from faults.watch.balances import BENT, FEATURES, GAINS, count_gains, learn, regress, shift, solve
from plant.arrays import Array

LAW = np.array([0.5, -0.2, 0.03, -0.02, 0.01, 0.06, -0.04, 0.05])


def bent(x: float) -> float:
    return x / (abs(x) + BENT)


def learnt(balance: str) -> Array:
    """Return the coefficients that a balance finds in a series whose predicted channel follows `LAW`."""
    rng = np.random.default_rng(4)
    wide = 1 if balance == "motion" else 2
    which = 1 if balance == "force" else 0
    lags, features, target = np.zeros(8), np.zeros((2, FEATURES)), np.zeros(wide)
    information, moment = np.zeros((wide, FEATURES, FEATURES)), np.zeros((wide, FEATURES))
    found, factor = np.zeros((wide, FEATURES)), np.zeros((FEATURES, FEATURES))
    w1 = v1 = v2 = p1 = p2 = q1 = q2 = 0.0
    for _ in range(400):
        w, v, p = rng.uniform(-1.0, 1.0, 3)
        if balance == "flow":
            v = w - LAW @ [q1, q2, p, p1, p2, w, w1, bent(w)]
        elif balance == "force":
            p = LAW @ [p1, p2, v * abs(v), v, v1, v2, bent(v), bent(v1)]
        else:
            v = LAW @ [v1, v2, w, w1, bent(w), bent(w1), w * abs(w), bent(v1)]
        regress(w, v, p, lags, features, target)
        learn(which, features, target, 0.999, information, moment, found)
        shift(w, v, p, lags)
        w1, v1, v2, p1, p2, q1, q2 = w, v, v1, p, p1, w - v, q1
    solve(information[which], moment[which], found[which], factor)
    return found[which]


@pytest.mark.parametrize("balance", ["flow", "force", "motion"])
def test_a_balance_recovers_the_law_that_made_its_series(balance: str) -> None:
    assert learnt(balance) == pytest.approx(LAW, abs=1e-5)


def test_old_samples_fade_and_the_residual_is_that_of_the_current_coefficients() -> None:
    rng, fade = np.random.default_rng(5), 0.9
    rows, targets = rng.standard_normal((6, FEATURES)), rng.standard_normal(6)
    information, moment = np.zeros((1, FEATURES, FEATURES)), np.zeros((1, FEATURES))
    found = rng.standard_normal((1, FEATURES))
    for row, target in zip(rows, targets, strict=True):
        missed = learn(0, row[None], np.array([target]), fade, information, moment, found)
        assert missed == pytest.approx(target - row @ found[0])
    weights = fade ** np.arange(5, -1, -1)
    assert np.tril(information[0]) == pytest.approx(np.tril(rows.T @ (rows * weights[:, None])))
    assert moment[0] == pytest.approx(rows.T @ (weights * targets))


def test_the_normal_equations_are_solved_with_a_small_ridge() -> None:
    rng = np.random.default_rng(6)
    rows = rng.standard_normal((50, FEATURES))
    rows[:, 7] = rows[:, 6]  # two features that cannot be separated
    information, moment = rows.T @ rows, rng.standard_normal(FEATURES)
    found = np.zeros(FEATURES)
    solve(np.tril(information), moment, found, np.zeros((FEATURES, FEATURES)))
    ridge = np.diag(1e-8 * np.diag(information) + 1e-12)
    assert found == pytest.approx(np.linalg.solve(information + ridge, moment), rel=1e-5)


def test_the_coefficient_of_an_unexcited_feature_is_zero() -> None:
    information, moment = np.diag([2.0] * 7 + [0.0]), np.array([1.0] * 7 + [0.0])
    found = np.full(FEATURES, np.nan)
    solve(information, moment, found, np.zeros((FEATURES, FEATURES)))
    assert found == pytest.approx([0.5] * 7 + [0.0], rel=1e-7)


def test_gains_correlate_lost_flow_with_pressure_and_pressure_with_velocity() -> None:
    gains = np.zeros((3, GAINS))
    rng = np.random.default_rng(7)
    velocity, pressure = rng.standard_normal((2, 20))
    speed = velocity + 0.3 * pressure  # the pump loses 0.3 times the pressure
    for w, v, p in zip(speed, velocity, pressure, strict=True):
        count_gains(w, v, p, 1, gains)
    assert gains[1] == pytest.approx(
        [0.3 * pressure @ pressure, speed @ pressure, pressure @ velocity, velocity @ velocity, pressure @ pressure]
    )
    assert not gains[[0, 2]].any()
