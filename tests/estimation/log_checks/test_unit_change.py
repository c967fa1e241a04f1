"""A unit that changes within a log is named with its time and factor; a drive that grows is not one."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.unit_change import unit_changes
from estimation.notes import ChannelCode
from plant.eha.model import EhaParameters
from tests.estimation.log_checks.made_logs import LOG, POSITION, PRESSURE, SPEED, VELOCITY, N, made_log

ROW = 813


@pytest.mark.parametrize(
    ("channel", "factor"),
    [(PRESSURE, 1e-5), (PRESSURE, 1e3), (POSITION, 1e3), (VELOCITY, 1e3), (SPEED, 9.5493), (SPEED, 1.0 / 9.5493)],
)
def test_a_unit_that_changes_is_named_with_its_time_and_factor(channel: str, factor: float) -> None:
    values = np.where(np.arange(N) < ROW, LOG[channel], factor * LOG[channel])
    (note,) = unit_changes(LOG.replace(**{channel: values}))
    assert note.code is ChannelCode.UNIT_CHANGES
    assert note.data["channel"] == channel
    assert note.data["factor"] == pytest.approx(factor, rel=0.1)
    assert note.data["begin_s"] == pytest.approx(LOG.start_time + LOG.sample_time * ROW, abs=0.2)


def test_a_log_with_a_unit_change_has_this_one_mistake_and_no_objections() -> None:
    given = LOG.replace(**{PRESSURE: np.where(np.arange(N) < ROW, LOG[PRESSURE], 1e-5 * LOG[PRESSURE])})
    clean = clean_log(given, EhaParameters())
    assert [note.code for note in clean.mistakes] == [ChannelCode.UNIT_CHANGES]
    assert clean.objections == ()


def test_a_drive_that_grows_tenfold_and_a_sound_log_are_no_change() -> None:
    small, large = made_log(size=0.1), made_log()
    grown = {name: np.where(np.arange(N) < ROW, small[name], large[name]) for name in LOG}
    assert unit_changes(LOG) == ()
    assert unit_changes(LOG.replace(**grown)) == ()
    assert unit_changes(LOG.slice(0, 300)) == ()


def test_growing_noise_in_all_channels_is_no_unit_change() -> None:
    noisy = {name: LOG[name] + 0.3 * np.std(LOG[name]) * np.sin(1e4 * np.arange(N) ** 2) for name in LOG}
    given = {name: np.where(np.arange(N) < ROW, LOG[name], noisy[name]) for name in LOG}
    assert unit_changes(LOG.replace(**given)) == ()
