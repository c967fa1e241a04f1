"""Throttle laws pass through their calibration points and are monotonic."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.eha.throttles import ThrottleA, ThrottleB
from plant.errors import RigError

A = ThrottleA((10.0, 2.0, 1.75), (4.784e-12, 2.523e-11, 6.006e-11), (2.413e-6, 1.382e-5, 1.465e-5))
B = ThrottleB((10.0, 2.5, 2.3, 0.0), (1e-9, 4e-7, 8e-7, 6e-5))


@pytest.mark.parametrize(("volts", "leakage", "bias"), list(zip(A.volts, A.leakage, A.bias, strict=True)))
def test_throttle_a_passes_through_its_points(volts: float, leakage: float, bias: float) -> None:
    assert A.at(volts) == (pytest.approx(leakage, rel=1e-12, abs=0.0), pytest.approx(bias, rel=1e-12))


@pytest.mark.parametrize(("volts", "area"), list(zip(B.volts, B.area, strict=True)))
def test_throttle_b_passes_through_its_points(volts: float, area: float) -> None:
    assert B.at(volts) == pytest.approx(area, rel=1e-12)


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_a_lower_voltage_never_closes_a_throttle(one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert A.at(low)[0] >= A.at(high)[0]
    assert A.at(low)[1] >= A.at(high)[1]
    assert B.at(low) >= B.at(high)


def test_calibration_points_that_are_not_monotonic_or_too_few_are_refused() -> None:
    with pytest.raises(RigError, match="throttle B must open as its voltage falls"):
        ThrottleB((10.0, 0.0), (2e-6, 1e-6))
    with pytest.raises(RigError, match="throttle A must open as its voltage falls"):
        ThrottleA((0.0, 10.0), (1e-12, 2e-12), (1e-6, 2e-6))
    with pytest.raises(RigError, match="at least two points"):
        ThrottleB((10.0,), (1e-6,))


@pytest.mark.parametrize("volts", [-0.1, 10.1, float("nan")])
def test_a_throttle_voltage_out_of_range_is_refused(volts: float) -> None:
    with pytest.raises(RigError, match=r"throttle [AB] takes 0 to 10 V, got"):
        A.at(volts)
    with pytest.raises(RigError, match=rf"throttle B takes 0 to 10 V, got {volts!r} V"):
        B.at(volts)
