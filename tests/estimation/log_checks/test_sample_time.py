"""Samples that are too far apart are refused with a message; fits and filters took forever over them."""

import numpy as np
import pytest

from estimation.eha.online import StreamFilterOptions, begin_filter
from estimation.log_checks.clean import clean_log
from estimation.log_checks.sample_time import SLOWEST
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record

SLOW = "samples are 1 s apart, but must be at most 0.1 s.*time_s=NAME:ms"


def slow(sample_time: float) -> Record:
    """Return a log of 40 samples of a motor that turns to and fro."""
    k = np.arange(40.0)
    speed = 90.0 * np.sin(k / 9.0)
    channels = {"motor_speed_rad_s": speed, "position_m": 1e-5 * np.cumsum(speed), "velocity_m_s": 1e-3 * speed}
    return Record(sample_time, channels)


def test_a_log_with_milliseconds_read_as_seconds_is_refused_with_a_hint_at_the_unit() -> None:
    with pytest.raises(LogError, match=SLOW):
        clean_log(slow(1.0), EhaParameters())


def test_a_log_at_the_slowest_rate_is_accepted_despite_rounded_time_stamps() -> None:
    assert clean_log(slow(SLOWEST * (1.0 + 1e-7)), EhaParameters()).record.sample_time > SLOWEST


@pytest.mark.parametrize("form", ["acceleration", "pressure"])
def test_a_filter_refuses_a_stream_with_samples_too_far_apart(form: str) -> None:
    with pytest.raises(LogError, match="samples are 1 s apart"):
        begin_filter(StreamFilterOptions(EhaParameters(), form, "ekf"), slow(1.0))
