"""A plant that has more modes than the highest order compared."""

import numpy as np

from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode


def beam(modes: int) -> Channels:
    rng = np.random.default_rng(5)
    u, y = rng.normal(size=2000), np.zeros(2000)
    for frequency in (0.3, 0.8, 1.4, 2.0, 2.5)[:modes]:
        pole = 0.97 * np.exp(1j * frequency)
        y += filtered([0.0, 1.0, -1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], u)
    y += 0.05 * y.std() * rng.normal(size=u.size)
    return channels_from([u[:, None]], [y], 1e-3, ["force"], "acceleration")


def test_a_beam_with_more_modes_than_orders_compared_says_so() -> None:
    found = identify_channels(beam(5))
    note = next(one for one in found.notes if one.code == IdentificationCode.HIGHEST_ORDER_TAKEN)
    assert "try --order 8" in str(note)
    assert identify_channels(beam(5), order=10).held_back_percent > found.held_back_percent + 20.0


def test_orders_that_suffice_or_are_given_say_nothing() -> None:
    for found in (identify_channels(beam(2)), identify_channels(beam(5), order=6)):
        assert IdentificationCode.HIGHEST_ORDER_TAKEN not in {one.code for one in found.notes}
