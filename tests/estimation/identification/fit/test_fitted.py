"""The residual deviation that a fit reports has no bias."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.identification.fit.fitted import quality


def test_the_residual_variance_is_unbiased_with_many_parameters() -> None:
    rng = np.random.default_rng(1)
    n, p, sigma, found = 12, 6, 0.3, []
    data: Any = SimpleNamespace(n_used=n, y_scale=1.0, used=np.ones(n, dtype=bool), y=None)
    for _ in range(500):
        design, data.y = rng.standard_normal((n, p)), sigma * rng.standard_normal(n)
        residual = data.y - design @ np.linalg.lstsq(design, data.y)[0]
        found.append(quality(residual, data, p)["residual_std"] ** 2)
    assert np.mean(found) == pytest.approx(sigma**2, rel=0.1)
