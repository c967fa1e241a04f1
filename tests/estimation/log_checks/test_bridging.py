"""The uncertainty of a straight line across missing samples enters a filter's belief, no more and no less."""

import numpy as np
import pytest

from estimation.eha.by_flow_filter import filter_flow
from estimation.filters.ekf import ekf
from estimation.filters.filterpy_bridge import filterpy_ekf
from estimation.filters.run import filter_problem, run_filter
from estimation.filters.ukf import ukf
from estimation.log_checks.bridging import angle_variance, bridged, gaps, path_variance
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

T = 1e-3
PRESSURE = "differential_pressure_pa"
HEALTHY = EhaParameters()
PRIOR = Gaussian(np.array([0.0, 0.0, 0.5]), np.diag([1e-6, 1e-4, 1.0]))
VARIANCES = {"position_m": 1e-10, "velocity_m_s": 1e-6}


def prbs(duration: float = 10.0) -> Record:
    rng = np.random.default_rng(21)
    return simulate(LUMPED, make_drive("prbs", duration, T, HEALTHY, rng), T, HEALTHY, sensors=BENCH, rng=rng)


def without(record: Record, channel: str, first: int, after: int) -> Record:
    values = record[channel].copy()
    values[first:after] = np.nan
    return record.replace(**{channel: values})


def noisy_record(samples: int = 400) -> Record:
    rng = np.random.default_rng(3)
    channels = {"motor_speed_rad_s": 1e2, "position_m": 1e-3, "velocity_m_s": 1e-2}
    return Record(0.01, {name: rng.normal(0.0, size, samples) for name, size in channels.items()})


def test_the_variance_added_in_a_gap_is_one_to_two_times_that_of_a_random_walk() -> None:
    walks = np.cumsum(np.random.default_rng(1).normal(0.0, 3.0, (4000, 400)), axis=1)
    holed = walks.copy()
    holed[:, 200:230] = np.nan
    strayed = [T * np.sum(walk - bridged(seen)) for walk, seen in zip(walks, holed, strict=True)]
    opened = np.mean([np.sum(angle_variance(seen, T)) for seen in holed])
    assert np.var(strayed) < opened < 2.0 * np.var(strayed)


def test_the_variance_added_in_a_gap_is_that_of_a_step() -> None:
    whens = np.arange(100, 111)
    speeds = np.where(np.arange(300) < whens[:, None], -100.0, 100.0)
    holed = speeds.copy()
    holed[:, 100:110] = np.nan
    strayed = [T * np.sum(speed - bridged(seen)) for speed, seen in zip(speeds, holed, strict=True)]
    opened = np.mean([np.sum(angle_variance(seen, T)) for seen in holed])
    assert np.var(strayed) == pytest.approx(opened, rel=1e-9)


def test_a_slow_sensor_has_no_gaps_and_adds_variance_only_at_its_steps() -> None:
    speed = np.full(1000, np.nan)
    speed[3::10] = np.where(np.arange(100) < 50, -100.0, 100.0)
    assert not np.any(gaps(speed)[1])
    assert np.flatnonzero(angle_variance(speed, T)).tolist() == list(range(494, 504))
    position = np.where(np.isnan(speed), np.nan, np.linspace(0.0, 0.1, 1000) ** 2)
    assert not np.any(path_variance(position, T))


def test_the_ends_of_a_log_are_gaps_too() -> None:
    speed = np.cumsum(np.random.default_rng(1).normal(0.0, 3.0, 200))
    speed[:20] = speed[-10:] = np.nan
    opened = angle_variance(speed, T)
    assert opened[0] == 0.0
    assert np.all(opened[1:21] > 0.0)
    assert np.all(opened[-10:] > 0.0)
    assert not np.any(opened[21:-10])


def test_a_log_without_gaps_is_filtered_with_the_original_model(linear: ProcessModel) -> None:
    record = noisy_record()
    problem = filter_problem(linear, PRIOR, record, HEALTHY, variances=VARIANCES)
    assert problem.model is linear
    assert not np.any(problem.added_variance)


@pytest.mark.parametrize("method", [filterpy_ekf, ukf])
def test_every_filter_adds_the_same_variance_in_a_gap(linear: ProcessModel, method: object) -> None:
    record = without(noisy_record(), "motor_speed_rad_s", 200, 220)
    ours, theirs = (
        run_filter(one, linear, PRIOR, record, HEALTHY, variances=VARIANCES, keep_innovations=True)
        for one in (ekf, method)
    )
    np.testing.assert_allclose(theirs.mean, ours.mean, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(theirs.variance, ours.variance, rtol=1e-7)
    believed = ours.residual_variances[:, 1]
    assert np.all(believed[200:221] > 10.0 * believed[199])
    assert believed[-1] == pytest.approx(believed[199], rel=0.1)


def test_a_gap_of_motor_speed_adds_the_variance_of_the_swept_position(linear: ProcessModel) -> None:
    record = without(noisy_record(), "motor_speed_rad_s", 200, 220)
    problem = filter_problem(linear, PRIOR, record, HEALTHY, variances=VARIANCES)
    angle = angle_variance(record["motor_speed_rad_s"], 0.01)
    swept = HEALTHY.pump_displacement / HEALTHY.piston_area
    np.testing.assert_allclose(problem.added_variance[:, 0] * 1e-3**2, swept**2 * angle, rtol=1e-12)
    assert not np.any(problem.added_variance[:, 2])  # the pump does not act on the disturbance force


@pytest.mark.slow
@pytest.mark.parametrize("channel", ["motor_speed_rad_s", "position_m", PRESSURE])
def test_five_drop_outs_of_a_channel_do_not_move_the_flow_filter(channel: str) -> None:
    record = prbs()
    for first in (1100, 3000, 5200, 7100, 9000):
        record = without(record, channel, first, first + 100)
    value, std = filter_flow(record, HEALTHY).online.settled("bulk_modulus_pa", 0.02)
    assert value == pytest.approx(HEALTHY.bulk_modulus, rel=0.003)
    assert abs(value - HEALTHY.bulk_modulus) < 2.0 * std


def test_pressures_within_a_gap_of_position_are_not_used() -> None:
    record = without(prbs(0.3), "position_m", 100, 160)
    spoilt = record[PRESSURE].copy()
    spoilt[100:160] += 1e6
    noise = measurement_variances(record, tuple(record.channels))  # from the whole log
    logs = record, record.replace(**{PRESSURE: spoilt})
    kept, moved = (filter_flow(log, HEALTHY, variances=noise).online for log in logs)
    assert moved.settled("bulk_modulus_pa") == kept.settled("bulk_modulus_pa")


def test_a_signal_without_finite_samples_is_refused() -> None:
    with pytest.raises(HydrostateError, match="at least one finite sample"):
        bridged(np.full(5, np.nan))
    np.testing.assert_array_equal(bridged(np.array([np.nan, 1.0, np.nan, 3.0])), [1.0, 1.0, 2.0, 3.0])
