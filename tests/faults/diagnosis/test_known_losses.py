"""Severities with the leakage from the flow balance, which does not depend on the seals."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import Gate, Outcome, Quantity
from estimation.fits.hypothesis_search.explanation import Explanation
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.known_losses import known_losses, with_balance_severities
from faults.diagnosis.severity import severities
from faults.notes import ClassCode
from plant.log.record import Record
from tests.faults.diagnosis.test_known_friction import WHOLE
from tests.faults.diagnosis.test_known_friction import record as sliding
from tests.faults.diagnosis.test_severity import ACTUATOR, NARROW, RIG, extent, fits

HEALTHY = RIG.friction_coulomb + RIG.friction_linear * ACTUATOR.rated + RIG.friction_quadratic * ACTUATOR.rated**2
NOTHING = Record(1e-3, {"motor_speed_rad_s": np.zeros(9)})
LEAKAGE, BIAS = 1.02 * RIG.leakage_coefficient, 0.99 * RIG.flow_bias


def estimate(**changed: Any) -> BulkModulusEstimate:
    one = BulkModulusEstimate(
        outcome=Outcome.OK,
        value=2e8,
        std=1e5,
        bound=1e-3,
        gate=Gate(True, ()),
        form="flow",
        channels=(),
        nis={},
        others={"leakage_coefficient": (LEAKAGE, 1e-3 * LEAKAGE), "flow_bias": (BIAS, 1e-3 * BIAS)},
        correlation=-0.9,
    )
    return replace(one, **changed)


def diagnosis(**changed: Any) -> Diagnosis:
    known, told_by = fits(NARROW), partial(severities, fits(NARROW), ACTUATOR, {}, ())
    whole = {
        "onset": None,
        "drift": None,
        "blocks": SimpleNamespace(leakage_course=None, earlier_circuit=None),
    } | changed
    board = cast(Any, SimpleNamespace(fits=known, **whole))
    return Diagnosis({}, (), told_by(None, None), {}, {}, (), board, told_by)


def explained(**delays: float) -> Explanation:
    return Explanation(("made up",), {}, delays, (), (), 1e6)


def told(one: Diagnosis, by: BulkModulusEstimate, log: Record = NOTHING) -> Diagnosis:
    return with_balance_severities(one, by, log, RIG)


def test_leakage_is_that_of_the_flow_balance_and_friction_that_of_the_circuit() -> None:
    circuit, found = diagnosis().severity, told(diagnosis(), estimate()).severity
    assert found["leakage_flow"].value == pytest.approx(6e4 * (LEAKAGE * RIG.relief_pressure + BIAS))
    assert extent(found["leakage_flow"]) < 0.1 * extent(circuit["leakage_flow"])
    assert extent(found["velocity_lost"]) < extent(circuit["velocity_lost"])
    assert found["added_friction"].ci95 == pytest.approx(circuit["added_friction"].ci95, rel=0.2)
    assert found["added_friction"].value == circuit["added_friction"].value


def test_friction_is_that_of_the_force_balance_if_it_is_more_accurate() -> None:
    circuit, forces = told(diagnosis(), estimate()).severity, told(diagnosis(), estimate(), sliding()).severity
    assert forces["added_friction"].value == pytest.approx(WHOLE - HEALTHY, abs=20.0)
    assert extent(forces["added_friction"]) < 0.5 * extent(circuit["added_friction"])
    assert extent(forces["pressure_rise"]) < 0.5 * extent(circuit["pressure_rise"])
    assert forces["leakage_flow"] == circuit["leakage_flow"]


def test_the_force_balance_gives_friction_beside_another_cause_but_not_with_late_pressure() -> None:
    circuit = diagnosis().severity
    found = told(diagnosis(), estimate(explanation=explained()), sliding()).severity
    assert found["added_friction"].value == pytest.approx(WHOLE - HEALTHY, abs=20.0)
    assert found["leakage_flow"] == circuit["leakage_flow"]
    late = explained(differential_pressure_pa=2e-3)
    assert told(diagnosis(), estimate(explanation=late), sliding()).severity == circuit


def test_the_circuits_friction_is_kept_if_the_force_balance_has_no_steady_state() -> None:
    one = diagnosis()
    assert one.severities_given is not None
    by_circuit = one.severities_given

    def without(losses: Any, rubbing: Any) -> Any:
        found = dict(by_circuit(losses, rubbing))
        return found if rubbing is None else found | {"velocity_lost": Quantity(None, "%")}

    found = told(replace(one, severities_given=without), estimate(), sliding()).severity
    assert found == by_circuit(known_losses(estimate()), None)


def test_notes_from_other_sources_than_the_circuit_are_kept() -> None:
    of_the_pump = ClassCode.WEAR_NOT_TOLD.note(percent=5.0, limit=90.0)
    assert told(replace(diagnosis(), not_told=(of_the_pump,)), estimate()).not_told == (of_the_pump,)


@pytest.mark.parametrize(
    "changed",
    [
        {"form": "motion"},
        {"outcome": Outcome.MISMATCH},
        {"gate": Gate(False, ())},
        {"explanation": explained()},
        {"others": {}},
        {"others": {"leakage_coefficient": (LEAKAGE, np.inf), "flow_bias": (BIAS, 1e-3 * BIAS)}},
    ],
)
def test_a_flow_balance_that_is_refused_or_needs_another_cause_gives_no_leakage(changed: dict[str, Any]) -> None:
    assert known_losses(estimate(**changed)) is None
    assert told(one := diagnosis(), estimate(**changed)) is one


@pytest.mark.parametrize("changed", [{"onset": object()}, {"drift": object()}])
def test_the_flow_balance_does_not_replace_a_leakage_that_changes_within_the_log(changed: dict[str, Any]) -> None:
    assert told(one := diagnosis(**changed), estimate()) is one


def test_a_flow_balance_less_accurate_than_the_circuit_changes_no_severity() -> None:
    open_by = {"leakage_coefficient": (LEAKAGE, 0.5 * LEAKAGE), "flow_bias": (BIAS, 0.5 * BIAS)}
    assert told(one := diagnosis(), estimate(others=open_by)) is one
