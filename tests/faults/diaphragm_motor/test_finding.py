"""What speaks against a diagnosis of the diaphragm motor."""

from types import SimpleNamespace
from typing import Any

import pytest

from faults.diaphragm_motor.finding import STANDING, MotorFaultCode, _against


def diagnosis(velocity: float, *, unknown: bool) -> Any:
    best = SimpleNamespace(name="valve_1_leak", chi_square=40.0)
    return SimpleNamespace(unknown=unknown, best=best, freedom=12, signature=SimpleNamespace(velocity=velocity))


@pytest.mark.parametrize("velocity", [2.0 * STANDING, -2.0 * STANDING])
def test_a_rod_that_moves_and_a_fault_that_fits_are_not_doubted(velocity: float) -> None:
    assert _against(diagnosis(velocity, unknown=False)) == ()


def test_a_nearest_fault_that_misses_and_a_rod_that_stands_are_told() -> None:
    misses, stands = _against(diagnosis(-0.5 * STANDING, unknown=True))
    assert misses == MotorFaultCode.NEAREST_MISSES.note(fault="valve_1_leak", chi_square=40.0, freedom=12)
    assert stands.code is MotorFaultCode.ROD_STANDS
    assert stands.data["velocity_mm_s"] == pytest.approx(-500.0 * STANDING)
