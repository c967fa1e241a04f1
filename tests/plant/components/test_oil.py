"""Oil, air and vapour: state equation, inverse and slope agree, and pressure stays above the vapour pressure."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.oil import ATMOSPHERE, effective_bulk_modulus, oil_pressure, specific_volume

VAPOUR = 2e3
STIFF = st.floats(5e7, 2e9)
AIR = st.floats(0.0, 0.3)


@given(st.floats(3e3, 2e7), STIFF, AIR)
def test_pressure_is_the_inverse_of_specific_volume(pressure: float, bulk_modulus: float, air: float) -> None:
    volume = specific_volume(pressure, bulk_modulus, air, VAPOUR)
    back = float(oil_pressure(1.0, volume, bulk_modulus, air, VAPOUR))
    slope = effective_bulk_modulus(pressure, bulk_modulus, air, VAPOUR)
    assert back == pytest.approx(pressure, rel=1e-9, abs=8.0 * np.finfo(float).eps * slope)


@given(st.floats(1e-6, 1.2), STIFF, AIR)
def test_pressure_is_finite_and_not_below_vapour_pressure_for_any_amount_of_oil(
    amount: float, bulk_modulus: float, air: float
) -> None:
    pressure = float(oil_pressure(amount, 1.0, bulk_modulus, air, VAPOUR))
    assert np.isfinite(pressure)
    assert pressure >= VAPOUR


@given(st.floats(0.5, 1.2), st.floats(1e-6, 1e-2), STIFF, AIR)
def test_more_oil_never_means_less_pressure(amount: float, more: float, bulk_modulus: float, air: float) -> None:
    low, high = (float(oil_pressure(n, 1.0, bulk_modulus, air, VAPOUR)) for n in (amount, amount * (1.0 + more)))
    assert low <= high


@pytest.mark.parametrize("air", [0.0, 0.01, 0.2])
@pytest.mark.parametrize("pressure", [5e4, 2.758e5, 3.4e6])
def test_the_slope_of_the_state_equation_is_the_effective_bulk_modulus(pressure: float, air: float) -> None:
    step = 1e-4 * pressure
    near = [specific_volume(p, 2.07e8, air, VAPOUR) for p in (pressure - step, pressure, pressure + step)]
    slope = -near[1] * 2.0 * step / (near[2] - near[0])
    assert effective_bulk_modulus(pressure, 2.07e8, air, VAPOUR) == pytest.approx(slope, rel=1e-6)


def test_without_air_the_oil_has_its_own_bulk_modulus() -> None:
    found = effective_bulk_modulus(ATMOSPHERE + 1e6, 2.07e8, 0.0, VAPOUR)
    assert found == pytest.approx(2.07e8 - 1e6, rel=1e-6)


@pytest.mark.parametrize("pressure", [5e5, 1e6, 5e6])
def test_the_bulk_modulus_with_a_little_air_follows_equation_5_of_the_piezo_stack_paper(pressure: float) -> None:
    air, stiff = 1e-3, 1.4e9
    ratio = air * ATMOSPHERE / pressure
    published = 1.0 / (ratio / pressure + (1.0 - ratio) / stiff)
    assert effective_bulk_modulus(pressure, stiff, air, 0.0) == pytest.approx(published, rel=5e-3)


def test_too_little_oil_is_at_vapour_pressure() -> None:
    assert float(oil_pressure(0.99, 1.0, 2.07e8, 0.0, VAPOUR)) == pytest.approx(VAPOUR, rel=1e-4)
