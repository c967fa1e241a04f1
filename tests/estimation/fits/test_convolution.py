import numpy as np
import pytest
from scipy.signal import oaconvolve

from estimation.fits.convolution import convolved


@pytest.mark.parametrize(
    ("samples", "reach"), [(1, 0), (50, 0), (12, 1), (90, 9), (1_000, 3), (9_000, 240), (30_011, 7)]
)
def test_the_convolution_equals_that_of_scipy(samples: int, reach: int) -> None:
    rng = np.random.default_rng(samples)
    half = rng.standard_normal(reach + 1)
    values, kernel = rng.standard_normal(samples), np.concatenate([half[:0:-1], half])
    np.testing.assert_allclose(convolved(values, kernel), oaconvolve(values, kernel, mode="same"), rtol=0.0, atol=1e-12)
