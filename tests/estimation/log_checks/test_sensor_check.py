"""A sensor that no longer reads correctly is named; a sound log, however coarse or still, is not accused."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from estimation.log_checks.sensor_check import (
    _frozen_velocity,
    holds,
    sensor_objections,
    shows_motion,
    without_saturated,
)
from estimation.notes import SensorCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.faults import SensorFault, with_fault
from plant.sensors.sensors import BENCH, IDEAL, RIG, Sensors

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
    logs = sorted((shared / "bench").glob("run*.csv"))
    assert len(logs) == 18
    for path in logs:
        assert sensor_objections(read_record(path), RIG_PARAMETERS) == ()


@pytest.mark.parametrize("channel", ["position_m", "velocity_m_s", PRESSURE])
def test_a_frozen_sensor_is_named(channel: str) -> None:
    (said,) = sensor_objections(
        with_fault(run(), SensorFault(channel=channel, kind="freeze", start=3.0)), RIG_PARAMETERS
    )
    assert said.code == SensorCode.SENSOR_FROZE
    assert said.data["channel"] == channel
    assert said.data["begin_s"] == pytest.approx(3.0, abs=0.01)
    assert said.data["length_s"] == pytest.approx(3.0, abs=0.01)


@pytest.mark.parametrize("start", [0.5, 1.5, 2.5, 3.5, 4.5])
def test_a_frozen_velocity_does_not_accuse_the_encoder(start: float) -> None:
    frozen = with_fault(run(), SensorFault(channel="velocity_m_s", kind="freeze", start=start))
    assert {note.data["channel"] for note in sensor_objections(frozen, RIG_PARAMETERS)} == {"velocity_m_s"}


@pytest.mark.parametrize("said", [0.05, 0.08])
def test_a_constant_velocity_is_accused_only_if_it_contradicts_the_encoder_beside_a_drop_out(said: float) -> None:
    time = 1e-3 * np.arange(6000)
    steady = (time >= 2.0) & (time < 4.0)
    true = np.where(steady, 0.05, 0.05 + 0.01 * np.sin(20.0 * (time - 2.0)))
    position = 1e-6 * np.round(1e3 * np.cumsum(true))
    position[2000:2500] = np.nan  # a drop-out as the steady motion begins
    record = Record(1e-3, {"motor_speed_rad_s": 100.0 + time, "position_m": position})
    found = _frozen_velocity(record.replace(velocity_m_s=np.where(steady, said, true)))
    assert (found is not None) is (said != 0.05)


def test_a_constant_pressure_or_one_of_noise_only_is_named() -> None:
    log = run()
    (unplugged,) = sensor_objections(log.replace(**{PRESSURE: np.zeros(len(log))}), RIG_PARAMETERS)
    assert unplugged == SensorCode.SENSOR_CONSTANT.note(channel=PRESSURE, value=0.0)
    noise = np.random.default_rng(1).normal(0.0, 5e3, len(log))
    (dead,) = sensor_objections(log.replace(**{PRESSURE: noise}), RIG_PARAMETERS)
    assert (dead.code, dead.data["channel"]) == (SensorCode.SENSOR_NOISE_ONLY, PRESSURE)
    assert dead.data["noise"] == pytest.approx(5e3, rel=0.05)


@pytest.mark.parametrize("counts", [0, 1])
def test_a_pressure_of_noise_only_is_not_accused_if_a_slow_pump_moves_no_piston(counts: int) -> None:
    log, rng = run(), np.random.default_rng(1)
    still = 1e-6 * rng.integers(0, counts + 1, len(log))
    slow = log.replace(
        motor_speed_rad_s=0.05 * log["motor_speed_rad_s"],
        **{PRESSURE: rng.normal(0.0, 5e3, len(log)), "position_m": still},
    )
    assert SensorCode.SENSOR_NOISE_ONLY not in [one.code for one in sensor_objections(slow, RIG_PARAMETERS)]


def test_a_pressure_of_noise_only_is_not_accused_if_the_motor_rests() -> None:
    """The noise of three sensors was taken for a motor that turns and a pressure sensor that is dead."""
    rng = np.random.default_rng(1)
    sizes = {"motor_speed_rad_s": 0.05, "position_m": 1e-6, PRESSURE: 3e3}
    rest = Record(1e-3, {name: size * rng.normal(size=2000) for name, size in sizes.items()})
    assert sensor_objections(rest, RIG_PARAMETERS) == ()
    turns = rest.replace(motor_speed_rad_s=100.0 + rest["motor_speed_rad_s"])
    assert [one.code for one in sensor_objections(turns, RIG_PARAMETERS)] == [SensorCode.SENSOR_NOISE_ONLY]


@pytest.mark.parametrize("seed", [2, 4, 11])
def test_twenty_samples_are_too_few_to_call_a_pressure_sensor_dead(seed: int) -> None:
    """If four tenths of a sample stay in the next, one live sensor in six was called dead, these among them."""
    rng = np.random.default_rng(seed)
    load = np.convolve(rng.normal(size=21), [0.9, 0.4], mode="valid")
    short = Record(
        5e-2, {"motor_speed_rad_s": 100.0 + rng.normal(size=20), "position_m": np.cumsum(load), PRESSURE: load}
    )
    assert sensor_objections(short, RIG_PARAMETERS) == ()


def clipped(record: Record, share: float) -> tuple[Record, float]:
    limit = 500.0 * round(share * float(np.max(np.abs(record[PRESSURE]))) / 500.0)
    return with_fault(record, SensorFault(channel=PRESSURE, kind="saturation", size=limit)), limit


@pytest.mark.parametrize("share", [0.9, 0.6])
@pytest.mark.parametrize("drive", ["steps", "prbs"])
@pytest.mark.parametrize("condition", ["normal", "major_friction", "major_leakage"])
def test_samples_at_the_end_of_a_sensors_range_are_taken_out(condition: str, drive: str, share: float) -> None:
    record, limit = clipped(run(drive, condition), share)
    cleaned, (said,) = without_saturated(record, RIG_PARAMETERS)
    at_the_end = np.abs(record[PRESSURE]) == limit
    reached = np.max(np.abs(cleaned[PRESSURE][np.isfinite(cleaned[PRESSURE])]))
    assert np.all(np.isnan(cleaned[PRESSURE][at_the_end]))
    assert reached < limit
    assert (said.code, said.data["channel"]) == (SensorCode.SENSOR_CLIPPED, PRESSURE)
    assert said.data["percent"] == pytest.approx(100.0 * np.mean(at_the_end), rel=1e-9)


def test_a_pressure_that_hovers_at_the_end_of_its_range_is_almost_wholly_taken_out() -> None:
    noise = np.random.default_rng(1).normal(0.0, 5e3, 6000)
    hovering = np.where(np.arange(6000) % 2000 < 1000, 0.0, 4.95e5) + 500.0 * np.round(noise / 500.0)
    log = Record(1e-3, {PRESSURE: np.minimum(hovering, 5e5)})
    kept = without_saturated(log, RIG_PARAMETERS)[0][PRESSURE]
    assert np.count_nonzero(np.isfinite(kept[hovering > 4e5])) < 100
    assert np.all(np.isfinite(kept[hovering < 4e5]))


@pytest.mark.parametrize("quantum", [500.0, 1e4])
@pytest.mark.parametrize("noise", [5e3, 0.0])
def test_a_relief_valves_plateau_is_no_end_of_a_range(noise: float, quantum: float) -> None:
    p, rng = replace(parameters_for(CONDITIONS["major_friction"]), relief_pressure=1.5e6), np.random.default_rng(3)
    sensors = replace(BENCH, pressure_noise=noise, pressure_quantum=quantum)
    log = simulate(LUMPED, make_drive("steps", 6.0, 1e-3, p, rng), 1e-3, p, sensors=sensors, rng=rng)
    assert np.mean(np.abs(log[PRESSURE]) > 0.99 * p.relief_pressure) > 0.1
    assert without_saturated(log, p) == (log, ())


def test_a_sound_pressure_loses_no_samples() -> None:
    for drive, sensors in product(("sine", "steps", "prbs"), (BENCH, IDEAL, replace(BENCH, pressure_quantum=2e4))):
        log = run(drive, sensors=sensors)
        assert without_saturated(log, RIG_PARAMETERS) == (log, ())


def test_a_clipped_chamber_pressure_is_also_taken_out_of_the_difference() -> None:
    log = run()
    low = np.random.default_rng(1).normal(2.758e5, 5e3, len(log))
    chambers = {
        "pressure_a_pa": np.maximum(log[PRESSURE], 0.0) + low,
        "pressure_b_pa": low - np.minimum(log[PRESSURE], 0.0),
    }
    limit = 0.7 * np.max(chambers["pressure_a_pa"])
    chambers["pressure_a_pa"] = np.minimum(chambers["pressure_a_pa"], limit)
    derived = log.replace(**chambers, **{PRESSURE: chambers["pressure_a_pa"] - chambers["pressure_b_pa"]})
    cleaned, (said,) = without_saturated(derived, RIG_PARAMETERS)
    assert (said.code, said.data["channel"]) == (SensorCode.SENSOR_CLIPPED, "pressure_a_pa")
    assert np.all(np.isnan(cleaned[PRESSURE][chambers["pressure_a_pa"] == limit]))
    sensor_of_its_own = without_saturated(log.replace(**chambers), RIG_PARAMETERS)[0]
    assert np.array_equal(sensor_of_its_own[PRESSURE], log[PRESSURE])


@pytest.mark.parametrize("channel", ["position_m", PRESSURE])
def test_a_slow_sensor_that_froze_is_named_and_a_sound_one_is_not(channel: str) -> None:
    log, every_tenth = run(sample_time=1e-4), np.arange(60_000) % 10 == 3
    for record, accused in ((log, 0), (with_fault(log, SensorFault(channel=channel, kind="freeze", start=3.0)), 1)):
        slow = record.replace(**{name: np.where(every_tenth, record[name], np.nan) for name in (channel,)})
        assert len(sensor_objections(slow, RIG_PARAMETERS)) == accused


def test_an_encoder_is_not_accused_while_the_pressure_is_clipped() -> None:
    log, stuck = run(), slice(2000, 4000)
    channels = {name: log[name].copy() for name in ("motor_speed_rad_s", "position_m", PRESSURE)}
    for name, value in zip(channels, (10.0, 0.1, np.nan), strict=True):
        channels[name][stuck] = value
    assert sensor_objections(log.replace(**channels, velocity_m_s=None), RIG_PARAMETERS) == ()


def test_a_missing_sample_ends_a_hold() -> None:
    starts, lengths = holds(np.array([1.0, 1.0, np.nan, 1.0, 1.0]))
    assert list(zip(starts.tolist(), lengths.tolist(), strict=True)) == [(0, 2), (2, 1), (3, 2)]


@pytest.mark.parametrize(("speed", "found"), [(1e-3, (True, False)), (1e-4, (False, True))])
def test_velocity_shows_motion_if_its_path_exceeds_the_encoders_resolution(
    speed: float, found: tuple[bool, bool]
) -> None:
    noise = 1e-7 * np.random.default_rng(1).standard_normal(400)
    steps = 1e-5 * np.round(np.linspace(0.0, 40.0, 400))
    record = Record(1e-3, {"position_m": steps, "velocity_m_s": speed + noise})
    assert shows_motion(record, slice(100, 300)) == found


def test_sensors_with_few_or_no_samples_are_not_accused() -> None:
    record = run()
    few = np.where(np.arange(len(record)) < 5, 1.0, np.nan)
    for channel in ("position_m", "velocity_m_s", PRESSURE):
        assert sensor_objections(record.replace(**{channel: few}), RIG_PARAMETERS) == ()
        assert sensor_objections(record.replace(**{channel: few * np.nan}), RIG_PARAMETERS) == ()
        assert without_saturated(record.replace(**{channel: few}), RIG_PARAMETERS)[1] == ()


def test_a_still_velocity_is_not_accused_without_an_encoder() -> None:
    frozen = with_fault(run(), SensorFault(channel="velocity_m_s", kind="freeze", start=3.0))
    gone = np.where(frozen.time < 2.9, frozen["position_m"], np.nan)
    for other in (frozen.replace(position_m=None), frozen.replace(position_m=gone)):
        assert "velocity_m_s" not in {note.data["channel"] for note in sensor_objections(other, RIG_PARAMETERS)}


def test_the_noise_of_an_averaged_velocity_is_no_motion_of_a_piston_that_is_stuck() -> None:
    rows, still, moving = 5, slice(3000, 3100), 0.03 * (np.arange(6000) // 1500 % 2)
    position = 1e-6 * np.round(1e3 * np.cumsum(moving) + np.arange(6000) / 50)  # an encoder of 1 um
    position[still] = position[still.start]
    accused = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        noise = np.convolve(1e-3 * rng.standard_normal(6000 + rows - 1), np.ones(rows) / rows, "valid")
        record = Record(1e-3, {"position_m": position, "velocity_m_s": moving + noise})
        assert not shows_motion(record, still)[0]
        noise[still] += 3e-3
        accused += shows_motion(record.replace(velocity_m_s=moving + noise), still)[0]
    assert accused == 40  # three millimetres a second are motion
