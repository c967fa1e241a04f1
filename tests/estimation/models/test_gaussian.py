"""A belief is finite, has a square covariance, and is immutable."""

import numpy as np
import pytest

from estimation.models.gaussian import Gaussian
from plant.errors import HydrostateError


def test_deviations_are_roots_of_the_diagonal() -> None:
    assert Gaussian(np.zeros(2), np.array([[4.0, 1.0], [1.0, 9.0]])).std.tolist() == [2.0, 3.0]


def test_a_belief_is_a_read_only_copy_of_its_arguments() -> None:
    mean, covariance = np.zeros(2), np.eye(2)
    belief = Gaussian(mean, covariance)
    mean[0], covariance[0, 0] = 5.0, 5.0
    assert belief.mean[0] == 0.0
    assert belief.covariance[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        belief.mean[0] = 1.0


@pytest.mark.parametrize(
    ("mean", "covariance", "message"),
    [
        (np.zeros(2), np.eye(3), r"needs shapes \(n,\) and \(n, n\), got \(2,\) and \(3, 3\)"),
        (np.zeros((2, 1)), np.eye(2), r"got \(2, 1\) and \(2, 2\)"),
        (np.array([np.nan]), np.eye(1), "must be finite"),
        (np.zeros(1), np.array([[np.inf]]), "must be finite"),
        (np.zeros(1), np.array([[-1.0]]), "variances must not be negative"),
    ],
)
def test_a_mean_or_covariance_of_wrong_shape_or_value_is_refused(
    mean: np.ndarray, covariance: np.ndarray, message: str
) -> None:
    with pytest.raises(HydrostateError, match=message):
        Gaussian(mean, covariance)
