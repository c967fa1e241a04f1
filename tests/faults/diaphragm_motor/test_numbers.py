"""Effects of faults of the diaphragm motor, and the comparison of logs with them, kept in `numbers.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.diaphragm_motor.signature import Drive, Signature, modelled_signature, tolerance
from faults.diaphragm_motor import diagnose, finding
from faults.diaphragm_motor.diagnose import Match, MotorDiagnosis, diagnose_signature, separations
from faults.diaphragm_motor.faults import MOTOR_FAULTS, motor_with_fault
from faults.diaphragm_motor.finding import severity_of
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
MOTOR = DiaphragmMotorParameters()
DRIVE = Drive(480.0, 200.0, 0.3)


def signature(motor: DiaphragmMotorParameters, size: float = 1.0, frequency: float = 480.0) -> Signature:
    rng = np.random.default_rng(3)
    values = modelled_signature(motor, 480.0, 200.0)
    spread = 1e-4 * np.abs(values) + 1e-6
    return Signature(
        replace(DRIVE, frequency=frequency), values + size * spread * rng.standard_normal(29), np.diag(spread**2)
    )


@NUMBERS.case()
def motors_with_faults() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, fault in MOTOR_FAULTS.items():
        severe = 0.4 * fault.severities[-1]
        value = getattr(motor_with_fault(MOTOR, name, severe), fault.parameter)
        told[name] = {
            "kind": fault.kind,
            "place": fault.place,
            "severities": list(fault.severities),
            "unit": fault.unit,
            "value": value,
        }
    told["beyond"] = [
        isinstance(or_refused(lambda one=one: motor_with_fault(MOTOR, "load", one)), str)
        for one in (-15.1, -15.0, 18.0, 18.1)
    ]
    return told


def told_of(found: MotorDiagnosis) -> dict[str, Any]:
    return {
        "best": [found.best.name, found.best.severity, found.best.deviation, found.best.chi_square],
        "interval": list(found.best.interval),
        "probabilities": {one.name: one.probability for one in found.matches if one.probability > 1e-6},
        "chi-squares": {one.name: one.chi_square for one in found.matches},
        "deviations": {one.name: one.deviation for one in found.matches},
        "group": [one.name for one in found.group],
        "unknown": found.unknown,
        "freedom": found.freedom,
        "lookalikes": list(found.lookalikes),
    }


@NUMBERS.case(relative=1e-3)
def signatures_beside_their_curves() -> dict[str, Any]:
    motors = {
        "healthy": MOTOR,
        "a leaking valve": motor_with_fault(MOTOR, "valve_4_leak", 0.12),
        "gas": motor_with_fault(MOTOR, "gas_everywhere", 0.007),
        "a load": motor_with_fault(MOTOR, "load", -5.0),
        "two faults": motor_with_fault(
            motor_with_fault(MOTOR, "diaphragm_2_depolarised", 0.7), "diaphragm_6_depolarised", 0.8
        ),
    }
    return {name: told_of(diagnose_signature(signature(one), MOTOR)) for name, one in motors.items()}


@NUMBERS.case(relative=1e-3)
def where_verdicts_turn() -> dict[str, Any]:
    off = np.zeros(29)
    off[17] = 1.0

    def bent(size: float) -> bool:
        seen = signature(MOTOR, 0.0)
        return diagnose_signature(replace(seen, values=seen.values + size * off), MOTOR).unknown

    def healthy(severity: float) -> bool:
        return (
            diagnose_signature(signature(motor_with_fault(MOTOR, "soft_clamp", severity), 0.0), MOTOR).best.name
            == "healthy"
        )

    match = [
        Match(name, 1.0, 0.1, 20.0, share)
        for name, share in (("load", 0.6), ("friction", 0.05), ("slow_valves", 0.049))
    ]
    made = MotorDiagnosis(tuple(match), False, 28, signature(MOTOR), np.zeros(29), ())

    def against(velocity: float) -> int:
        values = np.append(np.zeros(28), velocity)
        return len(finding._objections(replace(made, signature=replace(made.signature, values=values))))  # pyright: ignore[reportPrivateUsage]

    return {
        "unknown from [V]": edge(bent, 1e-4, 3.0, 12),
        "no longer healthy from": edge(healthy, 0.0, 0.3, 10),
        "named together": [one.name for one in made.group],
        "standing from [m/s]": edge(against, 1e-6, 1e-2),
        "unknown is said": len(finding._objections(replace(made, unknown=True))),  # pyright: ignore[reportPrivateUsage]
        "said": [dict(finding._fault_note(one).data) for one in match[:2]],  # pyright: ignore[reportPrivateUsage]
        "severity": [severity_of(match[0]).value, severity_of(match[0]).std, severity_of(match[0]).unit],
    }


@NUMBERS.case(relative=1e-3)
def calibrated_signatures() -> dict[str, Any]:
    own = replace(
        MOTOR,
        sensor_gain=tuple(1.0 + 0.02 * k for k in range(7)),
        diaphragm_compliance=1.01 * MOTOR.diaphragm_compliance,
    )
    healthy, worn = signature(own), signature(motor_with_fault(own, "valve_4_leak", 0.1))
    of = diagnose._converted_to_model  # pyright: ignore[reportPrivateUsage]
    found = of(worn, healthy, MOTOR)

    def refused(frequency: float = 480.0, swing: float = 200.0, tone: float = 1.0) -> bool:
        other = replace(
            healthy,
            drive=Drive(frequency, swing, 0.0),
            values=np.where(np.arange(29) % 7 == 2, tone * healthy.values, healthy.values),
        )
        return isinstance(or_refused(lambda: of(worn, other, MOTOR)), str)

    return {
        "values": found.values,
        "deviations": np.sqrt(np.diag(found.covariance)),
        "frequency to [Hz]": edge(lambda one: refused(480.0 + one), 0.0, 20.0),
        "swing to [V]": edge(lambda one: refused(480.0, 200.0 - one), 0.0, 20.0),
        "least tone": edge(lambda one: refused(tone=one), 1e-3, 1.0),
        "point": list(diagnose._operating_point(replace(worn, drive=Drive(479.9964, 199.967, 0.0)))),  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case(relative=1e-3)
def faults_that_are_told_apart() -> dict[str, Any]:
    apart = separations(MOTOR, 480.0, 200.0, {"load": 6.0, "soft_clamp": 0.1})
    return {
        name: {other: one for k, (other, one) in enumerate(far.items()) if k % 5 == 0 or other == "healthy"}
        for name, far in apart.items()
    } | {
        "tolerance": np.sqrt(np.diag(tolerance(MOTOR, 480.0, 200.0)))[[0, 3, 20, 28]],
        "nearest to healthy": edge(
            lambda one: min(separations(MOTOR, 480.0, 200.0, {"gas_everywhere": one})["gas_everywhere"].values()) > 0.3,
            1e-5,
            0.01,
            6,
        ),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
