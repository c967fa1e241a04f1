"""A velocity sensor that does not read zero at rest."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.velocity_offset import (
    CERTAIN,
    LEAST_OFFSET_SHARE,
    LEAST_PARTS,
    PARTS,
    without_velocity_offset,
)
from estimation.notes import SensorCode
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

PAPER = EhaParameters()
NOISE = 1e-3


def moved(*, gain: float = 1.0, offset: float = 0.0, size: float = 0.02, seed: int = 1, count: int = 8000) -> Record:
    rng = np.random.default_rng(seed)
    velocity = size * np.cumsum(rng.standard_normal(count)) / 50.0
    position = np.concatenate([[0.0], np.cumsum(0.5e-3 * (velocity[1:] + velocity[:-1]))])
    sensed = gain * velocity + offset + NOISE * rng.standard_normal(count)
    return Record(1e-3, {"motor_speed_rad_s": velocity * 1e3, "position_m": position, "velocity_m_s": sensed})


@pytest.mark.parametrize("gain", [1.0, 1.08])
def test_an_offset_is_subtracted_whatever_the_gain(gain: float) -> None:
    found, (note,) = without_velocity_offset(moved(gain=gain, offset=2e-3))
    assert note.code is SensorCode.VELOCITY_OFFSET
    assert note.data["offset_m_s"] == pytest.approx(2e-3, abs=4.0 * NOISE / 8000**0.5)
    assert found["velocity_m_s"] == pytest.approx(
        moved(gain=gain, offset=2e-3)["velocity_m_s"] - note.data["offset_m_s"]
    )


def test_an_offset_is_also_found_from_a_still_piston() -> None:
    _, (note,) = without_velocity_offset(moved(offset=-1e-3, size=0.0))
    assert note.data["offset_m_s"] == pytest.approx(-1e-3, rel=0.05)


@pytest.mark.parametrize("gain", [1.0, 0.9])
def test_noise_and_a_wrong_gain_are_no_offset(gain: float) -> None:
    for seed in range(40):
        record = moved(gain=gain, seed=seed)
        assert without_velocity_offset(record) == (record, ())


def test_an_offset_is_subtracted_only_if_it_is_large_enough_and_significant() -> None:
    for offset, told in ((1.1 * LEAST_OFFSET_SHARE, True), (0.9 * LEAST_OFFSET_SHARE, False)):
        size = float(np.sqrt(np.mean(moved(size=1.0)["velocity_m_s"] ** 2)))
        assert bool(without_velocity_offset(moved(size=1.0, offset=offset * size))[1]) is told
    error = NOISE / 8000**0.5
    for deviations, told in ((2.0 * CERTAIN, True), (0.5 * CERTAIN, False)):
        assert bool(without_velocity_offset(moved(size=1e-9, offset=deviations * error))[1]) is told


def test_a_log_without_enough_position_or_velocity_is_unchanged() -> None:
    record = moved(offset=2e-3)
    for name in ("position_m", "velocity_m_s"):
        assert without_velocity_offset(record.replace(**{name: None}))[1] == ()
    nothing = record.replace(velocity_m_s=np.full(len(record), np.nan))
    assert without_velocity_offset(nothing)[1] == ()
    for parts, told in ((LEAST_PARTS, True), (LEAST_PARTS - 1, False)):
        position = record["position_m"].copy()
        position[round(parts * len(record) / PARTS) :] = np.nan
        assert bool(without_velocity_offset(record.replace(position_m=position))[1]) is told


def test_an_offset_is_found_despite_missing_samples() -> None:
    record = moved(offset=2e-3)
    velocity = record["velocity_m_s"].copy()
    velocity[::17] = np.nan
    _, (note,) = without_velocity_offset(record.replace(velocity_m_s=velocity))
    assert note.data["offset_m_s"] == pytest.approx(2e-3, rel=0.05)


def test_a_log_with_a_velocity_offset_is_still_diagnosed() -> None:
    rng = np.random.default_rng(2)
    record = simulate(CIRCUIT, make_drive("prbs", 3.0, 1e-3, PAPER, rng), 1e-3, PAPER, sensors=BENCH, rng=rng)
    off = record.replace(velocity_m_s=record["velocity_m_s"] + 3e-3)
    assert clean_log(record, PAPER).left_out == ()
    found = diagnose_log(off, Rig())
    assert found.condition == "normal"
    assert found.against == ()
    assert [note.code for note in found.notes].count(SensorCode.VELOCITY_OFFSET) == 1


def test_a_frozen_velocity_is_named_without_an_offset() -> None:
    """A sensor that froze while the piston moved was said to read 20 mm/s too much, then to have frozen."""
    log = moved(seed=4, size=0.2)
    frozen = log.replace(velocity_m_s=np.where(np.arange(8000) < 1000, log["velocity_m_s"], 0.03))
    assert without_velocity_offset(frozen)[1]
    cleaned = clean_log(frozen, PAPER)
    assert [note.code for note in cleaned.objections] == [SensorCode.SENSOR_FROZE]
    assert SensorCode.VELOCITY_OFFSET not in [note.code for note in cleaned.left_out]
