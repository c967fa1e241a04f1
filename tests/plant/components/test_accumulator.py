"""The accumulator is a gas volume that oil compresses."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.accumulator import gas_pressure


@given(st.floats(0.0, 1.9e-3))
def test_pressure_times_gas_volume_is_constant(amount: float) -> None:
    gas = 1e-3 + 1e-3 - amount
    assert gas_pressure(amount, 1e-3, 2.758e5, 1e-3) * gas == pytest.approx(2.758e5 * 1e-3, rel=1e-12)


def test_an_accumulator_at_its_charge_has_the_charge_pressure() -> None:
    assert gas_pressure(1e-3, 1e-3, 2.758e5, 1e-3) == pytest.approx(2.758e5, rel=1e-15)
