"""Kinds of actuators: found by name or by a plant of theirs, and refused where they are registered wrongly."""

from dataclasses import replace

import pytest

from experiments import actuators
from experiments.actuators import actuator, offered
from plant.errors import HydrostateError


def test_a_kind_is_found_by_its_name_and_by_each_of_its_plants() -> None:
    assert {actuator(name).name for name in ("eha", "lumped", "circuit", "reduced")} == {"eha"}
    with pytest.raises(HydrostateError, match=r"--plant must be one of .*piezo-stack.*, got 'piezo'"):
        actuator("piezo")


def test_a_kind_that_is_registered_under_another_name_than_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(actuators, "ACTUATORS", {"mine": "experiments.eha.kind:EHA"})
    with pytest.raises(HydrostateError, match="must be called 'mine', as it is registered, got 'eha'"):
        actuator("mine")


def test_a_verb_that_a_kind_does_not_offer_is_refused_by_both_names() -> None:
    kind = replace(actuator("piezo-stack"), estimate=None)
    assert offered(kind, "diagnose") is kind.diagnose
    with pytest.raises(HydrostateError, match="estimate is not there for piezo-stack, "):
        offered(kind, "estimate")
