import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.identification.model.recursion import filtered


@pytest.mark.parametrize("n_b", [1, 2, 5])
@pytest.mark.parametrize("n_f", [1, 2, 4])
@pytest.mark.parametrize("from_rest", [True, False])
def test_the_output_equals_that_of_scipy_lfilter(n_b: int, n_f: int, from_rest: bool) -> None:
    rng = np.random.default_rng(10 * n_b + n_f)
    b, u = rng.standard_normal(n_b), rng.standard_normal(300)
    f = np.poly(rng.uniform(-0.95, 0.95, n_f - 1)) if n_f > 1 else np.ones(1)
    state = np.zeros(max(n_b, n_f) - 1) if from_rest else rng.standard_normal(max(n_b, n_f) - 1)
    wanted = lfilter(b, f, u, zi=state)[0]
    np.testing.assert_allclose(filtered(b, f, u, None if from_rest else state), wanted, rtol=1e-11, atol=1e-13)


def test_neither_the_series_nor_its_state_is_written_to() -> None:
    series, state = np.ones(5), np.ones(1)
    series.flags.writeable = state.flags.writeable = False
    filtered([1.0], [1.0, -0.5], series, state)
    np.testing.assert_array_equal(series, 1.0)
    np.testing.assert_array_equal(state, 1.0)
