"""A fast log is averaged to one with the same information."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.block_averages import averaged_log
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

SAMPLE = 1e-4


def fast(samples: int = 100) -> GreyBoxLog:
    time = SAMPLE * np.arange(samples)
    return GreyBoxLog(
        drives=np.column_stack([3.0 + 2.0 * time, -time]),
        measured=(5.0 * time)[:, None],
        parameters=np.zeros(1),
        sample_time=SAMPLE,
        steps=np.ones(samples, dtype=np.int64),
        noise=(OutputNoise(4.0, 7.0),),
        drive_std=(1.0, 0.0),
    )


def test_averages_keep_straight_lines_and_reduce_noise() -> None:
    log = averaged_log(fast(), 2.5e-4)
    time = log.sample_time * np.arange(len(log.drives))
    assert log.sample_time == pytest.approx(5.0 * SAMPLE)
    np.testing.assert_allclose(log.drives, np.column_stack([3.0 + 2.0 * time, -time]), atol=1e-12)
    assert np.isnan(log.measured[0, 0])  # the model begins there, at rest
    np.testing.assert_allclose(log.measured[1:, 0], 5.0 * time[1:])
    assert log.noise == (OutputNoise(4.0 / 5.0, 7.0),)
    assert log.drive_std == pytest.approx((5.0**-0.5, 0.0))
    assert set(log.steps) == {2}


def test_a_log_at_5_khz_is_averaged_by_threes() -> None:
    """An even count has no middle sample, so such a log was not averaged, and 20 s of it were tested for nothing."""
    log = averaged_log(replace(fast(), sample_time=2e-4), 1.0)
    assert log.sample_time == pytest.approx(6e-4)


def test_a_block_with_a_sample_missing_is_missing() -> None:
    log = fast()
    log.measured[50] = np.nan
    assert np.flatnonzero(np.isnan(averaged_log(log, 1.0).measured[:, 0])).tolist() == [0, 10]


@pytest.mark.parametrize("case", ["slow", "gaps", "every second sample missing", "every tenth sample alone there"])
def test_a_log_that_would_lose_information_is_not_averaged(case: str) -> None:
    log = fast()
    match case:
        case "slow":
            log = replace(log, sample_time=4e-4)
        case "gaps":
            log = replace(log, gaps=np.array([[3.0, 4.0, 1.0]]))
        case "every second sample missing":
            log.measured[::2] = np.nan
        case _:
            log.measured[np.arange(len(log.measured)) % 10 != 0] = np.nan
    assert averaged_log(log, 1.0) is log


def test_bulk_modulus_of_a_fast_log_is_that_of_the_plant() -> None:
    p = parameters_for(CONDITIONS["major_leakage"])
    rng = np.random.default_rng(5)
    record = simulate(CIRCUIT, make_drive("steps", 5.0, SAMPLE, p, rng), SAMPLE, p, sensors=BENCH, rng=rng)
    value, std = fit_flow(record, EhaParameters(), 4e8).parameters["bulk_modulus"]
    assert value == pytest.approx(p.bulk_modulus, rel=0.003)
    assert std < 0.002 * value
