"""A channel of which only changes were logged is named; a channel that is coarse, rests or is held is not."""

from functools import cache

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.logged_on_change import LEAST_THRESHOLD, dead_band, logged_on_change
from estimation.log_checks.notes import LoggerCode
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AdviceCode
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors

PAPER = EhaParameters()
SPEED, POSITION, PRESSURE = "motor_speed_rad_s", "position_m", "differential_pressure_pa"


@cache
def log(drive: str = "prbs", sensors: Sensors = BENCH) -> Record:
    rng = np.random.default_rng(4)
    return simulate(CIRCUIT, make_drive(drive, 4.0, 1e-3, PAPER, rng), 1e-3, PAPER, sensors=sensors, rng=rng)


def on_change(values: Array, threshold: float) -> Array:
    """Return the output of a logger that repeats a value until it has changed by more than a threshold."""
    written = values.copy()
    for k in range(1, len(values)):
        written[k] = values[k] if abs(values[k] - written[k - 1]) > threshold else written[k - 1]
    return written


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_with_a_measurement_in_every_row_is_not_accused(drive: str, sensors: Sensors) -> None:
    assert logged_on_change(log(drive, sensors)) == ()


@pytest.mark.parametrize("bits", [6, 8, 10, 12])
@pytest.mark.parametrize("channel", [SPEED, POSITION, PRESSURE])
def test_a_coarse_converter_is_not_accused(channel: str, bits: int) -> None:
    values = log("sine")[channel]
    quantum = np.ptp(values) / 2**bits
    assert dead_band(quantum * np.rint(values / quantum)) == 0.0
    assert dead_band(np.float32(quantum) * np.rint(values / quantum) + 0.3) == 0.0


def test_a_channel_that_is_held_or_rests_is_not_accused() -> None:
    values = log()[PRESSURE]
    assert dead_band(np.repeat(values[::7], 7)) == 0.0
    assert dead_band(np.concatenate([np.full(4000, values[0]), values])) == 0.0


def test_even_steps_that_follow_each_other_are_a_ramp_and_no_threshold() -> None:
    """Motor speed as a drive plans it, a pump that starts and stops, and a pressure that its sensor clips."""
    levels = np.repeat([0.0, 157.08, -104.72, 52.36] * 6, 400)
    speed = np.zeros(len(levels))
    for k in range(1, len(levels)):
        speed[k] = speed[k - 1] + np.clip(levels[k] - speed[k - 1], -2.5, 2.5)
    turned = np.cumsum(np.repeat([97.3, 0.0, -120.2, 0.0, 140.0, 0.0] * 8, 150)) * 1e-6
    clipped = np.clip(3e6 * np.sin(0.01 * np.arange(8000.0)), -2e6, 2e6)
    assert [dead_band(one) for one in (speed, turned, clipped)] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("channel", [SPEED, POSITION, PRESSURE])
def test_the_threshold_is_found_from_the_steps_and_named_if_it_is_large(channel: str) -> None:
    values = log()[channel]
    for share, told in ((0.05, True), (0.5 * LEAST_THRESHOLD, False)):
        written = on_change(values, share * float(values.std()))
        assert bool(logged_on_change(log().replace(**{channel: written}))) == told
    threshold = 0.05 * float(values.std())
    assert dead_band(on_change(values, threshold)) == pytest.approx(threshold, rel=0.05)


def test_a_pressure_logged_on_change_is_refused_with_advice_to_log_every_row() -> None:
    """Such logs passed the gate with bulk modulus up to 5 % off."""
    values = log()[PRESSURE]
    record = log().replace(**{PRESSURE: on_change(values, 0.05 * float(values.std()))})
    (note,) = clean_log(record, PAPER).objections
    assert note.code is LoggerCode.LOGGED_ON_CHANGE
    found = diagnose_log(record, Rig("paper", PAPER))
    assert not found.gate.passed
    assert found.unknown
    assert LoggerCode.LOGGED_ON_CHANGE in {one.code for one in found.against}
    assert AdviceCode.LOG_EVERY_ROW in {one.code for one in found.advice}
