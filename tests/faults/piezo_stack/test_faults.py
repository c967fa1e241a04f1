"""Faults of the piezo-stack actuator."""

import pytest

from faults.conditions import CONDITIONS
from faults.piezo_stack.faults import STACK_FAULTS, stack_with_fault
from plant.errors import HydrostateError
from plant.piezo_stack.flow import output_flow
from plant.piezo_stack.parameters import PiezoStackParameters

HEALTHY = PiezoStackParameters(load_mass=10.0)


@pytest.mark.parametrize("name", [name for name in [*CONDITIONS, *STACK_FAULTS] if name != "normal"])
def test_every_fault_changes_the_actuator(name: str) -> None:
    assert stack_with_fault(HEALTHY, name) != HEALTHY
    assert stack_with_fault(HEALTHY, "normal") == HEALTHY


@pytest.mark.parametrize("axis", ["leakage", "friction"])
def test_flow_falls_with_the_level_of_leakage_and_friction(axis: str) -> None:
    flows = [output_flow(stack_with_fault(HEALTHY, name), 275.0, 140.0) for name in ("normal", f"minor_{axis}")]
    flows.append(output_flow(stack_with_fault(HEALTHY, f"major_{axis}"), 275.0, 140.0))
    assert flows == sorted(flows, reverse=True)
    assert flows[2] < 0.75 * flows[0]


def test_an_unknown_fault_is_refused_with_a_list_of_known_ones() -> None:
    with pytest.raises(HydrostateError, match=r"must be one of normal, .*bias_lost, got 'rust'"):
        stack_with_fault(HEALTHY, "rust")
