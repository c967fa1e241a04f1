"""Information criteria of a free run."""

import numpy as np
import pytest
from scipy.stats import norm

from estimation.identification.free_run.choose_linear import criteria


def test_criteria_equal_those_of_gaussian_errors_without_the_constant_common_to_all_models() -> None:
    errors = np.random.default_rng(1).normal(0.0, 0.2, 300)
    cost, samples = float(errors @ errors), len(errors)
    twice = -2.0 * float(np.sum(norm.logpdf(errors, scale=np.sqrt(cost / samples))))
    shared = samples * (1.0 + np.log(2.0 * np.pi))
    assert criteria(cost, 7, samples) == pytest.approx((twice - shared + 7 * np.log(samples), twice - shared + 2.0 * 7))
