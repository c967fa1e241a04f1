"""Objections to a fit of the flow form, from its residuals."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.greybox.play import NO_PLAY, ShownPlay
from estimation.fits.hypothesis_search.fit_objections import objections, objections_and_play
from estimation.notes import EstimateCode


@pytest.mark.parametrize(
    ("correlation", "chi_square", "noisy", "objected"),
    [(-0.47, 1.15, True, False), (-0.47, 1.15, False, True), (-0.2, 0.9, False, False), (0.47, 1.15, True, True)],
)
def test_negative_correlation_due_to_leaking_encoder_noise_is_no_objection(
    correlation: float, chi_square: float, noisy: bool, objected: bool
) -> None:
    """A leaky single rod was refused for -0.47, which remains in its log with the true values too."""
    fit: Any = SimpleNamespace(
        chi_square=(chi_square,), autocorrelation=(correlation,), seen=1238.0, cost=709.0, late={}
    )
    said = [note.code for note in objections(fit, noisy)]
    assert said == [EstimateCode.PRESSURE_RESIDUALS_CORRELATED] * objected


@pytest.mark.parametrize(("chi_square", "gain", "named"), [(28.0, 660.0, False), (1.7, 2270.0, True), (1.0, 9.0, True)])
def test_a_play_is_reported_beside_a_misfit_only_if_it_explains_much_of_it(
    chi_square: float, gain: float, named: bool
) -> None:
    """A pressure drop in a hose left 28 times the noise; a play of 30 um that is not there explained little of it."""
    fit: Any = SimpleNamespace(
        chi_square=(chi_square,), autocorrelation=(0.0,), seen=8000.0, cost=4000.0 * chi_square, late={}
    )
    said = [note.code for note in objections_and_play(fit, False, ShownPlay(3e-5, gain), NO_PLAY)]
    assert (EstimateCode.PLAY_LEFT in said) == named
