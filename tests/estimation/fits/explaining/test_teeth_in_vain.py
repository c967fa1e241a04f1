"""Teeth that make a fit worse are not corrected further."""

from estimation.fits.explaining.toothed import toothed
from tests.estimation.fits.explaining.test_toothed import PLAIN, fit, shown, told, well


def test_teeth_that_explain_a_log_worse_at_once_are_none() -> None:
    fitted, asked = told(fit(500.0, shown(12, 200.0)), fit(501.0, shown(12, 400.0)), fit(100.0, shown(12, 0.0)))
    found = toothed(PLAIN, fitted, well)
    assert len(asked) == 2
    assert found.fits[0].cost == 500.0
    assert not found.remarks
