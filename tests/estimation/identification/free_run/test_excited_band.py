"""A model that rings above the band of its inputs is taken only if it is better within the band."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run.believable import believable_candidate
from estimation.identification.free_run.choose_linear import Candidate, candidate
from estimation.identification.free_run.data import Channels, Scaling, channels_from, scaled
from estimation.identification.free_run.excited_band import band_end, rings_above_band
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.model.recursion import filtered

N = 600


def rings(one: Candidate, pole: float, errors: tuple[float, ...]) -> Candidate:
    """Return a model with one more pole and a zero beside it, which hardly change the model within the band."""
    b, f = np.convolve(one.fit.numerators[0], [1.0, -0.9 * pole]), np.convolve(one.fit.f, [1.0, -pole])
    b *= b.sum() ** -1 * f.sum() * one.fit.numerators[0].sum() / one.fit.f.sum()
    theta = np.concatenate([b, f[1:], [one.fit.theta[one.form.n_values - 1]], np.zeros(2)])
    fit = LinearFit(Form(2, (2,), (1,)), theta, one.fit.cost)
    return replace(one, fit=fit, block_errors=errors, bic=one.bic - 100.0)


@pytest.fixture(scope="module")
def slow() -> tuple[Channels, Scaling, Candidate]:
    """Return scaled channels with an input of sines up to 0.3 rad a sample, their scaling, and a first-order model."""
    rng, lines = np.random.default_rng(1), 2.0 * np.pi * np.arange(1, 30) / N
    u = np.cos(np.outer(np.arange(N), lines) + rng.uniform(0.0, 6.0, lines.size)).sum(axis=1)
    y = filtered([0.0, 0.3], [1.0, -0.7], u)
    y = y + 0.05 * y.std() * rng.normal(size=N)
    data, by = scaled(channels_from([u[:, None]], [y], 1.0, ["u"], "y"))
    plain = candidate(fit_linear(Form(1, (1,), (1,)), data), data)
    return data, by, replace(plain, block_errors=(0.1,) * 4)


def test_the_band_ends_at_the_highest_frequency_that_an_input_excites(
    slow: tuple[Channels, Scaling, Candidate],
) -> None:
    data, _, _ = slow
    assert band_end(data) == pytest.approx(0.3, abs=0.05)
    steps = np.repeat(np.random.default_rng(2).normal(size=N // 8), 8)
    # a second input excites a pole that the first one does not
    two = replace(data, inputs=("u", "v"), u=(np.column_stack([data.u[0][:, 0], steps]),))
    assert band_end(two) > 2.0


def test_a_slowly_decaying_pole_above_the_band_rings_beyond_it(slow: tuple[Channels, Scaling, Candidate]) -> None:
    data, _, plain = slow
    end, wild = band_end(data), rings(plain, -0.999, (0.1,) * 4)
    assert not rings_above_band(plain, data, end)
    assert rings_above_band(wild, data, end)
    assert not rings_above_band(wild, data, np.pi)
    # a pole that decays within a block does not count, and neither does a slow one within the band
    assert not rings_above_band(rings(plain, -0.98, (0.1,) * 4), data, end)
    assert not rings_above_band(rings(plain, 0.999, (0.1,) * 4), data, end)
    # the two models agree on the measured input, but not on one that goes beyond its band
    u, quick = data.u[0], np.random.default_rng(3).normal(size=(N, 1))
    for inputs, alike in ((u, True), (quick, False)):
        one, other = (LinearDynamics.of(x.fit).run(inputs, np.full(N, np.nan)) for x in (plain, wild))
        assert (np.std(one - other) < 0.1 * np.std(one)) == alike


@pytest.mark.parametrize(
    ("errors", "taken"),
    [
        ((0.0995, 0.0995, 0.0995, 0.0995), "plain"),  # better in every block, but by too little
        ((0.02, 0.09, 0.10, 0.115), "plain"),  # better by more, but in one block
        ((0.08, 0.08, 0.08, 0.08), "wild"),
    ],
)
def test_a_model_that_rings_above_the_band_is_taken_only_if_it_is_clearly_better(
    slow: tuple[Channels, Scaling, Candidate], errors: tuple[float, ...], taken: str
) -> None:
    data, by, plain = slow
    models = {"plain": plain, "wild": rings(plain, -0.999, errors)}
    assert rings_above_band(models["wild"], data, band_end(data))
    assert believable_candidate(list(models.values()), data, by)[0] is models[taken]
    assert believable_candidate([models["wild"]], data, by)[0] is models["wild"]


def test_a_constant_input_does_not_affect_the_band() -> None:
    t = np.arange(640.0)
    slow, still = np.sin(0.2 * t), np.ones(640)
    alone = band_end(Channels(("u",), "y", 1.0, (slow[:, None],), (t,)))
    assert band_end(Channels(("u", "v"), "y", 1.0, (np.column_stack([slow, still]),), (t,))) == alone
    assert band_end(Channels(("v",), "y", 1.0, (still[:, None],), (t,))) == np.pi
