"""In a log that warms, classes are averaged over where in the drift of leakage the rig file's oil applies."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.eha.explanation_notes import LEAKAGE_COURSE
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.notes import RigCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine import drift
from faults.diagnosis.beyond_nine.drift import averaged_over_drift, averaged_probabilities
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis
from faults.diagnosis.by_circuits import diagnose_clean
from faults.diagnosis.calibration import shipped_calibration
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.class_fit import LASTING, least_scales
from faults.diagnosis.circuits.model_doubt import NOISE_ALONE
from faults.diagnosis.severity import severities_at
from faults.diagnosis.severity_total import with_totals
from faults.notes import AgainstCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
ACTUATOR = actuator_of(HEALTHY)
SECONDS, TWICE = 4.0, 2.0
DRIFTS = (RigCode.LEAKAGE_DRIFTS.note(factor=TWICE, first=1e-11, last=2e-11),)


@cache
def warming(condition: str, first: float) -> CleanLog:
    """Return a log whose viscosity halves, and whose leakage starts at a multiple of the condition's."""
    p, rng = circuit_of(parameters_for(CONDITIONS[condition])), np.random.default_rng(5)
    times = np.linspace(0.0, SECONDS, 9)
    warm = [
        replace(p, leakage_coefficient=factor * p.leakage_coefficient, friction_linear=p.friction_linear / factor)
        for factor in first * TWICE ** (times / SECONDS)
    ]
    path = ParameterPath((1e-6, *times[1:]), tuple(warm), "linear")
    drive = make_drive("prbs", SECONDS, 1e-3, HEALTHY, rng)
    found = clean_log(simulate(CIRCUIT, drive, 1e-3, path, sensors=BENCH, rng=rng), HEALTHY)
    course = TWICE ** (np.linspace(0.0, 1.0, len(found.record)) - 1.0)
    return replace(found, record=found.record.replace(**{LEAKAGE_COURSE: course}))


def diagnosed(log: CleanLog) -> LoadedDiagnosis:
    return LoadedDiagnosis(diagnose_clean(log, ACTUATOR), HEALTHY)


@cache
def weighed_over_drift(condition: str, first: float) -> Diagnosis:
    return averaged_over_drift(diagnosed, warming(condition, first), DRIFTS).diagnosis


