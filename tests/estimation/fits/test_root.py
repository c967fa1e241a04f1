from collections.abc import Callable
from math import cos, tanh

import pytest
from scipy.optimize import brentq

from estimation.fits.root import root_between


@pytest.mark.parametrize("tolerance", [1e-12, 1e-3, 0.1])
@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (lambda x: x * x - 2.0, 0.0, 2.0),
        (lambda x: x**3 - x - 1.0, -5.0, 9.0),
        (lambda x: cos(x) - x, 0.0, 3.0),
        (lambda x: tanh(50.0 * (x - 0.3)), -1.0, 9.0),
        (lambda x: x, 0.0, 1.0),
        (lambda x: x, -1.0, 0.0),
        (lambda x: 1e-200 * (x**3 - x - 1.0), -5.0, 9.0),
    ],
)
def test_the_root_is_that_of_scipy(
    function: Callable[[float], float], low: float, high: float, tolerance: float
) -> None:
    wanted = brentq(function, low, high, xtol=tolerance)
    assert root_between(function, low, high, tolerance) == pytest.approx(wanted, rel=1e-14, abs=1e-300)


def test_an_interval_without_a_sign_change_is_refused() -> None:
    with pytest.raises(ValueError, match="unlike signs"):
        root_between(lambda x: x * x + 1.0, -1.0, 1.0, 1e-9)


def test_an_approximate_root_is_returned_if_the_steps_run_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimation.fits.root.MOST_STEPS", 3)
    found = root_between(lambda x: x**3 - x - 1.0, -5.0, 9.0, 1e-12)
    assert 1e-6 < abs(found - 1.3247179572447460) < 5.0
