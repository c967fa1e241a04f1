"""Why the class of a log may be unknown, and what is reported instead: each reason, on short logs."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate, wide_bound_note, without_number
from estimation.finding import Finding, Gate, Outcome
from estimation.log_checks.clean import clean_log
from estimation.log_checks.notes import LoggerCode
from estimation.notes import ChannelCode, EstimateCode, RigCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis import by_circuits, corrected_case, diagnose, known_losses
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.models_verdict import ranked_conditions
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.errors import RigError
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
RIG = Rig("paper", HEALTHY)
PRESSURE = "differential_pressure_pa"


@cache
def log(condition: str = "minor_leakage", duration: float = 2.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive("steps", duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def codes(found: Finding) -> set[object]:
    return {note.code for note in found.notes}


@cache
def plain() -> Finding:
    return diagnose_log(log(), RIG)


def test_a_plain_log_has_its_class_and_no_objection() -> None:
    found = plain()
    assert (found.outcome, found.condition, found.unknown) == (Outcome.OK, "minor_leakage", False)
    assert found.against == ()
    assert found.probabilities is not None
    assert found.severities["bulk_modulus"] == found.quantities["bulk_modulus"]


@pytest.mark.parametrize("rows", thinned([2, 5], [5]))
def test_the_model_is_averaged_as_a_pressure_was_by_its_logger(rows: int) -> None:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(8)
    record = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    pressure = np.concatenate([np.full(rows - 1, record[PRESSURE][0]), record[PRESSURE]])
    averaged = np.convolve(pressure, np.ones(rows) / rows, "valid")
    found = diagnose_log(record.replace(**{PRESSURE: averaged}), RIG)
    assert (found.outcome, found.condition, found.unknown) == (Outcome.OK, "minor_leakage", False)
    assert found.quantities["bulk_modulus"].value == pytest.approx(HEALTHY.bulk_modulus, rel=0.005)
    assert ClassCode.ONE_SCALE not in {note.code for note in found.all_notes}  # pressure contributes
    assert [note.data["rows"] for note in found.all_notes if note.code == LoggerCode.AVERAGED] == [rows]
    assert RigCode.PRESSURE_LATE not in {note.code for note in found.all_notes}


def test_circuits_are_fitted_to_the_speed_without_its_offset() -> None:
    speed = log()["motor_speed_rad_s"]
    found, sound = diagnose_log(log().replace(motor_speed_rad_s=speed + 0.4), RIG), plain()
    (note,) = (note for note in found.all_notes if note.code == RigCode.SPEED_OFFSET)
    assert note.data["offset_rad_s"] == pytest.approx(0.4, abs=0.03)
    fitted, as_logged = (one.evidence.diagnosis.scoreboard.blocks.speed for one in (found, sound))
    assert fitted == pytest.approx(as_logged, abs=0.03)
    assert (found.condition, found.unknown) == (sound.condition, False)
    for name in ("leakage_flow", "added_friction"):
        low, high = sound.severities[name].ci95 or (np.nan, np.nan)
        assert found.severities[name].value == pytest.approx(sound.severities[name].value, abs=0.3 * (high - low))


def test_a_channel_with_a_wrong_sign_gives_no_probabilities_and_advice_on_the_columns() -> None:
    record = log().replace(differential_pressure_pa=-log()["differential_pressure_pa"])
    found = diagnose_log(record, RIG)
    assert (found.outcome, found.unknown) == (Outcome.MISMATCH, True)
    assert {type(note.code) for note in found.against} == {ChannelCode}
    assert not found.probabilities
    assert AdviceCode.MEND_COLUMNS in {note.code for note in found.advice}


def test_a_refused_fit_makes_the_class_unknown_for_the_same_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    why = EstimateCode.BOUND_TOO_WIDE.note()
    monkeypatch.setattr(corrected_case, "rejection_notes", lambda _: (why,))
    found = diagnose_log(log(), RIG)
    assert found.unknown
    assert found.against[0] == why
    assert found.condition == "minor_leakage"


def test_an_objection_of_nominal_models_counts_only_beside_another_objection(monkeypatch: pytest.MonkeyPatch) -> None:
    poor = AgainstCode.NONE_FITS.note(percent=70.0)
    verdict = diagnose.models_verdict

    def objecting(*given: object) -> object:
        return verdict(*given)._replace(against=(poor,))  # type: ignore[arg-type]

    monkeypatch.setattr(diagnose, "models_verdict", objecting)
    assert not diagnose_log(log(), RIG).unknown
    monkeypatch.setattr(corrected_case, "rejection_notes", lambda _: (EstimateCode.BOUND_TOO_WIDE.note(),))
    assert poor in diagnose_log(log(), RIG).against


def test_a_log_too_short_for_a_circuit_is_in_no_class_since_nominal_models_often_name_a_wrong_one() -> None:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(7)
    run = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    found = diagnose_log(run.slice(0, 190), RIG)
    assert ranked_conditions(found.evidence.scores)[0][0] == "major_leakage"
    assert (found.outcome, found.condition, found.probabilities) == (Outcome.NOT_OBSERVABLE, None, {})
    assert ClassCode.NO_PROBABILITIES in codes(found)
    assert RigCode.WEAR_NOT_EXCLUDED not in codes(found)
    assert found.quantities["bulk_modulus"].value is not None


def test_a_rig_file_without_a_valid_circuit_gives_a_condition_without_probabilities(
    monkeypatch: pytest.MonkeyPatch,
) -> None:

    def refusing(_: EhaParameters) -> object:
        raise RigError("accumulator_oil must fill both chambers")

    monkeypatch.setattr(diagnose, "actuator_of", refusing)
    found = diagnose_log(log(), RIG)
    assert found.condition == "minor_leakage"
    assert not found.probabilities
    (said,) = [note for note in found.notes if note.code == ClassCode.NO_CIRCUIT]
    assert "accumulator_oil" in str(said)


@pytest.mark.parametrize(("share", "code"), [(0.45, RigCode.OIL_STIFFER), (2.2, RigCode.OIL_SOFTER)])
def test_an_oil_unlike_the_rig_files_is_named_and_the_class_is_still_found(share: float, code: RigCode) -> None:
    found = diagnose_log(log(), replace(RIG, parameters=replace(HEALTHY, bulk_modulus=share * HEALTHY.bulk_modulus)))
    assert code in codes(found)
    assert found.condition == "minor_leakage"


def test_an_oil_within_a_third_of_the_rig_files_is_not_named() -> None:
    found = diagnose_log(log(), replace(RIG, parameters=replace(HEALTHY, bulk_modulus=1.3 * HEALTHY.bulk_modulus)))
    assert not {RigCode.OIL_STIFFER, RigCode.OIL_SOFTER} & codes(found)


def test_a_log_without_drive_and_motion_has_no_class() -> None:
    record = log()
    still = Record(record.sample_time, {name: np.zeros(len(record)) for name in ("motor_speed_rad_s", "position_m")})
    found = diagnose_log(still, RIG)
    assert found.outcome is Outcome.NOT_OBSERVABLE
    assert found.condition is None
    assert ClassCode.CHANNEL_ZERO.note(channels="the velocity from position_m") in found.notes


def test_nominal_models_of_a_plain_log_are_started_before_the_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, order = plain(), list[str]()  # the usual diagnosis before anything is replaced

    def noted(name: str) -> None:
        run = getattr(diagnose, name)
        monkeypatch.setattr(diagnose, name, lambda *given, **how: order.append(name) or run(*given, **how))

    def at_once(work: Callable[[], object]) -> Callable[[], object]:
        found = work()
        return lambda: found

    for name in ("checked_estimate", "score_mathematical"):
        noted(name)
    monkeypatch.setattr(diagnose, "start_if_idle", at_once)
    found = diagnose_log(log(), RIG)
    assert (found.probabilities, found.severities) == (usual.probabilities, usual.severities)
    assert order == ["score_mathematical", "checked_estimate"]


def test_nominal_models_are_run_again_for_a_corrected_log() -> None:
    came = clean_log(log(), HEALTHY)
    of_another = partial(pytest.fail, "these are of another log")
    begun = diagnose._Plain(came, HEALTHY, None, of_another)  # pyright: ignore[reportPrivateUsage]
    assert begun.scores_of(replace(came), HEALTHY).by_condition == plain().evidence.scores.by_condition


@pytest.mark.parametrize(("share", "advised"), [(0.5, AdviceCode.BLEED), (2.0, AdviceCode.CORRECT_VOLUME_OR_OIL)])
def test_an_oil_unlike_the_rig_files_is_judged_by_the_rig_files_bulk_modulus(share: float, advised: AdviceCode) -> None:
    rig = Rig("another volume", replace(HEALTHY, chamber_volume=share * HEALTHY.chamber_volume))
    found = diagnose_log(log(), rig)
    assert found.healthy["bulk_modulus"] == pytest.approx(HEALTHY.bulk_modulus)
    assert found.evidence.diagnosis.limits["bulk_modulus"] == pytest.approx(0.8 * HEALTHY.bulk_modulus)
    (said,) = [one for one in found.advice if one.code == advised]
    assert said.data["volume"] == pytest.approx(HEALTHY.chamber_volume, rel=0.02)


def test_without_pressure_the_circuits_bulk_modulus_replaces_that_of_a_refused_motion_fit() -> None:
    """Before, a rejected number with a narrow interval was reported, and no number if it was not observable."""
    record = log(duration=1.0).replace(**{PRESSURE: None})
    large = EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=4.0, motion_percent=2.0)
    gate = Gate(False, (large,))
    refused = BulkModulusEstimate(Outcome.OK, 3e8, 1e5, 1.0, gate, "motion", ("position_m",), {}, {})
    found = diagnose_log(record, RIG, (clean_log(record, HEALTHY), refused))
    told, circuits = found.severities["bulk_modulus"], found.evidence.diagnosis.severity["bulk_modulus"]
    assert (told.value, told.ci95) == (circuits.value, circuits.ci95)
    assert told.ci95 is not None
    assert told.ci95[0] < HEALTHY.bulk_modulus < told.ci95[1]
    assert found.severities["entrained_air"].ci95_total is not None


def test_without_position_the_circuits_bulk_modulus_replaces_that_of_a_refused_filter() -> None:
    """Before, a filter's number that its own check rejected, a third of the truth, stood beside a reliable class."""
    record = log(duration=1.0).replace(position_m=None)
    gate = Gate(False, (EstimateCode.ESTIMATE_WANDERS.note(state="bulk_modulus_pa", ratio=47.0),))
    refused = BulkModulusEstimate(Outcome.OK, 7e7, 1e6, 0.004, gate, "pressure", ("velocity_m_s", PRESSURE), {}, {})
    found = diagnose_log(record, RIG, (clean_log(record, HEALTHY), refused))
    told, circuits = found.severities["bulk_modulus"], found.evidence.diagnosis.severity["bulk_modulus"]
    assert not found.unknown
    assert (told.value, told.ci95) == (circuits.value, circuits.ci95)


