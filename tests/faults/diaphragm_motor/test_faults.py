"""Faults of the diaphragm motor as changes of its parameters."""

from dataclasses import asdict

import pytest

from faults.diaphragm_motor.faults import MOTOR_FAULTS, motor_with_fault
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.errors import HydrostateError

HEALTHY = DiaphragmMotorParameters()


@pytest.mark.parametrize("name", MOTOR_FAULTS)
def test_every_fault_changes_nothing_at_severity_zero_and_is_valid_at_both_ends(name: str) -> None:
    fault = MOTOR_FAULTS[name]
    assert asdict(motor_with_fault(HEALTHY, name, 0.0)) == asdict(HEALTHY)
    for severity in fault.severities:
        faulty = motor_with_fault(HEALTHY, name, severity)
        assert (asdict(faulty) == asdict(HEALTHY)) == (severity == 0.0)


@pytest.mark.parametrize("name", MOTOR_FAULTS)
def test_every_fault_changes_one_parameter(name: str) -> None:
    before = asdict(HEALTHY)
    after = asdict(motor_with_fault(HEALTHY, name, MOTOR_FAULTS[name].severities[-1]))
    assert sum(before[key] != after[key] for key in before) == 1


def test_the_severities_of_every_fault_are_in_ascending_order() -> None:
    assert all(list(fault.severities) == sorted(set(fault.severities)) for fault in MOTOR_FAULTS.values())


@pytest.mark.parametrize(
    ("name", "severity", "said"),
    [("rust", 0.1, "must be one of"), ("load", 40.0, "-15 to 18 N, got 40"), ("valve_1_leak", -0.1, "0 to 1, got")],
)
def test_an_unknown_fault_or_a_severity_out_of_range_is_refused(name: str, severity: float, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        motor_with_fault(HEALTHY, name, severity)
