"""Verdicts on logs whose true condition is known."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.population import OUT_OF_MODEL, TEST, DrawnLog, draw_logs
from benchmarks.diagnosis.scores import calibration_error, share_interval
from estimation.log_checks.clean import clean_log
from estimation.notes import SensorCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine import wear
from faults.diagnosis.beyond_nine.left_open import DELIVERIES
from faults.diagnosis.beyond_nine.other_faults import OutsideFaults
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.calibration import Calibration, shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.evidence import EVIDENCES
from faults.diagnosis.severity import severities_at
from faults.notes import AgainstCode, ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, RIG

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
PRESSURE = "differential_pressure_pa"
PRESSURES = pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "without"])


def diagnosed(record: Record, *, pressure: bool = True) -> Diagnosis:
    seen = record if pressure else record.replace(**{PRESSURE: None})
    return diagnose_clean(clean_log(seen, HEALTHY), ACTUATOR)


@pytest.fixture(scope="module")
def population() -> list[DrawnLog]:
    return list(draw_logs([TEST]))


@pytest.fixture(scope="module")
def verdicts(population: list[DrawnLog]) -> Mapping[bool, list[Diagnosis]]:
    """Return the verdicts on the logs, by whether pressure is logged."""
    return {pressure: [diagnosed(log.record, pressure=pressure) for log in population] for pressure in (True, False)}


@pytest.mark.slow
@PRESSURES
def test_every_log_of_a_seed_gets_its_class_and_none_is_flagged(
    population: list[DrawnLog], verdicts: Mapping[bool, list[Diagnosis]], *, pressure: bool
) -> None:
    found = verdicts[pressure]
    assert [one.condition for one in found] == [log.condition for log in population]
    assert [one.against for one in found] == [()] * len(found)
    sums = [sum(one.probabilities.values()) for one in found]  # without pressure, less the probability of a worn pump
    assert all(one == pytest.approx(1.0) if pressure else 0.5 < one < 1.0 + 1e-9 for one in sums)


@pytest.mark.parametrize(
    ("condition", "fastest"), [("normal", 70.0), ("normal", 91.0), ("major_friction", 88.0), ("minor_leakage", 130.0)]
)
def test_a_log_that_travels_150_to_200_mm_gets_its_class(condition: str, fastest: float) -> None:
    speed = fastest * np.repeat([0.48, 1.0, 0.72, 1.0, -1.0, -0.56, -1.0, -0.8], 2000)
    truth = replace(parameters_for(CONDITIONS[condition]), stroke=1.0)
    record = simulate(CIRCUIT, speed, 1e-3, truth, sensors=BENCH, rng=np.random.default_rng(1))
    assert np.ptp(record["position_m"]) > 0.145
    found = diagnosed(record)
    assert (found.condition, found.against) == (condition, ())


@pytest.mark.parametrize("condition", ["normal", "minor_leakage"])
def test_an_actuator_with_coulomb_friction_only_gets_its_class_and_severities(condition: str) -> None:
    rig = replace(HEALTHY, friction_quadratic=0.0, friction_linear=0.0)
    speed = 91.0 * np.repeat([0.48, 1.0, 0.72, -1.0, -0.56, -0.8], 1000)
    record = simulate(
        CIRCUIT, speed, 1e-3, parameters_for(CONDITIONS[condition], rig), sensors=BENCH, rng=np.random.default_rng(1)
    )
    found = diagnose_clean(clean_log(record, rig), actuator_of(rig))
    assert (found.condition, found.against) == (condition, ())
    assert found.severity["added_friction"].covers(0.0)
    assert all(one.value is not None for one in found.severity.values())


@pytest.mark.slow
@PRESSURES
def test_intervals_of_severities_cover_the_truth_in_over_85_percent(
    population: list[DrawnLog], verdicts: Mapping[bool, list[Diagnosis]], *, pressure: bool
) -> None:
    covered: list[bool] = []
    for log, found in zip(population, verdicts[pressure], strict=True):
        true = severities_at(coordinates_of(log.parameters, ACTUATOR.rated), ACTUATOR)
        covered += [one.covers(true[name]) for name, one in found.severity.items()]
    assert np.mean(covered) > 0.85


SATURATED = "pressure saturates at 60 %"
"""The only kind that is corrected: samples at the end of the sensor's range are left out before anything is fitted."""


@pytest.mark.slow
def test_a_saturated_pressure_is_left_out_and_named_and_the_class_is_right(population: list[DrawnLog]) -> None:
    for log in population[:18:6]:
        cleaned = clean_log(OUT_OF_MODEL[SATURATED](log), HEALTHY)
        assert [note.code for note in cleaned.left_out] == [SensorCode.SENSOR_CLIPPED]
        found = diagnose_clean(cleaned, ACTUATOR)
        assert (found.condition, found.against) == (log.condition, ())


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in OUT_OF_MODEL if kind != SATURATED])
def test_logs_out_of_the_model_are_called_unknown_with_a_reason(kind: str, population: list[DrawnLog]) -> None:
    found = [diagnosed(OUT_OF_MODEL[kind](log)) for log in population[:18:6]]
    assert sum(one.unknown for one in found) >= len(found) - 1
    assert all(bool(one.against) == one.unknown for one in found)
    assert {type(note.code) for one in found for note in one.against} <= {AgainstCode, SensorCode}


