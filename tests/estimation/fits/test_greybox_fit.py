"""Draws of the drives' noise can be repeated, however long a log is."""

import numpy as np
import pytest

from estimation.fits import greybox_fit


def test_draws_for_a_long_log_are_those_for_a_short_one(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = [one.copy() for one in greybox_fit._normal_draws(40, 2)]
    assert len(kept) == greybox_fit.DRIVE_DRAWS
    monkeypatch.setattr(greybox_fit, "SAMPLES_KEPT", 39)
    made = list(greybox_fit._normal_draws(40, 2))
    np.testing.assert_array_equal(made, kept)
    assert np.std(made) == pytest.approx(1.0, abs=0.1)