def test_a_log_without_motion_has_no_note_on_pump_wear() -> None:
    rng, count = np.random.default_rng(17410), 1500
    noise = {"motor_speed_rad_s": 0.05, "position_m": 1e-6, PRESSURE: 2e3}
    still = {name: size * rng.standard_normal(count) for name, size in noise.items()}
    still["motor_speed_rad_s"] += 2.0 * np.sin(2.0 * np.pi * 2e-3 * np.arange(count))  # 0.1 mm of piston travel
    record, wear = Record(1e-3, still), RigCode.WEAR_NOT_EXCLUDED.note(percent=30.0, half_width=30.0)
    unseen = without_number(Outcome.NOT_OBSERVABLE, (wide_bound_note(0.5),), "flow", ("position_m", PRESSURE), 0.5)
    found = diagnose_log(record, RIG, (clean_log(record, HEALTHY), replace(unseen, remarks=(wear,))))
    assert found.outcome is Outcome.NOT_OBSERVABLE
    assert RigCode.WEAR_NOT_EXCLUDED not in codes(found)


@pytest.mark.parametrize("drive", thinned(["steps", "prbs"], ["steps"]))
def test_without_pressure_a_blocked_rod_is_not_diagnosed_as_leakage(drive: str) -> None:
    rng, blocked = np.random.default_rng(11), replace(HEALTHY, friction_coulomb=6e4)
    record = simulate(CIRCUIT, make_drive(drive, 3.0, 1e-3, HEALTHY, rng), 1e-3, blocked, sensors=BENCH, rng=rng)
    hidden = dict.fromkeys((PRESSURE, "pressure_a_pa", "pressure_b_pa"))
    found = diagnose_log(record.replace(**hidden), RIG)
    assert found.unknown
    assert AgainstCode.STUCK_OR_LEAKS in {note.code for note in found.against}
    assert AdviceCode.FREE_PISTON in {note.code for note in found.advice}
    for logged in (record, record.replace(position_m=None)):
        seen = diagnose_log(logged, RIG)
        assert seen.unknown
        assert [note.code for note in seen.against] == [AgainstCode.ROD_BLOCKED]


def test_bulk_modulus_is_noted_as_not_visible_unless_the_flow_balance_gives_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in (by_circuits, known_losses):
        monkeypatch.setattr(module, "not_told_notes", lambda *_, **__: [ClassCode.BULK_MODULUS_NOT_VISIBLE.note()])
    record = log(duration=1.0)
    unseen = without_number(Outcome.NOT_OBSERVABLE, (wide_bound_note(0.1),), "flow", ("position_m", PRESSURE), 0.1)
    refused = diagnose_log(record, RIG, (clean_log(record, HEALTHY), unseen))
    assert ClassCode.BULK_MODULUS_NOT_VISIBLE in {note.code for note in refused.not_told}
    assert refused.severities["bulk_modulus"].value is None
    given = diagnose_log(record, RIG)
    assert ClassCode.BULK_MODULUS_NOT_VISIBLE not in {note.code for note in given.not_told}
    assert given.severities["bulk_modulus"] == given.quantities["bulk_modulus"]
