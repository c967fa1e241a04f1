"""Order statistics equal those of NumPy to the bit."""

import numpy as np
import pytest

from estimation.log_checks.order import median, percentile


@pytest.mark.parametrize("count", [1, 2, 3, 10, 1001])
def test_median_and_percentiles_are_numpys(count: int) -> None:
    values = np.random.default_rng(count).standard_normal(count)
    assert median(values) == np.median(values)
    for percent in (0.0, 5.0, 33.3, 50.0, 95.0, 100.0):
        assert percentile(values, percent) == np.percentile(values, percent)
