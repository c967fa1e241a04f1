"""Slopes of a single rod use a longer step than those of a through rod."""

from dataclasses import replace

import numpy as np

from estimation.fits.flow.log import flow_log
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.nudges import NUDGE, UNEVEN_NUDGE, nudge_for
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.models.flow import FLOW_FORM
from plant.eha.model import EhaParameters
from plant.log.record import Record

PAPER = EhaParameters()


def seen(p: EhaParameters) -> GreyBoxLog:
    rng, n = np.random.default_rng(1), 2000
    channels = {SPEED: (50.0, 1.0), POSITION: (0.0, 1e-3), PRESSURE: (1e5, 1e3)}
    record = Record(1e-3, {name: mean + size * rng.standard_normal(n) for name, (mean, size) in channels.items()})
    return flow_log(record, p, {}, {name: size**2 for name, (_, size) in channels.items()})


def test_a_single_rod_has_the_longer_step_whether_it_is_stated_or_fitted() -> None:
    through, single = seen(PAPER), seen(replace(PAPER, area_difference=0.2))
    assert nudge_for(through, FLOW_FORM, ()) == NUDGE
    assert nudge_for(single, FLOW_FORM, ()) == UNEVEN_NUDGE
    assert nudge_for(through, FLOW_FORM, ("bulk_modulus", "area_difference")) == UNEVEN_NUDGE
