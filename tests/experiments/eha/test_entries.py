"""Findings as entries: the keys that each log has whatever the outcome, and notes as codes with data."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.estimate import estimate_log
from estimation.finding import Finding, Gate, Outcome, Quantity
from estimation.notes import EstimateCode, RigCode, SensorCode
from experiments.command.json_output import plain
from experiments.eha.entries import (
    COST_CODES,
    NO_CLASS_CODES,
    NO_DIAGNOSIS,
    NO_ESTIMATE,
    costs,
    diagnosis_entries,
    estimate_entries,
)
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.notes import Code
from plant.sensors.faults import SensorFault, with_fault
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

PRESSURE = "differential_pressure_pa"
ALWAYS = {"outcome", "message", "warnings"}
TOLD_BY_THE_VERB = {"condition"}
"""An input of estimate, which is no part of its finding."""


@cache
def log(condition: str = "minor_leakage", duration: float = 3.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive("steps", duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


@cache
def diagnosed() -> Finding:
    return diagnose_log(log(), Rig())


@cache
def diagnosed_at_rest() -> Finding:
    return diagnose_log(at_rest(), Rig())


def at_rest() -> Record:
    rng, n = np.random.default_rng(1), 500
    return Record(1e-3, {"motor_speed_rad_s": np.zeros(n), "velocity_m_s": rng.normal(0.0, 1e-3, n)})


def codes(entries: dict[str, object]) -> list[str]:
    return [note["code"] for note in entries["notes"]]


def test_the_codes_in_the_tables_of_entries_exist() -> None:
    known: set[Code] = {*EstimateCode, *ClassCode}
    assert set(COST_CODES) | set(NO_CLASS_CODES) <= {str(code) for code in known}


def test_an_estimate_has_exactly_the_documented_entries() -> None:
    entries = estimate_entries(estimate_log(log(), Rig()))
    assert set(entries) | TOLD_BY_THE_VERB == set(NO_ESTIMATE) | ALWAYS
    assert set(entries["bulk_modulus_pa"]) == {"value", "std", "ci95", "ci95_total"}
    assert set(entries["states"]) == {"leakage_coefficient", "flow_bias"}
    assert entries["leakage_coefficient_m3_s_pa"] == entries["states"]["leakage_coefficient"]
    assert entries["gate"] == {"passed": True, "reasons": []}
    assert (entries["warnings"], codes(entries)) == ([], [EstimateCode.KNOWN_AS_THE_RIG])
    low, high = entries["bulk_modulus_pa"]["ci95"]
    least, most = entries["bulk_modulus_pa"]["ci95_total"]
    assert least < low < high < most
    assert f"{1e-6 * least:.0f} to {1e-6 * most:.0f} MPa with rig error" in entries["message"]


@pytest.mark.parametrize(
    ("channel", "refused"), thinned([("velocity_m_s", False), (PRESSURE, True)], [("velocity_m_s", False)])
)
def test_a_note_of_a_frozen_sensor_is_a_code_with_data_in_json(channel: str, *, refused: bool) -> None:
    record = log(duration=1.0)
    values = record[channel].copy()
    values[500:] = values[500]
    found = diagnose_log(record.replace(**{channel: values}), Rig())
    entries = diagnosis_entries(found)
    written = json.loads(json.dumps(plain(entries), allow_nan=False))
    froze = next(note for note in written["notes"] if note["code"] == SensorCode.SENSOR_FROZE)
    assert froze["data"]["channel"] == channel
    assert froze["data"]["begin_s"] == pytest.approx(0.5)
    assert froze["text"] == str(SensorCode.SENSOR_FROZE.note(**froze["data"]))
    # a wrong velocity is left out, and the class stands
    for reasons in (written["reasons"], written["gate"]["reasons"]):
        assert (froze["text"] in reasons) == refused
    assert (froze["text"] in written["warnings"]) != refused
    assert len(written["notes"]) == len(found.all_notes)
    assert (AdviceCode.CHECK_SENSOR in codes(entries)) == refused


def test_a_diagnosis_has_exactly_the_documented_entries() -> None:
    entries = diagnosis_entries(diagnosed())
    assert set(entries) == set(NO_DIAGNOSIS) | ALWAYS
    assert (entries["condition"], entries["unknown"]) == ("minor_leakage", False)
    for one in entries["severity"].values():
        assert set(one) == {"value", "unit", "ci95", "ci95_total"}
    modulus, severity = entries["bulk_modulus_pa"], entries["severity"]["bulk_modulus"]
    assert list(modulus["ci95_total"]) == severity["ci95_total"]
    assert EstimateCode.KNOWN_AS_THE_RIG in codes(entries)


def test_a_log_at_rest_has_no_condition_and_the_reason_is_in_its_message() -> None:
    entries = diagnosis_entries(diagnosed_at_rest())
    assert (entries["outcome"], entries["condition"], entries["runner_up"]) == ("not_observable", None, None)
    assert (entries["unknown"], entries["reasons"], entries["advice"]) == (None, [], [])
    assert entries["message"] == str(ClassCode.MODELS_ALIKE.note())
    assert entries["warnings"] == []
    assert ClassCode.MODELS_ALIKE in codes(entries)
    assert "probabilities" not in entries


NO_CIRCUIT = Rig("no circuit", replace(EhaParameters(), relief_pressure=1e9))


def test_a_rig_without_a_possible_circuit_gets_a_condition_without_probabilities() -> None:
    found = diagnose_log(log(), NO_CIRCUIT)
    entries = diagnosis_entries(found)
    assert set(entries) <= set(NO_DIAGNOSIS) | ALWAYS
    assert (entries["outcome"], entries["condition"], entries["unknown"]) == ("ok", "minor_leakage", False)
    assert "probabilities" not in entries
    assert "severity" not in entries
    (why,) = [note for note in entries["notes"] if note["code"] == ClassCode.NO_CIRCUIT]
    assert "accumulator_oil must fill both chambers" in why["data"]["reason"]
    assert entries["warnings"] == [why["text"]]
    assert (entries["reasons"], entries["advice"]) == ([], [])
    assert entries["bulk_modulus_pa"]["value"] == pytest.approx(2.07e8, rel=0.01)


def test_without_a_circuit_a_frozen_sensor_also_makes_the_condition_unknown() -> None:
    frozen = with_fault(log(), SensorFault(channel="position_m", kind="freeze", start=1.5))
    entries = diagnosis_entries(diagnose_log(frozen, NO_CIRCUIT))
    assert entries["unknown"]
    assert entries["message"].startswith("UNKNOWN")
    assert codes(entries).count(SensorCode.SENSOR_FROZE) == 1
    assert entries["advice"] == [str(AdviceCode.CHECK_SENSOR.note(channels="position_m"))]


def test_a_log_too_short_for_a_circuit_has_scores_but_no_class_and_says_how_long_it_must_be() -> None:
    entries = diagnosis_entries(diagnose_log(log("major_leakage").slice(0, 190), Rig()))
    assert list(entries["scores"]) == list(CONDITIONS)
    assert (entries["condition"], entries["unknown"], entries["outcome"]) == (None, None, "not_observable")
    assert entries["message"].startswith("no class: the log lasts 0.189 s, but a diagnosis needs 0.2 s or more")
    assert "probabilities" not in entries
    assert entries["message"] not in entries["warnings"]


def test_outliers_left_out_of_a_log_are_a_warning_of_its_diagnosis() -> None:
    velocity = log()["velocity_m_s"].copy()
    velocity[::150] += 1.0
    entries = diagnosis_entries(diagnose_log(log().replace(velocity_m_s=velocity), Rig()))
    left_out = SensorCode.OUTLIERS_LEFT_OUT.note(channel="velocity_m_s", count=20, total=3000)
    assert entries["warnings"] == [str(left_out)]
    assert (entries["condition"], entries["unknown"]) == ("minor_leakage", False)


def test_the_cost_of_a_missing_channel_is_noted_once_for_all_logs() -> None:
    entries = diagnosis_entries(diagnose_log(log().replace(position_m=None, **{PRESSURE: None}), Rig()))
    assert ClassCode.PRESSURE_ABSENT_CLASS in codes(entries)
    assert str(ClassCode.PRESSURE_ABSENT_CLASS.note()) not in entries["warnings"]
    sound = diagnosis_entries(diagnosed())
    said = costs([entries, sound, entries])
    assert f"2 of 3 logs: {ClassCode.PRESSURE_ABSENT_CLASS.note()}" in said
    assert f"note: {ClassCode.PRESSURE_ABSENT_CLASS.note()}" in costs([entries])


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"piston_area": 2.0}, True),
        ({"pump_displacement": 0.8}, True),
        ({"piston_area": 2.0, "friction_coulomb": 2.0}, False),
        ({"piston_area": 1.05, "pump_displacement": 1.05}, False),
        ({"chamber_volume": 2.0}, False),
    ],
)
def test_a_rig_of_another_size_with_the_papers_leakage_and_friction_is_noted(
    changed: dict[str, float], *, said: bool
) -> None:
    paper = EhaParameters()
    rig = Rig(parameters=replace(paper, **{name: factor * getattr(paper, name) for name, factor in changed.items()}))
    entries = diagnosis_entries(diagnose_log(at_rest(), rig))
    assert (ClassCode.HEALTHY_OF_THE_PAPER in codes(entries)) == said
    assert any(str(ClassCode.HEALTHY_OF_THE_PAPER.note()) in line for line in costs([entries])) == said


def test_a_rig_entry_that_limits_several_logs_is_named_once() -> None:
    found = [estimate_entries(estimate_log(log(condition), Rig())) for condition in ("normal", "major_leakage")]
    (said,) = costs(found)
    assert said.startswith("2 of 2 logs: measure chamber_volume, and list it under measured")


def test_nominal_models_that_do_not_fit_a_log_make_its_condition_unknown() -> None:
    odd = log().replace(velocity_m_s=0.2 * log()["velocity_m_s"], position_m=None, **{PRESSURE: 5.0 * log()[PRESSURE]})
    found = diagnose_log(odd, Rig())
    assert found.unknown
    (none_fits,) = (note for note in found.against if note.code == AgainstCode.NONE_FITS)
    assert none_fits.data["percent"] > 50.0


def test_the_message_of_a_log_without_a_condition_names_the_frozen_sensor_first() -> None:
    found = diagnosed_at_rest()
    froze = SensorCode.SENSOR_FROZE.note(channel=PRESSURE, value=4e5, begin_s=1.0, length_s=3.0)
    entries = diagnosis_entries(replace(found, gate=replace(found.gate, passed=False, reasons=(froze,))))
    assert entries["condition"] is None
    assert entries["message"] == f"{froze}; {diagnosis_entries(found)['message']}"
    assert "no class: " in diagnosis_entries(found)["message"]


@pytest.mark.parametrize("pressure", [True, False])
def test_the_advice_to_log_differential_pressure_appears_only_if_it_was_not_used(pressure: bool) -> None:
    found = estimate_log(log(), Rig("rig", EhaParameters()))
    unseen = replace(
        found,
        outcome=Outcome.NOT_OBSERVABLE,
        quantities={**found.quantities, "bulk_modulus": Quantity(None, "Pa")},
        channels=found.channels if pressure else ("velocity_m_s",),
    )
    message = estimate_entries(unseen)["message"]
    assert ("Log differential pressure" in message) is not pressure
    assert "larger, slower steps" in message


def test_another_drive_is_not_recommended_if_the_model_does_not_describe_the_log() -> None:
    """The bound of a fit that leaves 6.6 times the noise says little; the cause was a shifted zero of pressure."""
    found = estimate_log(log(), Rig("rig", EhaParameters()))
    large = EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=6.6)
    wide = EstimateCode.BOUND_TOO_WIDE.note(percent=8.0)
    unseen = replace(
        found,
        outcome=Outcome.NOT_OBSERVABLE,
        quantities={**found.quantities, "bulk_modulus": Quantity(None, "Pa")},
        gate=Gate(passed=False, reasons=(wide, large)),
    )
    message = estimate_entries(unseen)["message"]
    assert "the model does not describe the log" in message
    assert str(large) in message
    assert "slower steps" not in message


def test_a_dead_sensor_is_not_reported_as_a_model_mismatch() -> None:
    """Before, estimate said "the model does not describe the log" when the only objection was a dead sensor."""
    found = estimate_log(log(), Rig("rig", EhaParameters()))
    dead = SensorCode.SENSOR_NOISE_ONLY.note(channel=PRESSURE, noise=4e3)
    refused = replace(
        found,
        outcome=Outcome.MISMATCH,
        quantities={**found.quantities, "bulk_modulus": Quantity(None, "Pa")},
        gate=Gate(passed=False, reasons=(dead,)),
    )
    assert estimate_entries(refused)["message"] == f"no value of bulk modulus: {dead}"


def test_a_wrong_volume_in_the_rig_file_is_named_instead_of_another_drive() -> None:
    found = estimate_log(log(), Rig("rig", EhaParameters()))
    differs = RigCode.VOLUME_DIFFERS.note(percent=53.0, half_width=5.0)
    unseen = replace(
        found,
        outcome=Outcome.NOT_OBSERVABLE,
        quantities={**found.quantities, "bulk_modulus": Quantity(None, "Pa")},
        notes=(*found.notes, differs),
    )
    message = estimate_entries(unseen)["message"]
    assert "53.0 ± 5.0 % of that in the rig file; correct chamber_volume" in message
    assert "slower steps" not in message


def test_a_piston_at_rest_is_the_reason_for_a_missing_bulk_modulus() -> None:
    """Before, the reason was a Cramér-Rao bound over 3 %; it is 0.4 %, and with a resting pump none was calculated."""
    rng, p = np.random.default_rng(8), replace(EhaParameters(), friction_coulomb=1e6)
    seized = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    resting = {name: np.zeros(len(seized)) for name in ("motor_speed_rad_s", "position_m")}
    logs = seized.replace(motor_speed_rad_s=seized["motor_speed_rad_s"] / 6.28), seized.replace(**resting)
    for one, reason in zip(logs, (EstimateCode.STILL_AND_FOREIGN, EstimateCode.PUMP_AND_PISTON_REST), strict=True):
        entries = estimate_entries(estimate_log(one, Rig()))
        assert entries["outcome"] == Outcome.NOT_OBSERVABLE
        assert reason in [note["code"] for note in entries["notes"]]
        assert "Cramér-Rao" not in entries["message"]
