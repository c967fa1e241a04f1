"""What the extended Kalman filter follows through a log of the piezo-stack actuator."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.plants.piezo_stack_filter import STATE_SIZES, filter_stack
from plant.errors import LogError
from plant.log.record import Record
from plant.piezo_stack.model import STATES
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, SAMPLE_TIME, simulate_stack, sine_drive

HEALTHY = PiezoStackParameters(load_mass=10.0)
LEAKS = {"chamber_leakage": 3e-12, "crossport_leakage": 3e-12}
WORN = replace(HEALTHY, air_fraction=2.0 * HEALTHY.air_fraction, coulomb_friction=45.0, **LEAKS)


def log_of(p: PiezoStackParameters, seed: int, time: float) -> Record:
    drive = sine_drive(275.0, 140.0, time, SAMPLE_TIME)
    return simulate_stack(p, drive, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(seed))


@pytest.mark.slow
def test_the_filter_follows_air_leaks_and_friction_to_where_they_are() -> None:
    track = filter_stack(log_of(WORN, 3, 0.1), HEALTHY)
    found = track.final(HEALTHY)
    bounds = {"air_fraction": 0.01, "chamber_leakage": 0.1, "crossport_leakage": 0.1, "coulomb_friction": 0.05}
    for name, most in bounds.items():
        assert found[name][0] == pytest.approx(getattr(WORN, name), rel=most)
    assert 0.5 < track.consistency < 1.1
    assert np.all(track.deviations[-1] < track.deviations[200])


def test_every_state_has_a_size() -> None:
    assert len(STATE_SIZES) == len(STATES)
    assert np.all(STATE_SIZES > 0.0)


def test_a_log_without_its_drive_is_refused() -> None:
    with pytest.raises(LogError, match="drive_voltage_v is needed"):
        filter_stack(log_of(HEALTHY, 1, 0.01).replace(drive_voltage_v=None), HEALTHY)