def stuck(condition: str) -> Diagnosis:
    p = ACTUATOR.circuit
    drive = make_drive("sine", 3.0, 1e-3, p, np.random.default_rng(0))
    faulty = parameters_for(CONDITIONS[condition])
    return diagnosed(simulate(CIRCUIT, drive, 1e-3, faulty, sensors=RIG, rng=np.random.default_rng(1)))


@pytest.mark.slow
@pytest.mark.parametrize("condition", ["normal", "minor_leakage_minor_friction", "major_friction"])
def test_a_stuck_piston_shows_its_leakage_level_and_not_its_friction_level(condition: str) -> None:
    found = stuck(condition)
    level = CONDITIONS[condition].leakage
    alike = [share for name, share in found.probabilities.items() if CONDITIONS[name].leakage == level]
    assert sum(alike) > 0.9
    assert max(alike) < 0.5
    assert ClassCode.FRICTION_NOT_VISIBLE in [note.code for note in found.not_told]


def test_the_shipped_calibration_states_its_provenance() -> None:
    shipped = shipped_calibration()
    assert set(shipped.weights(True)) == set(shipped.weights(False)) == set(EVIDENCES)
    assert shipped.provenance["script"] == "python -m benchmarks fit_diagnosis"
    widths: Mapping[str, float] = shipped.widths(True)
    assert all(width > 0.0 for width in widths.values())


def stretched(by: float, weight: float) -> Calibration:
    """Return the shipped calibration with wider intervals and other weights."""
    shipped = shipped_calibration()
    parts = (
        {
            "weights": {name: weight * one for name, one in part["weights"].items()},
            "widths": {name: by * one for name, one in part["widths"].items()},
        }
        for part in (shipped.with_pressure, shipped.without_pressure)
    )
    return Calibration(*parts, {})


@PRESSURES
def test_the_calibration_scales_intervals_and_probabilities(*, pressure: bool) -> None:
    speed = 90.0 * np.repeat([0.48, 1.0, -1.0, -0.56], 700)
    record = simulate(CIRCUIT, speed, 1e-3, HEALTHY, sensors=BENCH, rng=np.random.default_rng(1))
    log = clean_log(record if pressure else record.replace(**{PRESSURE: None}), HEALTHY)
    once, twice = (diagnose_clean(log, ACTUATOR, calibration=stretched(by, 1.0)) for by in (1.0, 2.0))
    for name in shipped_calibration().widths(pressure):
        (low, high), (lower, higher) = once.severity[name].ci95 or (0.0, 0.0), twice.severity[name].ci95 or (0.0, 0.0)
        on = np.log if name == "bulk_modulus" else np.asarray  # bulk modulus stays positive
        assert on(higher) - on(lower) == pytest.approx(2.0 * (on(high) - on(low))), name
    assert once.probabilities == twice.probabilities
    undecided = diagnose_clean(log, ACTUATOR, calibration=stretched(1.0, 0.0)).probabilities
    left = sum(undecided.values())  # the rest is for faults that a log without pressure does not exclude
    assert left == pytest.approx(sum(once.probabilities.values()))
    assert list(undecided.values()) == pytest.approx([left / len(CONDITIONS)] * len(CONDITIONS))
    assert once.probabilities[once.condition] > 0.5


def test_without_pressure_classes_are_summed_over_deliveries_of_the_pump(monkeypatch: pytest.MonkeyPatch) -> None:
    speed = 90.0 * np.repeat([0.48, 1.0, -1.0, -0.56], 700)
    record = simulate(CIRCUIT, speed, 1e-3, HEALTHY, sensors=BENCH, rng=np.random.default_rng(1))
    sound = diagnosed(record, pressure=False)
    place, other = (list(CONDITIONS).index(name) for name in (sound.condition, "major_leakage"))
    worn = np.full((1 + len(DELIVERIES), 9), -30.0)
    worn[0, place] = 0.0
    worn[1 + DELIVERIES.index(0.8), other] = 3.7  # a pump at 80 % explains the log better, in another condition
    monkeypatch.setattr(wear, "faults_outside", lambda *_: OutsideFaults(worn_scores=worn))
    found = diagnosed(record, pressure=False)
    assert sound.probabilities[sound.condition] > 0.99 * sum(sound.probabilities.values())
    assert 0.05 < found.probabilities[sound.condition] < 0.9
    assert found.probabilities["major_leakage"] > 0.1
    assert sum(found.probabilities.values()) == pytest.approx(1.0)


def test_a_sure_classifier_that_is_always_right_has_no_calibration_error() -> None:
    assert calibration_error(np.ones(100), np.ones(100, dtype=bool)) == 0.0
    coin = np.arange(1000) % 2 == 0
    assert calibration_error(np.full(1000, 0.5), coin) == pytest.approx(0.0, abs=0.01)


def test_the_interval_of_a_share_is_that_of_clopper_and_pearson() -> None:
    low, high = share_interval(90, 100)
    assert low < 0.9 < high
    assert (low, high) == pytest.approx((0.8238, 0.9510), abs=1e-4)
