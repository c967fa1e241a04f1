"""A fault of the piezo stack is reported if its quantity is both large and certain."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from faults.piezo_stack.diagnose import StackFaultCode, _fault_note, _level
from plant.piezo_stack.parameters import PiezoStackParameters

HEALTHY = PiezoStackParameters()
AIR, LEAKAGE, SOFT = HEALTHY.air_fraction, HEALTHY.chamber_leakage, HEALTHY.inlet_reed_stiffness


def found(name: str, value: float, deviation: float) -> Any:
    return SimpleNamespace(values={name: value}, deviations={name: deviation})


@pytest.mark.parametrize(
    ("name", "healthy", "faulty", "code"),
    [
        ("air_fraction", 1.25 * AIR, 1.35 * AIR, StackFaultCode.AIR_IN_OIL),
        ("chamber_leakage", LEAKAGE + 0.9e-12, LEAKAGE + 1.1e-12, StackFaultCode.CHAMBER_LEAKS),
        ("polarisation", 0.96, 0.94, StackFaultCode.STACK_DEPOLARISED),
        ("inlet_reed_stiffness", 0.85 * SOFT, 0.75 * SOFT, StackFaultCode.REED_SOFT),
        ("inlet_reed_stiffness", 1.15 * SOFT, 1.25 * SOFT, StackFaultCode.REED_STIFF),
        (
            "outlet_reed_gap",
            HEALTHY.outlet_reed_gap + 4e-6,
            HEALTHY.outlet_reed_gap + 6e-6,
            StackFaultCode.REED_OPEN,
        ),
    ],
)
def test_a_fault_is_reported_only_if_it_is_large_and_certain(
    name: str, healthy: float, faulty: float, code: StackFaultCode
) -> None:
    base = 1.0 if name == "polarisation" else getattr(HEALTHY, name)
    size = abs(faulty - base)
    assert _fault_note(name, found(name, healthy, 0.01 * size), HEALTHY) is None
    assert _fault_note(name, found(name, faulty, 0.4 * size), HEALTHY) is None
    note = _fault_note(name, found(name, faulty, 0.3 * size), HEALTHY)
    assert note is not None
    assert note.code == code


def test_the_nearest_level_is_given_unless_the_deviation_is_too_large() -> None:
    levels = {"none": 0.0, "minor": 2.0, "major": 6.0}
    for value, level in ((10.9, "none"), (11.1, "minor"), (13.9, "minor"), (14.1, "major")):
        assert _level(found("q", value, 0.49), "q", 10.0, levels) == level
    assert _level(found("q", 12.0, 0.51), "q", 10.0, levels) is None


def test_a_reed_gap_is_a_fault_by_its_increase_over_the_healthy_gap() -> None:
    healthy = replace(HEALTHY, inlet_reed_gap=3e-6)
    assert _fault_note("inlet_reed_gap", found("inlet_reed_gap", 7e-6, 1e-8), healthy) is None
    note = _fault_note("inlet_reed_gap", found("inlet_reed_gap", 9e-6, 1e-8), healthy)
    assert note is not None
    assert dict(note.data) == {"reed": "inlet", "gap_um": pytest.approx(9.0)}
