"""Reasons against a diagnosis of the diaphragm motor."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.diaphragm_motor.finding import MotorCode
from estimation.finding import Outcome
from faults.diaphragm_motor import finding
from faults.diaphragm_motor.diagnose import Match
from faults.diaphragm_motor.faults import HEALTHY, MOTOR_FAULTS
from faults.diaphragm_motor.finding import (
    STANDSTILL_VELOCITY,
    MotorFaultCode,
    _objections,
    _remedy,
    motor_fault_finding,
)


def diagnosis(velocity: float, *, unknown: bool, delay: float | None = None) -> Any:
    best = SimpleNamespace(name="valve_1_leak", chi_square=40.0)
    signature = SimpleNamespace(velocity=velocity)
    return SimpleNamespace(unknown=unknown, best=best, freedom=12, signature=signature, delay=delay)


@pytest.mark.parametrize("velocity", [2.0 * STANDSTILL_VELOCITY, -2.0 * STANDSTILL_VELOCITY])
def test_a_moving_rod_with_a_fitting_fault_has_no_objection(velocity: float) -> None:
    assert _objections(diagnosis(velocity, unknown=False)) == ()


def test_a_poorly_fitting_nearest_fault_and_a_stationary_rod_are_objections() -> None:
    misses, stands = _objections(diagnosis(-0.5 * STANDSTILL_VELOCITY, unknown=True))
    assert misses == MotorFaultCode.NEAREST_MISSES.note(fault="valve 1 leak", chi_square=40.0, freedom=12)
    assert stands.code is MotorFaultCode.ROD_STANDS
    assert stands.data["velocity_mm_s"] == pytest.approx(-500.0 * STANDSTILL_VELOCITY)


@pytest.mark.parametrize(("delay", "side"), [(4e-5, "40 us behind the drive"), (-4e-5, "40 us ahead of the drive")])
def test_electrodes_that_are_late_or_early_are_an_objection_with_their_delay(delay: float, side: str) -> None:
    _, shifted = _objections(diagnosis(1.0, unknown=True, delay=delay))
    assert shifted.code is MotorFaultCode.ELECTRODES_SHIFTED
    assert side in str(shifted)


MATCHES = {name: Match(name, 0.5, 0.1, 9.0, 0.3) for name in (HEALTHY, "friction", "valve_1_leak", "load")}


@pytest.mark.parametrize(
    ("group", "unknown", "alike", "names", "measured", "others"),
    [
        ((HEALTHY,), False, (), [], [], "load"),
        (("friction", HEALTHY), False, (HEALTHY,), ["friction"], ["friction"], "load"),
        ((HEALTHY, "friction"), False, ("friction",), ["friction"], [], "load"),
        (("valve_1_leak", "load"), False, ("load",), ["valve 1 leak", "load"], ["valve_1_leak"], ""),
        (("friction", "valve_1_leak"), True, ("valve_1_leak",), [], [], ""),
    ],
)
def test_a_finding_names_the_group_of_nearest_faults_and_quantifies_the_first(
    group: tuple[str, ...],
    unknown: bool,
    alike: tuple[str, ...],
    names: list[str],
    measured: list[str],
    others: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    matches = tuple(MATCHES[name] for name in group)
    found = SimpleNamespace(
        **vars(diagnosis(1.0, unknown=unknown))
        | {"best": matches[0], "group": matches, "matches": tuple(MATCHES.values()), "lookalikes": (group[0], "load")}
    )
    monkeypatch.setattr(finding, "diagnose_motor", lambda *_, **__: found)
    said: Any = motor_fault_finding(None, None)  # type: ignore[arg-type]
    assert (said.condition, said.alike, list(said.quantities)) == (group[0], alike, measured)
    assert [note.data["fault"] for note in said.faults] == names
    assert all(
        (note.data["severity"], note.data["unit"]) == (0.5, " N") for note in said.faults[:1] if "fr" in names[0]
    )
    assert said.probabilities == dict.fromkeys(MATCHES, 0.3)
    assert (said.outcome, said.gate.passed, bool(said.against)) == (
        (Outcome.MISMATCH, False, True) if unknown else (Outcome.OK, True, False)
    )
    told = {"friction": "rod seals", "valve 1 leak": "clean valve 1 and its seat", "load": "--load"}
    assert all(told[name] in str(note) for name, note in zip(names, said.advice, strict=True))
    assert [note.data["faults"] for note in said.not_told if note.code is MotorFaultCode.LOOKS_LIKE] == (
        [others] if others else []
    )
    assert [note.code for note in said.not_told if not unknown][-1:] == ([] if unknown else [MotorCode.AS_DESIGNED])
    calibrated: Any = motor_fault_finding(None, None, calibration=SimpleNamespace())  # type: ignore[arg-type]
    assert MotorCode.AS_DESIGNED not in [note.code for note in calibrated.not_told]
    for one in said.quantities.values():
        assert (one.value, one.ci95) == (0.5, pytest.approx((0.5 - 0.196, 0.5 + 0.196), abs=1e-4))


def test_every_kind_of_fault_has_its_own_remedy_with_its_location() -> None:
    remedies = {fault.kind: _remedy(Match(name, 0.5, 0.1, 9.0, 0.3)) for name, fault in MOTOR_FAULTS.items()}
    assert len({note.code for note in remedies.values()}) == len(remedies)
    assert {kind: str(note) for kind, note in remedies.items() if kind in {"valve_blocked", "gas", "slow_valves"}} == {
        "valve_blocked": "clean valve 8 and its port",
        "gas": "bleed chamber 7, then find where gas gets in",
        "slow_valves": "check the valves for dirt, and the oil for its viscosity",
    }
