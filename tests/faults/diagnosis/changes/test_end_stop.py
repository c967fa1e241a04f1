"""A stop that no rig file states is found if the piston rests against it, and not otherwise."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.changes import end_stop
from faults.diagnosis.changes.end_stop import LEAST_REST, NEAR_DISTANCE, with_end_stop
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import ClassCode
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

RIG = EhaParameters()
ACTUATOR = actuator_of(RIG)
OUT_AND_BACK = np.repeat([100.0, 60.0, 0.0, -100.0, -60.0, 0.0], 600)


def log_of(stop: float | None, place: int = 0, circuit: CircuitParameters = ACTUATOR.circuit) -> Blocks:
    """Return a log of a circuit, with or without a stop, under a drive out and back over some 35 mm."""
    empty = np.zeros(len(OUT_AND_BACK) // 10)
    noise = np.array([4e-5, 2e3])
    blank = Blocks(np.append(OUT_AND_BACK, 0.0), 1e-3, 10, empty, empty, noise, stop=stop)
    rows = parameter_rows(ACTUATOR.conditions[[place]], circuit, ACTUATOR.rated)
    (found,) = predicted_outputs(blank, rows)
    found = found + np.random.default_rng(0).normal(size=found.shape) * noise
    return replace(blank, velocity=found[:, 0], pressure=found[:, 1], stop=None)


def test_a_circuit_with_the_end_stop_follows_a_piston_that_runs_into_it() -> None:
    log = log_of(0.02)
    without = fit_classes(log, ACTUATOR)
    seen, fits = with_end_stop(log, without, ACTUATOR)
    assert seen.stop == pytest.approx(0.02, abs=2e-4)
    assert np.all(fits.best.scales < 0.3 * without.best.scales)
    assert list(CONDITIONS)[int(np.argmax(fits.scores))] == "normal"


def test_a_compliant_end_stop_is_not_taken_for_friction_or_leakage() -> None:
    soft = replace(ACTUATOR.circuit, end_stop_stiffness=1e7, end_stop_damping=0.0)
    log = log_of(0.02, circuit=soft)
    seen, fits = with_end_stop(log, fit_classes(log, ACTUATOR), ACTUATOR)
    assert seen.stop is not None
    stands = np.cumsum(log.velocity) * log.block * log.sample_time > log.reach - NEAR_DISTANCE
    assert np.all(np.isnan(seen.outputs[stands]))
    assert np.all(np.isfinite(seen.outputs[~stands]))
    off = fits.best.coordinates - ACTUATOR.conditions[0]
    told = [COORDINATES.index(name) for name in ("leakage", "bias", "friction_rest", "friction_rated", "bulk_modulus")]
    assert np.all(np.abs(off[told]) < 0.06)  # otherwise flow bias would be 25 % off


def test_no_end_stop_is_found_if_the_drive_stopped_the_piston() -> None:
    log = log_of(None)
    gone = np.cumsum(log.velocity) * log.block * log.sample_time
    assert np.sum(gone > log.reach - NEAR_DISTANCE) * log.block * log.sample_time > LEAST_REST
    fits = fit_classes(log, ACTUATOR)
    assert with_end_stop(log, fits, ACTUATOR) == (log, fits)


@pytest.mark.parametrize(("shares", "sought"), [((0.055, 0.055), False), ((0.065, 0.01), True), ((0.01, 0.065), True)])
def test_an_end_stop_is_sought_if_a_circuit_leaves_6_percent_of_an_output_unexplained(
    shares: tuple[float, float], sought: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = log_of(0.02)
    left: Any = SimpleNamespace(best=SimpleNamespace(scales=np.array(shares) * log.rms, fitted=log.outputs))
    asked: list[float | None] = []

    def fitted(blocks: Blocks, *_: Any) -> Any:
        asked.append(blocks.stop)
        return left

    monkeypatch.setattr(end_stop, "fit_classes", fitted)
    assert with_end_stop(log, left, ACTUATOR) == (log, left)  # the fit with a stop gains nothing
    assert asked == ([log.reach] if sought else [])


def test_no_end_stop_is_found_in_a_poor_fit_with_another_cause() -> None:
    log = log_of(None)
    wrong = replace(log, velocity=log.velocity * np.where(np.arange(len(log.velocity)) % 20 < 10, 1.2, 0.8))
    fits = fit_classes(wrong, ACTUATOR)
    assert with_end_stop(wrong, fits, ACTUATOR)[0].stop is None


def test_a_finding_names_the_end_stop_and_the_right_class() -> None:
    truth = replace(RIG, stroke=0.04)
    record = simulate(CIRCUIT, OUT_AND_BACK, 1e-3, truth, sensors=BENCH, rng=np.random.default_rng(1))
    found = diagnose_log(record, Rig("short stroke", RIG))
    (said,) = [note for note in found.notes if note.code is ClassCode.END_STOP]
    assert said.data["reach_mm"] == pytest.approx(20.0, abs=0.5)
    assert (found.condition, found.against) == ("normal", ())


def test_presliding_of_the_seals_is_fitted_without_bias_in_other_coordinates() -> None:
    circuit = replace(ACTUATOR.circuit, presliding_displacement=3.0 * ACTUATOR.circuit.presliding_displacement)
    speed = 60.0 * np.sign(np.sin(2.0 * np.pi * 1.7 * 1e-3 * np.arange(4001)))
    empty, noise = np.zeros(400), np.array([4e-5, 2e3])
    blank = Blocks(speed, 1e-3, 10, empty, empty, noise)
    point = coordinates_of(RIG, ACTUATOR.rated)
    (run,) = predicted_outputs(blank, parameter_rows(point[None], circuit, ACTUATOR.rated))
    found = fit_classes(replace(blank, velocity=run[:, 0], pressure=run[:, 1]), ACTUATOR).best.coordinates - point
    assert found[-1] == pytest.approx(np.log(3.0), abs=0.1)
    assert np.all(np.abs(found[:-1]) < 0.02)
