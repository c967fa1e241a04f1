"""The inner circuit that feeds the chambers."""

from types import SimpleNamespace

import pytest

from estimation.models.inner_circuit import accumulator_rate


def test_the_accumulator_of_a_single_rod_follows_boyles_law() -> None:
    """With a constant stiffness, the pressure would fall to two thirds instead of three quarters."""
    rod = {"area_difference": 0.3, "accumulator_pressure": 6e5, "accumulator_stiffness": 6e5 / 1e-3}
    p, gas, steps = SimpleNamespace(**rod), 1e-3, 10_000
    supply, taken = 6e5, gas / 3.0
    for _ in range(steps):
        supply += accumulator_rate(taken / steps, supply, p)
    assert supply == pytest.approx(6e5 * gas / (gas + taken), rel=1e-3)


def test_the_accumulator_of_a_through_rod_has_constant_stiffness() -> None:
    p = SimpleNamespace(area_difference=0.0, accumulator_pressure=6e5, accumulator_stiffness=6e8)
    assert accumulator_rate(1e-6, 9e5, p) == -6e8 * 1e-6
