"""Nonlinear models of a long log are compared with linear ones on fewer samples, and then fitted to all."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run import identify
from estimation.identification.free_run.choose_linear import linear_candidates
from estimation.identification.free_run.data import Channels, channels_from, liveliest_sections, scaled
from estimation.identification.free_run.fewer_samples import on_fewer_samples
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics


def log(n: int = 600) -> Channels:
    """Return a log of a plant with a product; its input moves more in the second half."""
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, n // 4), 4) * np.linspace(0.5, 1.0, n)
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = 0.7 * y[t - 1] + 0.3 * u[t - 1] + 0.3 * u[t - 1] * y[t - 1]
    return channels_from([u[:, None]], [y + 0.01 * rng.normal(size=n)], 1.0, ["u"], "y")


def test_linear_models_are_judged_again_on_fewer_samples_and_keep_their_doubts() -> None:
    whole = scaled(log())[0]
    linear = linear_candidates(whole, [1, 2], (1,))
    linear[1] = replace(linear[1], doubt="time_constant")
    best = replace(linear[1], doubt="")  # a model that is believed to integrate
    fewer = liveliest_sections(whole, 200)
    data, judged, own = on_fewer_samples(linear, best, whole, fewer)
    assert data is fewer
    assert [one.form for one in judged] == [one.form for one in linear]
    assert [one.doubt for one in judged] == [one.doubt for one in linear]
    assert (own.form, own.doubt) == (linear[1].form, "")
    assert own.held_back == judged[1].held_back != linear[1].held_back
    assert on_fewer_samples(linear, best, whole, whole) == (whole, linear, best)


def test_structures_are_compared_on_at_least_one_period(monkeypatch: pytest.MonkeyPatch) -> None:
    one = log()
    cut = one.longest * 2 // 3
    twice = channels_from(
        [np.concatenate([one.u[0][:cut]] * 2)], [np.concatenate([one.y[0][:cut]] * 2)], 1.0, one.inputs, "y"
    )
    compared = list[int]()
    monkeypatch.setattr(identify, "MOST_COMPARED", cut // 2)
    monkeypatch.setattr(identify, "polynomial_candidates", lambda *given: compared.append(given[1].n_samples) or [])
    for data in (twice, one):
        identify_channels(data, structure="auto", order=1, delay=1)
    assert compared == [cut, cut // 2]


def test_a_polynomial_model_compared_on_fewer_samples_is_refitted_to_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen, refitted = list[int](), identify._refitted

    def noted(found: identify.PolynomialCandidate, whole: Channels) -> PolynomialDynamics:
        seen.extend((found.fit.cost > 0.0, whole.n_samples))
        return refitted(found, whole)

    monkeypatch.setattr(identify, "MOST_COMPARED", 300)
    monkeypatch.setattr(identify, "_refitted", noted)
    compared = list[int]()
    candidates = identify.polynomial_candidates
    monkeypatch.setattr(
        identify, "polynomial_candidates", lambda *given: compared.append(given[1].n_samples) or candidates(*given)
    )
    found = identify_channels(log(), structure="auto", order=1, delay=1)
    assert compared == [300]
    assert seen == [True, 600]
    assert found.model.structure == "narx"
    assert found.quality.fit_percent > 90.0
