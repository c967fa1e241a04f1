"""One-step errors are the plant's residual through the inverse noise model; their sensitivities are its derivatives."""

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array
from estimation.identification.search.one_step import prediction_errors

N = 120
U = np.repeat(np.random.default_rng(7).choice([-1.0, 1.0], N // 4), 4)
Y = np.random.default_rng(8).normal(size=N)
B, F, C, D, DELAY = [0.2, 0.1], [-1.4, 0.6], [0.2], [-0.3], 1
WHOLE = np.ones(N, dtype=bool)
GAPPED = np.random.default_rng(9).random(N) > 0.1
BOUNDS = [0, 70, N]


def errors(
    theta: Array, d: int, states: int, used: Array, bounds: list[int] | None = None
) -> tuple[float, Array, Array]:
    """Return cost, errors and minus their derivative; if d has no values, the noise shares the plant's poles."""
    error, jacobian = np.empty(N), np.empty((N, theta.size))
    sizes = np.array([2, 2, 1, d, DELAY, states])
    cost = prediction_errors(theta, sizes, d == 0, U, Y, used, np.array(bounds or BOUNDS), error, jacobian)
    return cost, error, jacobian


@pytest.mark.parametrize("tied", [False, True])
def test_one_step_errors_equal_those_of_the_plant_and_noise_filters(tied: bool) -> None:
    d = [] if tied else D
    cost, error, _ = errors(np.array([*B, *F, *C, *d]), len(d), 0, WHOLE, [0, N])
    left = Y - lfilter([0.0] * DELAY + B, [1.0, *F], U)
    wanted = lfilter([1.0, *(F if tied else D)], [1.0, *C], left)
    np.testing.assert_allclose(error, wanted, rtol=1e-9, atol=1e-12)
    assert cost == pytest.approx(wanted @ wanted)


@pytest.mark.parametrize("used", [WHOLE, GAPPED], ids=["whole", "with gaps"])
@pytest.mark.parametrize("tied", [False, True])
def test_sensitivities_are_the_derivatives_of_the_errors(tied: bool, used: Array) -> None:
    d = [] if tied else D
    theta = np.array([*B, *F, *C, *d, 0.1, 0.0, -0.1, 0.2])  # two initial states for each experiment
    _, _, jacobian = errors(theta, len(d), 2, used)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-6
        above, below = (errors(theta + side * step, len(d), 2, used)[1] for side in (1.0, -1.0))
        np.testing.assert_allclose(jacobian[:, k], (below - above) / 2e-6, atol=1e-7 * np.abs(jacobian).max())


def test_a_missing_output_has_zero_error_and_is_not_read() -> None:
    theta = np.array([*B, *F, *C, *D, 0.0, 0.0, 0.0, 0.0])
    _, error, _ = errors(theta, 1, 2, GAPPED)
    assert np.all(error[~GAPPED] == 0.0)
    before = Y.copy()
    try:
        Y[~GAPPED] = 1e6  # missing outputs are not read
        _, again, _ = errors(theta, 1, 2, GAPPED)
    finally:
        Y[:] = before
    np.testing.assert_array_equal(error, again)
