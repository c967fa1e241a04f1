"""Slips in channels, corrected one or two at a time."""

import numpy as np
import pytest

from estimation.fits.flow.plain import Logged
from estimation.fits.flow.slips import PAIRS, SLIPS, Slip, with_slips_corrected
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from plant.log.record import Record


def slip(channel: str, said: str) -> Slip:
    return next(one for one in SLIPS if one.channel == channel and said in one.said)


LOGGED = Logged(
    Record(1e-3, {SPEED: np.arange(4.0), PRESSURE: np.ones(4), POSITION: np.zeros(4), VELOCITY: np.arange(4.0) + 1.0}),
    {SPEED: 1.0, PRESSURE: 2.0, POSITION: 3.0, VELOCITY: 4.0},
)


def test_two_slips_are_corrected_together_with_their_noise_variances() -> None:
    right = with_slips_corrected([slip(SPEED, "wrong sign"), slip(PRESSURE, "psi read as kPa")], LOGGED)
    assert right is not None
    assert list(right.record[SPEED]) == [0.0, -1.0, -2.0, -3.0]
    assert right.record[PRESSURE] == pytest.approx(6.894757)
    assert (right.variances[SPEED], right.variances[PRESSURE]) == pytest.approx((1.0, 2.0 * 6.894757**2))


def test_a_channel_in_the_place_of_another_brings_its_noise_variance_and_must_be_logged() -> None:
    misplaced = [slip(POSITION, VELOCITY)]
    right = with_slips_corrected(misplaced, LOGGED)
    assert right is not None
    assert right.variances[POSITION] == 4.0
    assert list(right.record[POSITION]) == list(LOGGED.record[VELOCITY])
    assert with_slips_corrected(misplaced, Logged(LOGGED.record.replace(**{VELOCITY: None}), LOGGED.variances)) is None


def test_pairs_of_slips_are_in_two_channels_and_not_two_wrong_signs() -> None:
    assert all(one.channel != two.channel for one, two in PAIRS)
    assert not any(one.factor < 0.0 and two.factor < 0.0 for one, two in PAIRS)
    assert (slip(SPEED, "wrong sign"), slip(PRESSURE, "psi read as bar")) in PAIRS
