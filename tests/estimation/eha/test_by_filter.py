"""A filter with noise levels tuned to the log says how far it may be off, at any rate."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.result import BulkModulusEstimate
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import PLANTS, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

FAULTY = parameters_for(CONDITIONS["minor_leakage_minor_friction"])
TRUTH = FAULTY.bulk_modulus
QUIET = replace(
    BENCH, speed_noise=5e-3, velocity_noise=1e-4, pressure_noise=500.0, pressure_quantum=50.0, position_quantum=1e-7
)


def run(duration: float, sample_time: float) -> Record:
    rng = np.random.default_rng(3)
    speed = make_drive("steps", duration, sample_time, FAULTY, rng)
    return simulate(PLANTS["lumped"], speed, sample_time, FAULTY, sensors=QUIET, rng=rng)


def filtered(log: Record, tuned: bool) -> BulkModulusEstimate:
    return estimate_bulk_modulus(log, FAULTY, form="pressure", tuned=tuned)


def test_steps_of_the_model_do_not_show_in_a_tuned_filter_of_a_fast_log() -> None:
    found = filtered(run(1.0, 1e-4), tuned=True)
    assert found.std < 2e-5 * TRUTH
    assert found.value == pytest.approx(TRUTH, abs=4.0 * found.std)


def test_tuning_narrows_the_interval_by_what_the_log_shows_of_the_noise() -> None:
    log = run(3.0, 1e-3)
    tuned, given = filtered(log, tuned=True), filtered(log, tuned=False)
    assert 5.0 * tuned.std < given.std
    assert tuned.value == pytest.approx(TRUTH, abs=4.0 * tuned.std)
    assert given.value == pytest.approx(TRUTH, abs=4.0 * given.std)
