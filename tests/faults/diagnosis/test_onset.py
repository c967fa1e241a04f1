"""A change of condition within a log: when it came, and that the verdict is on what followed."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.population import TEST, draw_logs
from benchmarks.watching import CircuitStream
from estimation.log_checks.clean import clean_log
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuit_runs import Blocks
from faults.diagnosis.class_fit import Actuator, PointFit
from faults.diagnosis.diagnose import Diagnosis, diagnose_clean
from faults.diagnosis.onset import likeliest_split, part_of
from faults.eha.inject import abrupt
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import RIG

HEALTHY = EhaParameters()
ACTUATOR = Actuator.of(HEALTHY)
AT = 3.2


def diagnosed(record: Record) -> Diagnosis:
    return diagnose_clean(clean_log(record, HEALTHY), ACTUATOR)


def changed(condition: str, drive: str, *, pressure: bool, start: float = 0.0) -> Diagnosis:
    rng = np.random.default_rng(11)
    speed = make_drive(drive, 6.0, 1e-3, EhaParameters(), rng)
    path = abrupt(ACTUATOR.circuit, circuit_of(parameters_for(CONDITIONS[condition])), AT)
    log = replace(simulate(CIRCUIT, speed, 1e-3, path, sensors=RIG, rng=rng), start_time=start)
    return diagnosed(log if pressure else log.replace(differential_pressure_pa=None))


@pytest.mark.slow
@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "without"])
@pytest.mark.parametrize(("condition", "drive"), [("minor_leakage", "steps"), ("major_friction", "prbs")])
def test_a_fault_that_comes_within_a_log_is_named_with_its_time(condition: str, drive: str, *, pressure: bool) -> None:
    found = changed(condition, drive, pressure=pressure)
    onset = found.scoreboard.onset
    assert found.condition == condition
    assert onset is not None
    assert onset.before == "normal"
    assert onset.ci95[0] <= AT <= onset.ci95[1]
    assert onset.ci95[1] - onset.ci95[0] < 0.5


@pytest.mark.slow
def test_the_time_is_that_of_the_logs_own_clock() -> None:
    onset = changed("major_leakage", "prbs", pressure=True, start=100.0).scoreboard.onset
    assert onset is not None
    assert onset.since == pytest.approx(100.0 + AT, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("like", [True, False], ids=["the circuit that is fitted", "another circuit"])
def test_a_fault_that_was_there_before_the_log_began_has_no_time(*, like: bool) -> None:
    for log in draw_logs([TEST + 40], like=like):
        assert diagnosed(log.record).scoreboard.onset is None


@pytest.mark.slow
def test_a_fault_late_in_a_long_log_is_found_by_the_watch_and_told() -> None:
    stream = CircuitStream(3)
    before = [stream.run(60.0), stream.run(30.0)]
    stream.condition = "major_leakage"
    samples = np.vstack([*before, stream.run(20.0)])
    names = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")
    found = diagnosed(Record(1e-3, dict(zip(names, samples.T.copy(), strict=True))))
    assert found.condition == "major_leakage"
    assert found.scoreboard.onset is not None
    assert found.scoreboard.onset.since == pytest.approx(90.0, abs=0.3)


def flat(velocity: np.ndarray) -> tuple[Blocks, PointFit]:
    """A log of one output, and a model of it that can only shift it."""
    blocks = Blocks(np.zeros(10 * len(velocity) + 1), 1e-3, 10, velocity, None, np.array([1.0]))
    slopes = np.zeros((7, len(velocity), 1))
    slopes[0] = 1.0
    fitted = np.full((len(velocity), 1), float(np.mean(velocity)))
    scale = np.array([float(np.std(velocity))])
    return blocks, PointFit(ACTUATOR.conditions[0], 0.0, np.eye(7), scale, fitted, slopes)


def test_a_jump_splits_a_log_where_it_is_and_noise_does_not() -> None:
    noise = np.random.default_rng(0).normal(size=800)
    assert likeliest_split(*flat(noise)) is None
    jump = np.where(np.arange(800) < 300, 0.0, 5.0)
    place = likeliest_split(*flat(noise + jump))
    assert place is not None
    assert abs(place - 300) <= 1


def test_a_log_too_short_to_hold_a_change_is_not_split() -> None:
    assert likeliest_split(*flat(np.where(np.arange(150) < 75, 0.0, 9.0))) is None


def test_a_part_keeps_the_drive_and_misses_the_rest() -> None:
    blocks, _ = flat(np.arange(20.0))
    part = part_of(blocks, 5, 12)
    assert np.flatnonzero(np.isfinite(part.velocity)).tolist() == list(range(5, 12))
    assert part.speed is blocks.speed
