"""A channel that alone stands still for a while is missing there; one that rests, clips or is coarse is not."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.held_alone import FEWEST_ROWS, without_temporary_holds
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.log_checks.made_logs import LOG, PRESSURE, SPEED, VELOCITY, stands


@pytest.mark.parametrize("channel", [SPEED, VELOCITY, PRESSURE])
@pytest.mark.parametrize("rows", [FEWEST_ROWS + 1, 200])
def test_a_channel_that_is_held_alone_becomes_missing_there_and_is_noted(channel: str, rows: int) -> None:
    given = LOG.replace(**{channel: stands(LOG[channel], 700, rows)})
    found, (note,) = without_temporary_holds(given)
    assert note.code is SensorCode.HELD_ALONE
    assert note.data["channel"] == channel
    assert note.data["seconds"] == pytest.approx((rows - 1) * given.sample_time)
    assert note.data["begin_s"] == pytest.approx(given.time[701])
    assert np.flatnonzero(np.isnan(found[channel])).tolist() == list(range(701, 700 + rows))
    clean = clean_log(given, EhaParameters())
    assert note in clean.left_out
    assert clean.objections == ()


def unchanged(values: Array) -> bool:
    record = LOG.replace(**{PRESSURE: values})
    return without_temporary_holds(record) == (record, ())


def test_a_sensor_that_freezes_for_good_is_left_to_other_checks() -> None:
    assert unchanged(stands(LOG[PRESSURE], 1200, len(LOG)))


def test_a_clipped_coarse_or_repeatedly_resting_channel_is_not_held() -> None:
    pressure = LOG[PRESSURE]
    assert unchanged(np.minimum(pressure, 0.3 * np.max(pressure)))
    assert unchanged(np.round(pressure, -6))
    assert unchanged(stands(stands(pressure, 300, 60), 900, 18))


@pytest.mark.parametrize("unit", [1.0, 1e-5, 1e5])
def test_noise_is_distinguished_from_rounding_in_any_unit(unit: float) -> None:
    noise = np.random.default_rng(3).normal(0.0, 1e-3, 1500)
    motion = np.sin(6.0 * np.arange(1500) / 1500)
    assert not unchanged(unit * stands(motion + noise, 700, 60))
    assert unchanged(unit * stands(motion + 1e-4 * noise, 700, 60))


def test_a_channel_that_is_held_for_more_than_a_fifth_of_a_log_is_left_to_other_checks() -> None:
    n = len(LOG)
    assert not unchanged(stands(LOG[PRESSURE], 300, int(0.19 * n)))
    assert unchanged(stands(LOG[PRESSURE], 300, int(0.21 * n)))


def test_a_drive_without_noise_that_rests_is_not_held() -> None:
    ramp = np.interp(np.arange(3000), [0, 1000, 1400, 3000], [0.0, 50.0, 50.0, 80.0])
    record = Record(1e-3, {SPEED: np.round(ramp, 7), PRESSURE: 1e4 * ramp})
    assert without_temporary_holds(record) == (record, ())
