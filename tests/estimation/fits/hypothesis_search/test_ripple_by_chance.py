"""Ripple that shows by chance: with an offset of speed that the flow contradicts, or at the edge of a limit."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.pump_ripple import Ripple, ShownOffset, ShownRipple
from estimation.fits.hypothesis_search.pump_ripple_fits import (
    CONTRADICTING_DEVIATIONS,
    KEPT_GAIN,
    LEAST_TEETH,
    ONE_SIDED_95,
    SURELY_WORTH,
    TEETH_WORTH,
    with_pump_ripple,
)
from tests.estimation.fits.short_logs import log, made_fit, seen

STD = 0.01
LARGEST_SMALL = LEAST_TEETH + ONE_SIDED_95 * STD


@pytest.mark.parametrize(
    ("size", "flow", "std", "left"),
    [
        (LARGEST_SMALL - 1e-4, 1.0 - KEPT_GAIN - 1e-3, 1e-3, False),  # the flow has another offset: chance
        (LARGEST_SMALL - 1e-4, KEPT_GAIN + 1e-3, 1e-3, True),  # nearly the same offset
        (LARGEST_SMALL - 1e-4, 0.0, 1.01 / CONTRADICTING_DEVIATIONS, True),  # the flow does not decide
        (LARGEST_SMALL - 1e-4, 0.0, np.inf, True),
        (LARGEST_SMALL + 1e-4, 0.0, 1e-3, True),  # not small, so not chance
    ],
)
def test_small_ripple_with_a_speed_offset_that_the_flow_contradicts_does_not_shut_the_gate(
    size: float, flow: float, std: float, left: bool
) -> None:
    wandering = ShownRipple(Ripple(14, size, 0.0), 12.0, STD, np.zeros(2), offset=-1.0, offset_std=1e-3)
    rival = ShownRipple(Ripple(13, 0.02, 0.0), 6.0, STD, np.zeros(2), beside=6.0)
    offset = ShownOffset(-flow, 0.0, std, np.zeros(2))
    fit = replace(made_fit(500.0, 2e8, 1e5), teeth={14: wandering, 13: rival}, speed_offset=offset)
    found = with_pump_ripple(seen(log(0.2)), lambda _: [fit], lambda _: False)
    assert bool(found.left) is left


@pytest.mark.parametrize(
    ("promised", "gained", "left"),
    [
        (TEETH_WORTH + 0.5, TEETH_WORTH - 1.0, False),  # this made a simulated chirp unknown
        (SURELY_WORTH - 0.5, KEPT_GAIN * TEETH_WORTH, False),
        (SURELY_WORTH + 0.5, TEETH_WORTH - 1.0, False),
        (SURELY_WORTH + 0.5, KEPT_GAIN * SURELY_WORTH, True),  # the search with ripple ended too early
        (10.0 * TEETH_WORTH, TEETH_WORTH - 1.0, True),
    ],
)
def test_fitted_ripple_that_gains_no_more_than_chance_does_not_shut_the_gate(
    promised: float, gained: float, left: bool
) -> None:
    large = ShownRipple(Ripple(19, LARGEST_SMALL + 0.02, 0.0), promised, STD, np.zeros(2))
    offset = ShownOffset(0.0, 0.0, 1e-3, np.zeros(2))
    fits = [
        replace(made_fit(cost, 2e8, 1e5), teeth={19: one}, speed_offset=offset)
        for cost, one in ((500.0, large), (500.0 - gained, large._replace(gain=0.0)))
    ]
    found = with_pump_ripple(seen(log(0.2)), lambda one: [fits[bool(one.teeth)]], lambda _: True)
    assert not found.remarks
    assert bool(found.left) is left
