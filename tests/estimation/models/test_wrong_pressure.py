"""The offset of a pressure sensor, which drifts or settles."""

import numpy as np
import pytest

from estimation.models.wrong_pressure import MOST_SETTLING, relative_drift


@pytest.mark.parametrize("settling", [1.0, 4.0, MOST_SETTLING])
def test_a_settling_offset_follows_an_exponential(settling: float) -> None:
    elapsed = np.linspace(0.0, 1.0, 101)
    exact = (1.0 - np.exp(-settling * elapsed)) / settling
    np.testing.assert_allclose(relative_drift(elapsed, settling), exact, atol=0.0025 * exact[-1])


def test_an_offset_that_does_not_settle_drifts_linearly() -> None:
    elapsed = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(relative_drift(elapsed, 0.0), elapsed, rtol=1e-12)
