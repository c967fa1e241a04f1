"""A sensor that has stopped telling the truth is named; a sound log, however coarse or still, is not accused."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from estimation.sensor_check import holds, sensor_objections, without_saturated
from faults.conditions import CONDITIONS, parameters_for
from plant.eha import EhaParameters
from plant.record import Record
from plant.record_files import read_record
from plant.sensor_faults import SensorFault, with_fault
from plant.sensors import BENCH, IDEAL, RIG, Sensors
from plant.signals import make_drive
from plant.simulate import LUMPED, simulate

RIG_PARAMETERS = EhaParameters()
PRESSURE = "differential_pressure_pa"


def run(drive: str = "steps", condition: str = "normal", sensors: Sensors = BENCH, sample_time: float = 1e-3) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(3)
    return simulate(LUMPED, make_drive(drive, 6.0, sample_time, p, rng), sample_time, p, sensors=sensors, rng=rng)


@pytest.mark.parametrize(
    ("condition", "drive", "sensors"),
    list(product(("normal", "major_leakage", "major_friction"), ("sine", "steps", "prbs"), (BENCH, RIG, IDEAL))),
)
def test_sound_logs_are_not_accused(condition: str, drive: str, sensors: Sensors) -> None:
    assert sensor_objections(run(drive, condition, sensors), RIG_PARAMETERS) == ()


def test_no_log_of_the_foreign_bench_is_accused(shared: Path) -> None:
    for path in sorted((shared / "bench").glob("run*.csv")):
        assert sensor_objections(read_record(path), RIG_PARAMETERS) == ()


@pytest.mark.parametrize("channel", ["position_m", "velocity_m_s", PRESSURE])
def test_a_frozen_sensor_is_named(channel: str) -> None:
    (said,) = sensor_objections(
        with_fault(run(), SensorFault(channel=channel, kind="freeze", start=3.0)), RIG_PARAMETERS
    )
    assert said.startswith(channel)
    assert "froze" in said


def test_a_pressure_sensor_that_shows_nothing_is_named() -> None:
    log = run()
    (unplugged,) = sensor_objections(log.replace(**{PRESSURE: np.zeros(len(log))}), RIG_PARAMETERS)
    assert "throughout" in unplugged
    noise = np.random.default_rng(1).normal(0.0, 5e3, len(log))
    (dead,) = sensor_objections(log.replace(**{PRESSURE: noise}), RIG_PARAMETERS)
    assert "noise and nothing else" in dead


def test_samples_at_the_end_of_a_sensors_range_are_taken_out() -> None:
    log = run()
    limit = 0.6 * float(np.max(np.abs(log[PRESSURE])))
    clipped = with_fault(log, SensorFault(channel=PRESSURE, kind="saturation", size=limit))
    cleaned, lost = without_saturated(clipped, [PRESSURE])
    beyond = np.abs(log[PRESSURE]) > limit
    assert lost[PRESSURE] == np.count_nonzero(np.isnan(cleaned[PRESSURE])) >= np.count_nonzero(beyond)
    assert float(np.nanmax(np.abs(cleaned[PRESSURE]))) < limit


def test_a_sound_pressure_loses_nothing() -> None:
    for drive in ("sine", "steps", "prbs"):
        log = run(drive)
        assert without_saturated(log, [PRESSURE]) == (log, {})


def test_a_missing_sample_ends_a_hold() -> None:
    starts, lengths = holds(np.array([1.0, 1.0, np.nan, 1.0, 1.0]))
    assert list(zip(starts.tolist(), lengths.tolist(), strict=True)) == [(0, 2), (2, 1), (3, 2)]
