"""The criterion in bands, run as Python and as machine code, compared with complex least squares."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.search.banded import explained_power, refine_banded
from plant.compiled.native.loops import Loop

OMEGA = np.linspace(0.05, 2.8, 40)
POWER = 1.0 + np.cos(OMEGA) ** 2
DELAY = 1
F = np.array([-1.2, 0.5])
B = np.array([0.4, -0.3, 0.1])


def response(b: Array, f: Array) -> Array:
    shifts = np.exp(-1j * np.outer(OMEGA, np.arange(6)))
    return shifts[:, DELAY : DELAY + b.size] @ b / (1.0 + shifts[:, 1 : 1 + f.size] @ f)


def cross() -> Array:
    rng = np.random.default_rng(1)
    noise = 0.05 * (rng.standard_normal(OMEGA.size) + 1j * rng.standard_normal(OMEGA.size))
    return POWER * (response(B, F) + noise)


def cost_of(b: Array, f: Array) -> float:
    return float(np.sum(POWER * np.abs(response(b, f) - cross() / POWER) ** 2))


@pytest.fixture(params=["compiled", "Python"], autouse=True)
def _way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run each test with machine code and with the loops as plain Python."""
    if request.param == "Python":
        monkeypatch.setattr(Loop, "__call__", lambda loop, *args: loop.__wrapped__(*args))


def test_the_best_numerator_is_that_of_least_squares() -> None:
    candidates = np.array([F, [-0.9, 0.3], [0.5, 0.2]])
    explained, numerators = explained_power(candidates, 3, DELAY, OMEGA, POWER, cross())
    for f, power, b in zip(candidates, explained, numerators, strict=True):
        columns = np.stack([response(one, f) for one in np.eye(3)], axis=1) * np.sqrt(POWER)[:, None]
        wanted = cross() / np.sqrt(POWER)
        design, target = (np.concatenate([part.real, part.imag]) for part in (columns, wanted))
        best = np.linalg.lstsq(design, target, rcond=None)[0]
        assert b == pytest.approx(best, rel=1e-6)
        assert power == pytest.approx(np.sum((design @ best) ** 2), rel=1e-6)


def test_refined_starts_are_at_a_minimum_of_the_criterion() -> None:
    starts = np.array([[0.3, 0.0, 0.0, -1.0, 0.4], [*B, *F]])
    costs, refined = refine_banded(starts, 3, DELAY, OMEGA, POWER, cross(), 60)
    for theta, cost in zip(refined, costs, strict=True):
        assert cost == pytest.approx(cost_of(theta[:3], theta[3:]))
        for side in 1e-4 * np.vstack([np.eye(5), -np.eye(5)]):
            assert cost <= cost_of((theta + side)[:3], (theta + side)[3:]) * (1.0 + 1e-9)
    assert costs[0] == pytest.approx(costs[1], rel=1e-4)


def test_a_search_without_steps_or_with_nan_data_returns_its_start() -> None:
    start = np.array([[0.3, 0.0, 0.0, -1.0, 0.4]])
    costs, refined = refine_banded(start, 3, DELAY, OMEGA, POWER, cross(), 0)
    np.testing.assert_array_equal(refined, start)
    assert costs[0] == pytest.approx(cost_of(start[0, :3], start[0, 3:]))
    _, lost = refine_banded(start, 3, DELAY, OMEGA, POWER, np.full(OMEGA.size, np.nan + 0j), 60)
    np.testing.assert_array_equal(lost, start)
