"""A pole slower than a held-back block is taken only if its advantage exceeds the scatter between such blocks."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import believable as module
from estimation.identification.free_run.believable import believable_candidate
from estimation.identification.free_run.choose_linear import (
    Candidate,
    candidate,
    chosen_linear,
    doubt_of,
    linear_candidates,
    slowest_pole,
)
from estimation.identification.free_run.data import Channels, channels_from, halves, scaled
from estimation.identification.free_run.held_back import BLOCKS, halves_error
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode

N = 600


def steps(seed: int, hold: int = 8) -> Array:
    return np.repeat(np.random.default_rng(seed).normal(size=N // hold + 1), hold)[:N]


def channels(y: Array, u: Array) -> Channels:
    return channels_from([u[:, None]], [y], 1.0, ["u"], "y")


@pytest.fixture(scope="module")
def plain() -> tuple[Channels, Candidate]:
    u = steps(1)
    y = filtered([0.0, 0.3], [1.0, -0.7], u) + 0.05 * np.random.default_rng(2).normal(size=N)
    data = scaled(channels(y, u))[0]
    return data, candidate(fit_linear(Form(1, (1,), (1,)), data), data)


def with_pole(one: Candidate, pole: float, errors: tuple[float, ...], doubt: str = "") -> Candidate:
    theta = one.fit.theta.copy()
    theta[0], theta[1] = one.fit.theta[0] * (1.0 - pole) / 0.3, -pole
    fit = LinearFit(one.fit.form, theta, one.fit.cost)
    return replace(one, fit=fit, block_errors=errors, doubt=doubt)


def test_a_pole_outlasts_a_held_back_block_above_a_limit_of_its_radius(plain: tuple[Channels, Candidate]) -> None:
    data, one = plain
    edge = np.exp(-(BLOCKS + 1) / N)
    assert not with_pole(one, edge - 1e-4, (0.1,)).outlasts_block(data)
    assert with_pole(one, edge + 1e-4, (0.1,)).outlasts_block(data)
    assert slowest_pole(np.array([1.0, 0.2, -0.35])) == pytest.approx(0.7)
    assert slowest_pole(np.ones(1)) == 0.0


@pytest.mark.parametrize(
    ("slow", "taken"),
    [
        ((0.08, 0.08, 0.08, 0.08), "slow"),  # equally better in every block
        ((0.05, 0.05, 0.05, 0.11), "slow"),  # better by more than one standard error
        ((0.03, 0.09, 0.10, 0.115), "quick"),  # as much better, but in one block
        ((0.1005, 0.1005, 0.1005, 0.1005), "quick"),
    ],
)
def test_a_slow_pole_is_taken_only_if_its_gain_exceeds_the_scatter_of_blocks(
    plain: tuple[Channels, Candidate], slow: tuple[float, ...], taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, one = plain
    monkeypatch.setattr(module, "halves_error", lambda fit, _: float(fit.cost))
    models = {"quick": with_pole(one, 0.7, (0.1,) * 4), "slow": with_pole(one, 0.998, slow)}
    models["slow"] = replace(models["slow"], bic=one.bic - 100.0)
    _, by = scaled(data)
    assert believable_candidate(list(models.values()), data, by)[0] is models[taken]
    # the slow model is taken if no quicker one may be
    doubted = replace(models["quick"], doubt="no_fit")
    assert believable_candidate([doubted, models["slow"]], data, by)[0] is models["slow"]


@pytest.mark.parametrize(
    ("errors", "taken"),
    [
        ((0.3, 0.3), "slow"),
        ((0.3, 0.295), "slow"),  # the error of blocks and halves together is still smaller
        ((0.3, 0.25), "quick"),
        ((float("nan"), 0.25), "slow"),  # a half that cannot be fitted decides nothing
    ],
)
def test_a_slow_pole_is_taken_only_if_its_error_on_blocks_and_halves_is_no_larger(
    plain: tuple[Channels, Candidate], errors: tuple[float, float], taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, one = plain
    models = {"quick": with_pole(one, 0.7, (0.1,) * 4), "slow": with_pole(one, 0.998, (0.08,) * 4)}
    models["slow"] = replace(models["slow"], bic=one.bic - 100.0)
    told = dict(zip((0.998, 0.7), errors, strict=True))
    monkeypatch.setattr(module, "halves_error", lambda fit, _: told[round(-float(fit.f[1]), 3)])
    assert believable_candidate(list(models.values()), data, scaled(data)[1])[0] is models[taken]


def test_each_half_is_simulated_by_a_fit_to_the_other_half(plain: tuple[Channels, Candidate]) -> None:
    data, one = plain
    first, second = halves(replace(data, u=(*data.u, data.u[0][:101]), y=(*data.y, data.y[0][:101])))
    assert [y.size for y in first.y] == [300, 50]
    assert [y.size for y in second.y] == [300, 51]
    assert np.array_equal(second.u[1][:, 0], data.u[0][50:101, 0])
    noise = 0.05 / np.sqrt(0.05**2 + np.var(filtered([0.0, 0.3], [1.0, -0.7], steps(1))))
    assert halves_error(one.fit, data) == pytest.approx(noise, rel=0.1)
    spoilt = replace(data, y=(np.where(np.arange(N) < 300, data.y[0], 3.0 - data.y[0]),))
    assert halves_error(one.fit, spoilt) > 2.0, "each half has the other's sign and level"
    assert np.isnan(halves_error(one.fit, replace(data, u=(data.u[0][:10],), y=(data.y[0][:10],))))


def test_rejected_models_with_a_time_constant_beyond_the_record_are_noted(plain: tuple[Channels, Candidate]) -> None:
    data, one = plain
    beyond = with_pole(one, 0.9999, (0.09,) * 4, "time_constant")
    slow, quick = with_pole(one, 0.998, (0.07, 0.1, 0.1, 0.115)), with_pole(one, 0.7, (0.1,) * 4)
    found, notes = believable_candidate([beyond, slow, quick], data, scaled(data)[1])
    assert found is quick
    assert [note.code for note in notes] == [IdentificationCode.SLOW_MODELS_PASSED_OVER]


def test_the_drift_of_one_record_is_not_taken_for_a_slow_pole() -> None:
    rng = np.random.default_rng(9)
    u = np.repeat(rng.normal(size=51), 8)[:400]
    y = filtered([0.0, 0.3], [1.0, -0.7], u)
    drift = filtered([1.0], [1.0, -0.98], rng.normal(size=400))
    data, by = scaled(channels(y + 0.25 * y.std() / drift.std() * drift, u))
    candidates = linear_candidates(data, [1, 2, 3], (1,))
    assert chosen_linear(candidates).outlasts_block(data), "held-back blocks alone want the slow pole"
    assert believable_candidate(candidates, data, by)[0].fit.f == pytest.approx([1.0, -0.7], abs=0.03)


def test_a_fit_to_an_output_without_spread_is_doubtful() -> None:
    u, y = np.sin(np.arange(40.0)), np.cos(np.arange(40.0))
    data = channels_from([u[:, None]], [y], 0.1, ["u"], "y")
    fit = replace(fit_linear(Form(1, (1,), (1,)), data, [np.array([1.0, -0.5])]), cost=0.0)
    flat = replace(data, y=tuple(np.zeros(40) for _ in data.y))
    assert doubt_of(fit, flat) == "no_fit"


@pytest.mark.parametrize(
    ("late", "taken"),
    [
        ((0.08, 0.08, 0.08, 0.08), "late"),
        ((0.03, 0.09, 0.10, 0.115), "prompt"),  # as much better, but in one block
    ],
)
def test_a_dead_time_is_taken_only_if_its_gain_exceeds_the_scatter_of_blocks(
    plain: tuple[Channels, Candidate], late: tuple[float, ...], taken: str
) -> None:
    data, one = plain
    models = {"prompt": with_pole(one, 0.7, (0.1,) * 4), "late": with_pole(one, 0.7, late)}
    later = LinearFit(Form(1, (1,), (5,)), models["late"].fit.theta, one.fit.cost)
    models["late"] = replace(models["late"], fit=later)
    by = scaled(data)[1]
    assert believable_candidate(list(models.values()), data, by)[0] is models[taken]
    # neither a slow model nor one that may not be taken replaces a dead time
    slow = with_pole(one, 0.9995, (0.1,) * 4)
    for other in (slow, replace(models["prompt"], doubt="no_fit")):
        assert believable_candidate([other, models["late"]], data, by)[0] is models["late"]


def test_a_time_constant_between_input_period_and_record_length_is_not_noted_as_integrating(
    plain: tuple[Channels, Candidate],
) -> None:
    u = np.tile(steps(3)[: N // 4], 4)
    data = channels(filtered([0.0, 0.3], [1.0, -0.7], u), u)
    assert data.informative_samples == N // 4
    within, beyond = (with_pole(plain[1], float(np.exp(-1.0 / length)), (0.1,)) for length in (0.9 * N, 1.1 * N))
    note = module._slow_note(within, data)
    assert note.code == IdentificationCode.SLOWER_THAN_PERIOD
    assert note.data["time_constant_s"] == pytest.approx(0.9 * N)
    integrates = replace(within, fit=replace(within.fit, integrates=True))
    assert [module._slow_note(one, data).code for one in (beyond, integrates)] == [IdentificationCode.INTEGRATES] * 2


@pytest.mark.parametrize(("gained", "taken"), [(10.0, "settled"), (-10.0, "integrates")])
def test_an_integrating_model_is_rejected_if_a_settling_one_has_a_lower_bic(
    plain: tuple[Channels, Candidate], gained: float, taken: str
) -> None:
    data, one = plain
    # one block contains the only step of the inputs, so the fit without it cannot determine the pole
    settled = replace(one, block_errors=(0.02, 0.02, 0.02, 0.2))
    other = with_pole(one, 1.0, (0.02, 0.02, 0.02, 0.02), "time_constant")
    integrating = replace(other, fit=replace(other.fit, integrates=True), bic=one.bic + gained)
    best, _ = believable_candidate([settled, integrating], data, scaled(data)[1])
    assert best.fit is {"settled": settled, "integrates": integrating}[taken].fit
