import numpy as np
import pytest

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.motion import log as motion_log
from estimation.log_checks.coarse_means import coarse_mean_variance
from estimation.log_checks.measurement_noise import position_variance
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()


def log_of_steps(seconds: float, sample_time: float, rest: float = 0.0) -> Record:
    """Return a log of the healthy actuator, whose motor stands still at first [s]."""
    steps = make_drive("steps", seconds, sample_time, HEALTHY, np.random.default_rng(1))
    speed = np.concatenate([np.zeros(round(rest / sample_time)), steps])
    return simulate(PLANTS["lumped"], speed, sample_time, HEALTHY, sensors=BENCH, rng=np.random.default_rng(2))


@pytest.fixture(scope="module")
def whole() -> Record:
    """Return a log of steps at 5 kHz, five rows of which make one sample of the motion form."""
    return log_of_steps(1.5, 2e-4)


def read_every(record: Record, channel: str, rows: int) -> Record:
    values = np.full(len(record), np.nan)
    values[::rows] = record[channel][::rows]
    return record.replace(**{channel: values})


def fitted(record: Record, speed_variance: float = 1e-4) -> GreyBoxLog:
    return motion_log.motion_log(record, HEALTHY, {}, speed_variance)


@pytest.mark.parametrize("rows", [2, 5, 10])
def test_a_position_read_more_slowly_than_the_rows_of_a_fast_log_is_fitted(whole: Record, rows: int) -> None:
    """Before, no block had all its samples, and `diagnose --no-pressure` ended without a class."""
    slow, usual = read_every(whole, "position_m", rows), fitted(whole)
    log = fitted(slow)
    there = np.isfinite(log.measured[:, 0])
    assert np.mean(there) > 0.98
    assert np.nanmax(np.abs(log.measured - usual.measured)) < 0.01 * np.ptp(usual.measured)
    assert log.noise[0].variance == pytest.approx(
        position_variance(slow["position_m"]) / max(1.0, 5 / rows), rel=1e-6, abs=0.0
    )
    assert log.noise[0].walk == usual.noise[0].walk


def test_a_motor_speed_read_more_slowly_is_fitted(whole: Record) -> None:
    log = fitted(read_every(whole, "motor_speed_rad_s", 5))
    assert np.all(np.isfinite(log.drives))


def test_nothing_changes_in_a_log_without_a_slow_channel(whole: Record) -> None:
    block_means = whole["position_m"][: len(whole) // 5 * 5].reshape(-1, 5).mean(axis=1)
    assert np.array_equal(fitted(whole).measured[:, 0], block_means - block_means[0])


def test_fast_logs_are_averaged_to_a_millisecond() -> None:
    record = log_of_steps(0.3, 2.5e-4)
    log = fitted(record, speed_variance=4.0)
    assert log.sample_time == pytest.approx(1e-3)
    blocks = len(record["position_m"]) // 4
    means = record["position_m"][: 4 * blocks].reshape(-1, 4).mean(axis=1)
    assert log.measured[:, 0] == pytest.approx(means - means[0])
    counted = coarse_mean_variance(record["position_m"], 4)  # of a micrometre, which is above the encoder's noise
    assert log.noise[0].variance == pytest.approx(counted, rel=1e-6, abs=0.0)
    assert counted > position_variance(record["position_m"]) / 4
    assert log.noise[0].walk == pytest.approx((HEALTHY.pump_displacement / HEALTHY.piston_area) ** 2 * 4.0 * 2.5e-4)


def test_the_end_of_a_very_long_log_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion_log, "MOST_SAMPLES", 100)
    assert fitted(log_of_steps(0.3, 1e-3)).drives.shape == (100, 2)


def test_steps_are_short_at_piston_reversals_and_pump_starts() -> None:
    t = 1e-3 * np.arange(400)
    speed = np.where(t > 0.2, 50.0, 0.0)  # starts at sample 201
    position = 1e-2 * np.abs(t - 0.1)  # reverses at sample 100
    steps = motion_log._steps(np.column_stack([speed, position]), 1e-3)
    assert set(steps) == {4, 16}
    fine = np.flatnonzero(steps[5:-5] == 16) + 5  # smoothing distorts the ends
    assert list(fine) == [99, 100, 101, 201]


def test_a_long_log_that_stands_still_at_first_is_fitted_where_it_moves() -> None:
    """Before, the first 30 s alone were fitted, in which nothing moved."""
    log = fitted(log_of_steps(1.0, 1e-3, rest=40.0))
    assert len(log.drives) == pytest.approx(1_500, abs=20)
    assert np.ptp(log.measured) > 1e-3
