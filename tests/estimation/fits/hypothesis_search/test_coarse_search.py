"""Searches of hypotheses for their optimum, with long model steps."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import ENCODER_ZERO
from estimation.fits.hypothesis_search.coarse_search import void_if_quiet
from estimation.fits.hypothesis_search.decimation import cost_over_noise
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.fit_objections import QUIET
from tests.estimation.fits.short_logs import wide


@pytest.mark.parametrize(("passed_on", "left", "void"), [(1.0, 0.9, True), (1.0, 1.1, False), (0.0, 0.9, False)])
def test_residuals_far_below_position_noise_are_no_explanation(passed_on: float, left: float, *, void: bool) -> None:
    """In a drone's log, a late speed and air left 2 % of the noise; the encoder's zero left all of it."""
    log = wide()
    log = replace(log, noise=tuple(replace(one, passed_on=passed_on) for one in log.noise))
    cost = left * QUIET / cost_over_noise(log, 1.0)
    tried = Trial((ENCODER_ZERO,), Point(np.zeros(1), cost, np.zeros(1), np.eye(1)), {}, {}, {})
    assert void_if_quiet(log, tried).cost == (np.inf if void else cost)
