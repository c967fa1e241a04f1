"""Kinds of actuators: found by name or by one of their plants, and refused if they are registered wrongly."""

from dataclasses import replace

import pytest

from experiments import actuators
from experiments.actuators import actuator, infer_kind, kind_of_rig, kinds_by_columns, verb_of_kind
from plant.eha.rig import Rig
from plant.errors import HydrostateError, NoChannelError


def test_a_kind_is_found_by_its_name_and_by_each_of_its_plants() -> None:
    assert {actuator(name).name for name in ("eha", "lumped", "circuit", "reduced")} == {"eha"}
    with pytest.raises(HydrostateError, match=r"--plant must be one of .*piezo-stack.*, got 'piezo'"):
        actuator("piezo")


def test_the_kind_of_actuator_is_that_of_the_rig_file_or_else_the_default() -> None:
    assert kind_of_rig(Rig(plant="piezo-stack"), "eha").name == "piezo-stack"
    assert kind_of_rig(Rig(), "diaphragm-motor").name == "diaphragm-motor"


def test_a_kind_that_is_registered_under_another_name_than_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(actuators, "ACTUATORS", {"mine": "experiments.eha.kind:EHA"})
    with pytest.raises(HydrostateError, match="must be called 'mine', as it is registered, got 'eha'"):
        actuator("mine")


def test_a_verb_that_a_kind_does_not_offer_is_refused_by_both_names() -> None:
    kind = replace(actuator("piezo-stack"), estimate=None)
    assert verb_of_kind(kind, "diagnose") is kind.diagnose
    with pytest.raises(HydrostateError, match="estimate is not available for piezo-stack, "):
        verb_of_kind(kind, "estimate")


def test_the_columns_of_a_log_determine_its_kind_of_actuator() -> None:
    stack = ("time_s", "drive_voltage_v", "position_m", "chamber_pressure_pa")
    assert kinds_by_columns(stack) == ("piezo-stack",)
    assert kinds_by_columns(("motor_speed_rad_s", "position_m", *stack)) == ("eha",)
    assert kinds_by_columns(("time_s", "speed")) == ()


def test_columns_of_several_kinds_are_refused_with_the_option_that_names_one() -> None:
    both = NoChannelError("column motor_speed_rad_s is missing", "run.csv", "; more", ("drive_voltage_v", "position_m"))
    with pytest.raises(NoChannelError, match="columns of piezo-stack or diaphragm-motor: name the kind with --plant"):
        infer_kind(both, None, None)
    stack = NoChannelError("column motor_speed_rad_s is missing", "run.csv", "", ("drive_voltage_v", "stack_force_n"))
    assert infer_kind(stack, None, None) == "piezo-stack"
    with pytest.raises(NoChannelError, match=r"is missing$"):
        infer_kind(stack, "eha", None)
