"""Logs in blocks: without pressure, the blocks in which the piston's initial state still matters are skipped."""

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.beginning import SETTLING
from faults.diagnosis.circuits.blocks import blocks_of, root_mean_square
from faults.diagnosis.circuits.circuit_runs import coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.diagnosis.circuits.rivals import is_followed_roughly
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import RIG

HEALTHY, PRESSURE = EhaParameters(), "differential_pressure_pa"


def running(seconds: float, first: float) -> Record:
    """Return a part of a test under major friction that begins at a motor speed [rad/s]."""
    rng = np.random.default_rng(3)
    speed = np.concatenate([[0.0], make_drive("steps", 16.0, 2e-3, HEALTHY, rng)])
    log = simulate(CIRCUIT, speed, 2e-3, parameters_for(CONDITIONS["major_friction"]), sensors=RIG, rng=rng)
    place = int(np.argmin(np.abs(log["motor_speed_rad_s"][1000:2000] - first))) + 1000 if first else 0
    return log.slice(place, place + round(seconds / 2e-3))


def test_a_circuit_started_at_rest_follows_a_running_log_after_the_settling_time() -> None:
    actuator, blocks = actuator_of(HEALTHY), blocks_of(running(6.0, 60.0).replace(**{PRESSURE: None}))
    fits = fit_classes(blocks, actuator)
    assert list(CONDITIONS)[int(np.argmax(fits.scores))] == "major_friction"
    assert not is_followed_roughly(blocks, fits.best)
    begun = blocks.velocity - fits.best.fitted[:, 0]
    assert np.sqrt(np.mean(begun[: blocks.first] ** 2)) > 3.0 * fits.best.scales[0]


def test_blocks_in_a_long_gap_of_speed_and_during_settling_after_it_are_blank() -> None:
    record = running(8.0, 0.0)
    speed, position = record["motor_speed_rad_s"].copy(), record["position_m"].copy()
    speed[2000:2300], position[3000:3300] = np.nan, np.nan
    blocks = blocks_of(record.replace(motor_speed_rad_s=speed, position_m=position))
    rows = round(0.01 / record.sample_time)
    blind = np.flatnonzero(np.isnan(blocks.velocity)) * rows
    behind = 2300 + round(SETTLING / record.sample_time)
    assert blind.tolist() == [*range(2000, behind, rows), *range(3000, 3300, rows)]
    assert blocks.pressure is not None
    assert np.flatnonzero(np.isnan(blocks.pressure)).tolist() == list(range(2000 // rows, behind // rows))


@pytest.mark.parametrize(
    ("drive", "sample_time", "most"),
    [
        ("prbs", 1e-4, (2.5e-4, 3e-4)),  # measured 1.7e-4 and 2.0e-4; with straight lines 4.7e-4 and 6.6e-4
        ("multisine", 1e-4, (6e-4, 4e-4)),  # 4.0e-4 and 2.5e-4; with lines 1.9e-3 and 8.8e-4
        ("prbs", 1e-3, (5e-4, 3e-4)),  # 3.8e-4 and 1.7e-4; with lines 7.7e-4 and 6.9e-4
        ("multisine", 1e-3, (4e-4, 3e-4)),  # 2.1e-4 and 1.5e-4; with lines 1.6e-3 and 6.9e-4
        ("steps", 1e-3, (8e-4, 5e-4)),  # 6.3e-4 and 2.5e-4; with lines 6.5e-4 and 1.5e-3
    ],
)
def test_a_circuit_follows_its_own_log_if_speed_is_curved_between_samples(
    drive: str, sample_time: float, most: tuple[float, float]
) -> None:
    actuator, true = actuator_of(HEALTHY), parameters_for(CONDITIONS["minor_leakage"])
    speed = make_drive(drive, 3.0, sample_time, HEALTHY, np.random.default_rng(0))
    blocks = blocks_of(simulate(CIRCUIT, speed, sample_time, circuit_of(true)))
    rows = parameter_rows(coordinates_of(true, actuator.rated)[None], actuator.circuit, actuator.rated)
    left = (blocks.outputs - predicted_outputs(blocks, rows)[0])[blocks.first :]
    assert np.all(root_mean_square(left) < np.array(most) * blocks.rms)


@pytest.mark.parametrize(
    ("sample_time", "smooth", "rough"), [(1e-4, 10, 5), (2e-4, 5, 2), (5e-4, 2, 1), (1e-3, 1, 1), (2e-3, 1, 1)]
)
def test_only_fast_logs_are_averaged_and_less_if_their_speed_is_rough(
    sample_time: float, smooth: int, rough: int
) -> None:
    rng, time = np.random.default_rng(0), sample_time * np.arange(8000)
    others = {name: rng.standard_normal(8000) for name in ("position_m", PRESSURE)}
    for speed, pooled in ((np.sin(10.0 * time), smooth), (rng.standard_normal(8000), rough)):
        blocks = blocks_of(Record(sample_time, {"motor_speed_rad_s": speed, **others}))
        assert blocks.sample_time == pytest.approx(pooled * sample_time)


@pytest.mark.parametrize(("drive", "pooled"), [("multisine", 10), ("steps", 10), ("prbs", 5)])
def test_a_binary_signal_is_averaged_less_than_steps_and_sines(drive: str, pooled: int) -> None:
    speed = make_drive(drive, 3.0, 1e-4, HEALTHY, np.random.default_rng(1))
    assert blocks_of(simulate(CIRCUIT, speed, 1e-4, circuit_of(HEALTHY))).sample_time == pytest.approx(pooled * 1e-4)


@pytest.mark.parametrize(("channel", "rows"), [("position_m", 5), ("velocity_m_s", 5), ("motor_speed_rad_s", 5)])
def test_a_fast_log_with_a_channel_that_is_sampled_more_slowly_has_the_blocks_of_the_whole_one(
    channel: str, rows: int
) -> None:
    rng = np.random.default_rng(5)
    drive = make_drive("multisine", 1.0, 2e-4, HEALTHY, rng)
    whole = simulate(CIRCUIT, drive, 2e-4, HEALTHY, sensors=RIG, rng=rng)
    whole = whole.replace(position_m=None) if channel == "velocity_m_s" else whole
    rare = np.where(np.arange(len(whole)) % rows == 0, whole[channel], np.nan)
    slow, full = blocks_of(whole.replace(**{channel: rare})), blocks_of(whole)
    assert np.all(np.isfinite(slow.velocity))
    left = np.abs(slow.velocity - full.velocity)
    assert float(np.max(left)) < 5.0 * float(np.hypot(slow.noise[0], full.noise[0]))
    assert slow.noise[0] >= 0.9 * full.noise[0]
    assert slow.noise[0] < 1.2 * rows**0.5 * full.noise[0]
    assert slow.speed == pytest.approx(full.speed, abs=0.03 * float(np.ptp(full.speed)))
