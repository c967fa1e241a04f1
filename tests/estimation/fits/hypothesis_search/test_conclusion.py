"""Conclusion from hypotheses that explain a log about equally well."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import ENCODER_ZERO, VOLUME, Hypothesis
from estimation.fits.hypothesis_search import conclusion
from estimation.fits.hypothesis_search.conclusion import conclude, prior_weight
from estimation.fits.hypothesis_search.explanation import Explanation, Trial
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN
from plant.eha.model import EhaParameters
from tests.estimation.fits.short_logs import made_fit

NAME = VOLUME.free[0]
LOG: Any = SimpleNamespace(uncertainties={NAME: 0.15})
CERTAIN: Any = SimpleNamespace(uncertainties={})


def tried(one: Hypothesis, cost: float, modulus: float, volume: float = 1.0) -> Trial:
    point = Point(np.zeros(1), cost, np.zeros(1), np.eye(1))
    return Trial((one,), point, {NAME: volume}, {}, {NAME: 1.0}, fits=(made_fit(cost, modulus, 1e5),))


def told(monkeypatch: pytest.MonkeyPatch, volume: float, behind: float) -> Explanation:
    """Return the conclusion if a zero is behind another chamber volume by ``behind`` in log-likelihood."""
    monkeypatch.setattr(conclusion, "usual_pressure", lambda *_: 0.0)
    monkeypatch.setattr(conclusion, "delivery_beside", lambda *_: NO_GAIN)
    monkeypatch.setattr(conclusion, "with_details", lambda _, one: one)
    sets = tried(VOLUME, 100.0, 2.7e8, volume), tried(ENCODER_ZERO, 100.0 + behind, 2e8)
    return conclude(LOG, EhaParameters(), sets, lambda _: True)


def test_a_volume_that_the_rig_file_hardly_allows_yields_to_an_equally_good_explanation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """`position_zero_at_stop`, validation 23751: chambers of 181 % were likelier than the zero by 1.5."""
    for found in (told(monkeypatch, 1.81, 1.5), told(monkeypatch, 1.81, 1.5).in_detail):
        assert found.names == (ENCODER_ZERO.name,)
        assert found.rivals == (VOLUME.name,)
        value, std = found.values["bulk_modulus"]
        assert abs(value / 2e8 - 1.0) < 1e-3
        assert std < 0.02 * value
    likelier = told(monkeypatch, 1.1, 6.0)
    assert likelier.names == (VOLUME.name,)
    assert likelier.weights[0] > 0.6


def test_a_set_is_no_rival_of_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stuck valve of `makeup_check_stuck_shut` 25331 was found both beside a late one and alone."""
    monkeypatch.setattr(conclusion, "usual_pressure", lambda *_: 0.0)
    alike = [tried(ENCODER_ZERO, cost, 2e8) for cost in (100.0, 101.0)]
    assert conclude(LOG, EhaParameters(), alike, lambda _: True).rivals == ()


def test_the_prior_of_a_volume_follows_the_uncertainty_in_the_rig_file() -> None:
    off = tried(VOLUME, 100.0, 2e8, float(np.exp(0.3)))
    assert prior_weight(LOG, off) == pytest.approx(np.exp(-2.0))
    assert prior_weight(CERTAIN, off) == 1.0
    assert prior_weight(LOG, tried(ENCODER_ZERO, 100.0, 2e8, 2.0)) == 1.0
    assert prior_weight(LOG, tried(VOLUME, 100.0, 2e8, 1e12)) > 0.0
