"""Effects of conditions and severities on an actuator, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS, HIGHEST_SEVERITY, parameters_for, severity
from faults.scores import accuracy, confusion_matrix
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from tests.edges import edge
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = EhaParameters()
LARGE = replace(PAPER, piston_area=4e-3, pump_displacement=2e-6, friction_coulomb=900.0, leakage_coefficient=9e-12)
SMOOTH = replace(LARGE, friction_coulomb=0.0, friction_linear=0.0, friction_quadratic=0.0)
CHANGED = ("leakage_coefficient", "flow_bias", "friction_quadratic", "friction_linear", "friction_coulomb")


def changed(p: EhaParameters) -> dict[str, float]:
    return {name: asdict(p)[name] for name in CHANGED}


@NUMBERS.case()
def conditions_and_severities() -> dict[str, Any]:
    def refused(one: float) -> bool:
        try:
            severity(one, 0.0)
        except HydrostateError:
            return True
        return False

    return {
        **{name: changed(parameters_for(condition)) for name, condition in CONDITIONS.items()},
        **{
            f"{name}, of a large rig": changed(parameters_for(condition, LARGE))
            for name, condition in CONDITIONS.items()
        },
        "of a rig that needs no pressure": changed(severity(1.0, 2.0, SMOOTH)),
        "between and beyond": [
            changed(severity(*one)) for one in ((0.0, 0.0), (0.3, 1.0), (1.0, 0.6), (1.7, 1.2), (2.0, 2.5), (4.9, 3.0))
        ],
        "severities to": edge(refused, 0.5, 9.0),
        "highest": HIGHEST_SEVERITY,
        "refused": [refused(one) for one in (-1e-9, 0.0, np.nan, np.inf)],
    }


@NUMBERS.case()
def confusions() -> dict[str, Any]:
    found = confusion_matrix(
        ["normal", "normal", "minor_leakage", "minor_leakage"],
        ["normal", "minor_leakage", "minor_leakage", "minor_leakage"],
    )
    return {"counts": found.to_numpy()[:3, :3], "accuracy": accuracy(found), "names": list(found.columns)}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
