"""A still encoder is accused only if leakage cannot explain the motion that it misses, however leaky the actuator."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.log_checks.frozen_encoder import misses_motion
from estimation.log_checks.sensor_check import sensor_objections
from estimation.notes import SensorCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import DRIVES, make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
POSITION, VELOCITY, PRESSURE = "position_m", "velocity_m_s", "differential_pressure_pa"
VIEWS = pytest.mark.parametrize("absent", [(), (PRESSURE,), (VELOCITY,), (VELOCITY, PRESSURE)], ids=str)
LEAKAGES = pytest.mark.parametrize("leakage", thinned([1.0, 4.0, 8.0, 12.0, 20.0], [1.0, 12.0]))


@cache
def run(leakage: float, drive: str, condition: str = "normal") -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(5)
    p = replace(p, leakage_coefficient=leakage * p.leakage_coefficient)
    return simulate(LUMPED, make_drive(drive, 8.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def frozen(log: Record, length: int) -> tuple[Record, int]:
    """Return the log with an encoder that freezes where the piston goes farthest, and the row at which it freezes."""
    position = log[POSITION].copy()
    start = 500 + int(np.argmax(np.abs(position[1000:-1000] - position[500:-1500])))
    position[start : start + length] = position[start]
    return log.replace(**{POSITION: position}), start


@LEAKAGES
@pytest.mark.parametrize("drive", list(DRIVES))
@VIEWS
def test_a_sound_encoder_is_not_accused(absent: tuple[str, ...], drive: str, leakage: float) -> None:
    for condition in ("normal", "major_friction", "major_leakage"):
        log = run(leakage, drive, condition).replace(**dict.fromkeys(absent))
        assert sensor_objections(log, HEALTHY) == ()


@LEAKAGES
@pytest.mark.parametrize("drive", ["steps", "prbs"])
@VIEWS
def test_an_encoder_that_freezes_for_half_a_second_on_the_move_is_named(
    absent: tuple[str, ...], drive: str, leakage: float
) -> None:
    log, start = frozen(run(leakage, drive), 500)
    (said,) = sensor_objections(log.replace(**dict.fromkeys(absent)), HEALTHY)
    assert (said.code, said.data["channel"]) == (SensorCode.SENSOR_FROZE, POSITION)
    assert said.data["begin_s"] == pytest.approx(1e-3 * start, abs=2e-3)


@pytest.mark.parametrize("leakage", [1.0, 4.0, 8.0])
@pytest.mark.parametrize("absent", [(), (PRESSURE,), (VELOCITY,)], ids=str)
def test_an_encoder_that_freezes_for_good_is_named(absent: tuple[str, ...], leakage: float) -> None:
    log, _ = frozen(run(leakage, "steps"), 8000)
    assert [note.data["channel"] for note in sensor_objections(log.replace(**dict.fromkeys(absent)), HEALTHY)] == [
        POSITION
    ]


def test_an_encoder_that_freezes_while_the_piston_yields_on_its_seals_is_named() -> None:
    """A log with its second half frozen passed as air that enters or as a unit of speed: it misses less than 0.5 mm."""
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(18811)
    log = simulate(CIRCUIT, make_drive("sine", 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    unseen = log.replace(**{VELOCITY: None})
    assert sensor_objections(unseen, HEALTHY) == ()
    (said,) = sensor_objections(frozen(unseen, 4000)[0], HEALTHY)
    assert (said.code, said.data["channel"]) == (SensorCode.SENSOR_FROZE, POSITION)
    found = estimate_bulk_modulus(frozen(unseen, 4000)[0], HEALTHY)
    assert (found.value, found.explanation, found.gate.reasons) == (None, None, (said,))


def test_flow_bias_explains_a_still_encoder_though_the_motor_rests_most_of_the_log() -> None:
    p, rng, rows = HEALTHY, np.random.default_rng(0), np.arange(10_000)
    bias = 6.0 * p.flow_bias
    speed = np.where(rows % 2500 < 500, np.where(rows // 2500 % 2, -90.0, 90.0), 0.0)
    hold = slice(6000, 7000)
    speed[hold] = 0.9 * bias / p.pump_displacement  # the flow bias takes all of it
    moved = np.sign(speed) * np.maximum(p.pump_displacement * np.abs(speed) - bias, 0.0) / p.piston_area
    log = Record(
        1e-3,
        {
            "motor_speed_rad_s": speed + 0.1 * rng.normal(size=len(rows)),
            POSITION: 2e-4 * np.round(np.cumsum(moved) * 1e-3 / 2e-4),
            PRESSURE: 1e3 * rng.normal(size=len(rows)),
        },
    )
    assert not misses_motion(log, hold, p)
    fast = np.where((rows >= hold.start) & (rows < hold.stop), 3.0 * speed, log["motor_speed_rad_s"])
    assert misses_motion(log.replace(motor_speed_rad_s=fast), hold, p)