@pytest.mark.parametrize("condition", thinned(["minor_leakage", "major_leakage"], ["major_leakage"]))
def test_averaging_over_the_drift_finds_a_condition_that_applies_to_the_cold_oil(condition: str) -> None:
    at_end = diagnosed(warming(condition, 1.0)).diagnosis
    assert at_end.condition != condition or at_end.unknown
    found = weighed_over_drift(condition, 1.0)
    assert (found.condition, found.unknown) == (condition, False)
    assert sum(found.probabilities.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("first", [TWICE**-0.5, 1.0 / TWICE])
def test_averaging_over_the_drift_finds_a_condition_that_applies_halfway_or_at_the_end(first: float) -> None:
    found = weighed_over_drift("minor_leakage", first)
    assert (found.condition, found.unknown) == ("minor_leakage", False)


def test_severities_of_a_drifting_log_apply_to_its_end_and_total_intervals_span_the_drift() -> None:
    found, at_end = weighed_over_drift("minor_leakage", 1.0), diagnosed(warming("minor_leakage", 1.0)).diagnosis
    flow = found.severity["leakage_flow"]
    assert (flow.value, flow.ci95) == (at_end.severity["leakage_flow"].value, at_end.severity["leakage_flow"].ci95)
    names = list(CONDITIONS)
    begun = severities_at(ACTUATOR.conditions[names.index("minor_leakage")], ACTUATOR)["leakage_flow"]
    low, high = with_totals(found.severity, ACTUATOR, {}, pressure=True)["leakage_flow"].ci95_total or (0.0, 0.0)
    assert flow.ci95 is not None
    assert low < begun < flow.ci95[0]
    assert high == pytest.approx(flow.ci95[1])


def test_a_log_that_does_not_drift_is_diagnosed_once() -> None:
    asked: list[CleanLog] = []
    log: Any = SimpleNamespace()

    def once(one: CleanLog) -> LoadedDiagnosis:
        asked.append(one)
        steady: Any = SimpleNamespace(scoreboard=SimpleNamespace(drift=None))
        return LoadedDiagnosis(steady, HEALTHY)

    grows = RigCode.LEAKAGE_GROWS.note(factor=5.0, first=1e-11, last=5e-11)
    assert averaged_over_drift(once, log, (grows,)).parameters is HEALTHY
    assert asked == [log]


def test_a_drifting_log_keeps_an_objection_only_if_every_place_in_the_drift_has_one() -> None:
    first = weighed_over_drift("minor_leakage", 1.0)
    outside, bias = AgainstCode.OUTSIDE_CONDITIONS.note(), AgainstCode.PRESSURE_BIAS.note(bias_pa=1e5)

    def against(*each: tuple[Any, ...]) -> tuple[Any, ...]:
        left = iter(each)
        return averaged_over_drift(
            lambda _: LoadedDiagnosis(replace(first, against=next(left)), HEALTHY),
            warming("minor_leakage", 1.0),
            DRIFTS,
        ).diagnosis.against

    assert against((outside,), (outside,), ()) == ()
    assert against((outside,), (outside,), (outside,)) == (outside,)
    assert against((bias,), (), ()) == (bias,)
    assert against((outside,), (bias,), ()) == (bias,)


def test_places_count_by_evidence_less_if_no_circuit_follows_to_noise_and_alike_if_blocks_differ() -> None:
    one = weighed_over_drift("minor_leakage", 1.0)
    sure = {name: {"normal": 1.0}.get(name, 0.0) for name in CONDITIONS}
    other = {name: {"major_friction": 1.0}.get(name, 0.0) for name in CONDITIONS}
    calibration = shipped_calibration()
    less = 2.0 / calibration.weights(True)["parameters"]
    fits = replace(one.scoreboard.fits, scores=one.scoreboard.fits.scores - less)
    worse = replace(one.scoreboard, fits=fits)
    two = replace(one, probabilities=sure), replace(one, probabilities=other, scoreboard=worse)
    found = averaged_probabilities(two, calibration)
    assert found["normal"] / found["major_friction"] == pytest.approx(np.exp(2.0))
    # residuals of twice the noise are a wrong model's error: 5 looks at it in the whole log, in place of its blocks
    blocks, scales = one.scoreboard.blocks, 2.0 * NOISE_ALONE * least_scales(one.scoreboard.blocks)
    rough = [
        replace(each, scoreboard=replace(board, fits=replace(board.fits, best=replace(board.fits.best, scales=scales))))
        for each, board in ((each, each.scoreboard) for each in two)
    ]
    looks = LASTING / (LASTING + 0.75 * np.max(blocks.counts) / 5.0)
    found = averaged_probabilities(rough, calibration)
    assert found["normal"] / found["major_friction"] == pytest.approx(np.exp(2.0 * looks))
    cut = replace(one.scoreboard.blocks, velocity=one.scoreboard.blocks.velocity * np.nan)
    elsewhere = replace(two[1], scoreboard=replace(worse, blocks=cut))
    assert averaged_probabilities((two[0], elsewhere), calibration)["normal"] == pytest.approx(0.5)


@pytest.mark.parametrize("pressure", [True, False])
def test_a_refit_from_another_place_starts_at_its_scaled_leakage_with_widths_for_the_channels(
    pressure: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = weighed_over_drift("minor_leakage", 1.0)
    blocks = one.scoreboard.blocks if pressure else replace(one.scoreboard.blocks, pressure=None)
    here = replace(one, scoreboard=replace(one.scoreboard, blocks=blocks))
    misfits, starts = iter((100.0, 0.0)), list[np.ndarray]()

    def fitted(*_: Any, start: np.ndarray) -> Any:
        starts.append(start)
        return one.scoreboard.fits

    calibration: Any = SimpleNamespace(widths=lambda asked: asked)
    monkeypatch.setattr(drift, "misfit", lambda *_: next(misfits))
    monkeypatch.setattr(drift, "fit_classes", fitted)
    monkeypatch.setattr(drift, "severities", lambda _, __, widths: {"widths": widths})
    assert drift._refitted_from_best([here, here], [1.0, 2.0], ACTUATOR, calibration).severity == {"widths": pressure}
    moved = starts[0] - one.scoreboard.fits.best.coordinates
    wanted = np.zeros(len(drift.COORDINATES))
    # leakage at the end of the log over that at the other place
    wanted[drift.COORDINATES.index("leakage")] = -np.log(2.0)
    assert moved == pytest.approx(wanted)
