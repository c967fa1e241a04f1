"""What the residuals of a fit of the flow form object to."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.hypothesis_search.fit_objections import objections
from estimation.notes import EstimateCode


@pytest.mark.parametrize(
    ("correlation", "chi_square", "noisy", "objected"),
    [(-0.47, 1.15, True, False), (-0.47, 1.15, False, True), (-0.2, 0.9, False, False), (0.47, 1.15, True, True)],
)
def test_an_encoders_noise_that_leaks_off_alternates_and_objects_to_nothing(
    correlation: float, chi_square: float, noisy: bool, objected: bool
) -> None:
    """A leaky single rod was refused for -0.47, with which the true values leave its log too."""
    fit: Any = SimpleNamespace(
        chi_square=(chi_square,), autocorrelation=(correlation,), seen=1238.0, cost=709.0, late={}
    )
    said = [note.code for note in objections(fit, noisy)]
    assert said == [EstimateCode.PRESSURE_RESIDUALS_CORRELATED] * objected
