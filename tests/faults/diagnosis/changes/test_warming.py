"""Without pressure, the drift of leakage is found in a log whose oil warms, and in no other log."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.notes import RigCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine.drift import averaged_over_drift
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.changes import warming
from faults.diagnosis.changes.onset import last_part
from faults.diagnosis.changes.warming import (
    LEAST_DRIFT,
    Drift,
    find_drift,
    leakage_course,
    with_drift,
    with_leakage_course,
)
from faults.diagnosis.circuits import yielding
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import LONGEST, Blocks, blocks_of
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
SECONDS = 4.0


@cache
def log(condition: str, factor: float) -> CleanLog:
    """Return a log without pressure in which leakage grows by a factor and viscous friction falls by it."""
    p, rng = circuit_of(parameters_for(CONDITIONS[condition])), np.random.default_rng(5)
    times = np.linspace(0.0, SECONDS, 9)
    warm = [
        replace(p, leakage_coefficient=rise * p.leakage_coefficient, friction_linear=p.friction_linear / rise)
        for rise in factor ** (times / SECONDS)
    ]
    path = ParameterPath((1e-6, *times[1:]), tuple(warm), "linear")
    drive = make_drive("prbs", SECONDS, 1e-3, HEALTHY, rng)
    made = simulate(CIRCUIT, drive, 1e-3, path, sensors=BENCH, rng=rng)
    return clean_log(made.replace(differential_pressure_pa=None), HEALTHY)


@cache
def fitted(condition: str, factor: float) -> tuple[Blocks, ClassFits]:
    blocks = blocks_of(log(condition, factor).record)
    return blocks, fit_classes(blocks, ACTUATOR)


def diagnosed(one: CleanLog) -> LoadedDiagnosis:
    return LoadedDiagnosis(diagnose_clean(one, ACTUATOR), HEALTHY)


@pytest.mark.parametrize(
    ("condition", "factor"), [("minor_leakage", 2.0), ("major_leakage", 2.0), ("minor_leakage", 0.5)]
)
def test_the_drift_factor_of_leakage_is_estimated(condition: str, factor: float) -> None:
    blocks, fits = fitted(condition, factor)
    found = find_drift(blocks, fits, ACTUATOR)
    assert found is not None
    assert np.exp(found.logarithm) == pytest.approx(factor, rel=0.1)
    assert found.gain > 5.0


@pytest.mark.parametrize("condition", ["normal", "minor_leakage", "major_leakage_major_friction"])
def test_constant_leakage_shows_no_drift(condition: str) -> None:
    assert find_drift(*fitted(condition, 1.0), ACTUATOR) is None


def test_a_drift_is_found_even_if_the_slopes_of_the_first_circuit_are_useless() -> None:
    blocks, fits = fitted("minor_leakage", 2.0)
    lost = replace(fits.best, slopes=np.zeros_like(fits.best.slopes), scales=0.2 * blocks.rms)
    found = find_drift(replace(blocks, noise=0.0 * blocks.noise), replace(fits, best=lost), ACTUATOR)
    assert found is not None
    assert np.exp(found.logarithm) == pytest.approx(2.0, rel=0.1)


def test_a_drift_is_rejected_if_its_circuit_leaves_the_log_unexplained(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, fits = fitted("minor_leakage", 2.0)
    found = find_drift(blocks, fits, ACTUATOR)
    assert found is not None
    left = float(found.fit.scales[0] / blocks.rms[0])
    for share, is_one in ((1.1, True), (0.9, False)):
        monkeypatch.setattr(warming, "UNEXPLAINED", (share * left, 1.0))
        assert (find_drift(blocks, fits, ACTUATOR) is not None) == is_one


def test_the_search_for_a_drift_ends_if_it_cannot_reach_the_wanted_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, fits = fitted("minor_leakage", 2.0)
    whole, searched, fitted_on = find_drift(blocks, fits, ACTUATOR), list[float](), warming.fit_freely
    assert whole is not None

    def counted(*given: Any) -> Any:
        searched.append(1.0)
        return fitted_on(*given)

    monkeypatch.setattr(warming, "fit_freely", counted)
    monkeypatch.setattr(warming, "NEAR", 0.0)  # otherwise the search may end after one fit
    monkeypatch.setattr(warming, "FARTHEST", 0.2)
    found = find_drift(blocks, fits, ACTUATOR, 0.5 * whole.gain)
    assert found is not None
    assert found.gain > 0.5 * whole.gain
    needed = len(searched)
    searched.clear()
    find_drift(blocks, fits, ACTUATOR, 100.0 * whole.gain)
    assert len(searched) == 1 < needed


def test_no_drift_is_found_if_the_piston_only_yields_on_its_seals(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks, fits = fitted("minor_leakage", 2.0)
    assert find_drift(blocks, fits, ACTUATOR) is not None
    monkeypatch.setattr(yielding, "YIELDING_SHARE", 1.0)
    assert find_drift(blocks, fits, ACTUATOR) is None


def test_no_drift_is_sought_with_pressure_a_known_drift_no_motion_or_too_long_a_log() -> None:
    blocks, fits = fitted("minor_leakage", 2.0)
    long = round(LONGEST / blocks.sample_time) + 2
    for other in (
        replace(blocks, pressure=np.zeros(len(blocks.velocity))),
        with_drift(blocks, 0.3),
        replace(blocks, velocity=1e-6 * blocks.velocity),
        replace(blocks, speed=np.zeros(long)),
    ):
        assert find_drift(other, fits, ACTUATOR) is None


def test_a_drift_is_shown_only_if_it_is_ten_times_likelier_and_large_enough() -> None:
    _, fits = fitted("minor_leakage", 2.0)
    for logarithm, gain, shown in (
        (0.7, 2.6, True),
        (-0.7, 2.6, True),
        (0.7, 2.5, False),
        (0.9 * LEAST_DRIFT, 99.0, False),
    ):
        assert Drift(logarithm, fits.best, gain).is_shown == shown


def test_a_log_of_warming_oil_has_a_drift_and_no_onset() -> None:
    part = last_part(log("minor_leakage", 2.0).record, ACTUATOR)
    assert part.onset is None
    assert part.drift is not None
    assert last_part(log("minor_leakage", 1.0).record, ACTUATOR).drift is None


@pytest.mark.parametrize("condition", thinned(["minor_leakage", "major_leakage"], ["minor_leakage"]))
def test_without_pressure_a_condition_that_applies_to_the_cold_oil_is_found(condition: str) -> None:
    found = averaged_over_drift(diagnosed, log(condition, 2.0), ())
    assert (found.diagnosis.condition, found.diagnosis.unknown) == (condition, False)
    assert [note.code for note in found.notes] == [RigCode.LEAKAGE_DRIFTS]
    assert float(found.notes[0].data["factor"]) == pytest.approx(2.0, rel=0.1)
    assert found.diagnosis.scoreboard.blocks.leakage_course is not None


def test_leakage_growth_beyond_that_of_warm_oil_is_an_objection_to_all_nine() -> None:
    found = averaged_over_drift(diagnosed, log("minor_leakage", 6.0), ())
    assert [note.code for note in found.notes] == [RigCode.LEAKAGE_GROWS]
    assert found.diagnosis.against[0] == found.notes[0]


def test_the_course_of_leakage_of_a_drifting_log_ends_at_one() -> None:
    _, fits = fitted("minor_leakage", 2.0)
    one = CleanLog(Record(0.1, {"motor_speed_rad_s": np.zeros(5)}), {}, (), ())
    other, note = with_leakage_course(one, Drift(float(np.log(2.0)), fits.best, 9.0))
    assert other.record[LEAKAGE_COURSE] == pytest.approx([0.5, 2.0**-0.75, 2.0**-0.5, 2.0**-0.25, 1.0])
    assert float(note.data["last"]) == pytest.approx(2.0 * float(note.data["first"]), rel=1e-6, abs=0.0)
    assert leakage_course(0.0, 4).tolist() == [1.0] * 4
