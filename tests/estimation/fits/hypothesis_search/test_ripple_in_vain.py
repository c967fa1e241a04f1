"""Ripple that makes a fit worse is not corrected further."""

from dataclasses import replace

from estimation.fits.hypothesis_search.pump_ripple_fits import with_pump_ripple
from tests.estimation.fits.hypothesis_search.test_pump_ripple_fits import PLAIN, fit, shown, told, well


def test_ripple_that_makes_the_first_fit_worse_is_rejected() -> None:
    fitted, asked = told(fit(500.0, shown(12, 200.0)), fit(501.0, shown(12, 400.0)), fit(100.0, shown(12, 0.0)))
    found = with_pump_ripple(PLAIN, fitted, well)
    assert len(asked) == 2
    assert found.fits[0].cost == 500.0
    assert not found.remarks


def test_an_offset_that_leaves_the_log_unexplained_without_further_gain_is_rejected() -> None:
    first = replace(fit(5000.0, off=(0.3, 900.0)), chi_square=(12.0,))
    second = replace(fit(4000.0, off=(0.01, 3.0)), chi_square=(9.0,))
    fitted, asked = told(first, second, fit(100.0))
    found = with_pump_ripple(PLAIN, fitted, well, largest=1.2)
    assert len(asked) == 2
    assert found.fits[0].cost == 5000.0
    assert not found.remarks
