"""A random walk is distinguished from the plant's response, whose gain is fitted to changes from sample to sample."""

import warnings
from dataclasses import replace
from functools import cache
from typing import Any, cast

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run import identify
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.dense_polynomial import RequestedSizes
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.linear_comparison import Task
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.random_walk import (
    LARGEST_WALK_STATISTIC,
    changes_of,
    dickey_fuller_statistic,
    fit_of_levels,
    has_long_memory,
    walk_followed_notes,
    walk_model,
)
from estimation.identification.state_space.identify import identify_outputs
from plant.errors import LogWarning
from tests.estimation.identification.test_two_stage import closed_loop

N, POLE, GAIN = 1200, 0.8, 2.0
LEVELS: Array = np.repeat(np.random.default_rng(16800).standard_normal(N // 10), 10)


def log(seed: int, step: float = 0.1, noise: float = 0.0, gain: float = GAIN) -> Channels:
    """Return a log of a first-order plant, with a random walk and white noise on its output."""
    rng, y = np.random.default_rng(seed), np.zeros(N)
    for t in range(1, N):
        y[t] = POLE * y[t - 1] + (1.0 - POLE) * gain * LEVELS[t - 1]
    y += np.cumsum(step * rng.standard_normal(N)) + noise * rng.standard_normal(N) + 7.0
    return channels_from([LEVELS[:, None]], [y], 0.1, ["u"], "y")


@cache
def identified(seed: int, step: float = 0.1, noise: float = 0.0, structure: str = "output-error") -> Identified:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return identify_channels(log(seed, step, noise), structure=structure, order=1, delay=1)


@pytest.mark.parametrize(("seed", "noise"), [(16801, 0.0), (16802, 0.1)])
def test_the_interval_of_the_gain_contains_the_truth_for_an_output_with_a_random_walk(seed: int, noise: float) -> None:
    found = identified(seed, noise=noise)
    assert [note.code for note in found.notes] == ["random_walk"]
    assert found.sound
    linear = found.model.linear
    assert linear is not None
    assert abs(linear.dc_gain - GAIN) < 2.6 * linear.dc_gain_std
    assert linear.dc_gain_std < 0.05 * GAIN
    assert linear.offset == pytest.approx(found.model.offset)
    assert linear.rmse == pytest.approx(found.quality.rmse)
    assert -found.model.transfer_functions()[0][1][1] == pytest.approx(POLE, abs=0.03)


def test_a_random_walk_of_the_output_causes_a_warning() -> None:
    with pytest.warns(LogWarning, match="'y' wanders by itself .random walk"):
        identify_channels(log(16801), order=1, delay=1)


def first(data: Channels, count: int) -> Channels:
    return replace(data, u=(data.u[0][:count],), y=(data.y[0][:count],))


@pytest.mark.parametrize(("seed", "noise"), [(16802, 0.1), (16804, 0.1), (16807, 0.0)])
def test_a_random_walk_is_found_in_few_samples_with_large_chance_correlations(seed: int, noise: float) -> None:
    data = scaled(first(log(seed, noise=noise), 260))[0]
    assert walk_model(data, data, [1], (1,), None) is not None


def test_a_followed_walk_is_noted_for_a_random_walk_and_not_for_white_noise() -> None:
    data, noisy = (scaled(first(one, 300))[0] for one in (log(16801), log(16801, 0.0, 0.3)))
    (note,) = walk_followed_notes(data, data, [1], "narx")
    assert note.code == "walk_followed"
    assert walk_followed_notes(noisy, noisy, [1], "narx") == []


@pytest.mark.parametrize("structure", ["hammerstein", "state-space"])
def test_a_structure_that_follows_a_random_walk_is_noted_and_not_sound(structure: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        (found,) = identify_outputs([first(log(16801), 300)], structure=structure, order=1, delay=1)
    assert found.notes[-1].code == "walk_followed"
    assert not found.sound


def test_white_noise_is_not_taken_for_a_random_walk() -> None:
    assert identified(16801, 0.0, 0.3).notes == ()


def test_auto_takes_no_nonlinearity_if_the_output_has_a_random_walk() -> None:
    found = identified(16801, structure="auto")
    assert [note.code for note in found.notes] == ["random_walk"]
    assert found.model.structure == "output-error"


@pytest.mark.parametrize(
    ("structure", "left", "taken"),
    [("narx", 0.84, "other"), ("narx", 0.86, "walk"), ("output-error", 0.1, "walk"), ("narx", None, "walk")],
)
def test_auto_prefers_a_nonlinear_model_of_levels_only_if_its_error_is_clearly_smaller(
    structure: str, left: float | None, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The residual of a nonlinearity may look like a walk: a heat exchanger's polynomial leaves a tenth of it."""
    walk = identified(16801)
    share = (left or 0.1) * (100.0 - walk.held_back_percent)
    other = replace(walk, model=replace(walk.model, structure=structure), held_back_percent=100.0 - share)
    monkeypatch.setattr(identify, "_nonlinear_or_linear", lambda *_: other)
    monkeypatch.setattr(identify, "with_closed_loop_notes", lambda one, _: one)
    found = identify._clearly_better_nonlinear(walk, cast(Any, None), "output-error" if left is None else "auto")
    assert found is {"other": other, "walk": walk}[taken]


@pytest.mark.parametrize(("order", "told"), [(1, False), (None, True)])
def test_a_random_walk_at_a_given_order_must_be_found_at_other_orders_too(
    order: int | None, told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The residual of missing poles may look like a walk."""
    data = log(16801)
    whole, by = scaled(data)
    walk = walk_model(whole, whole, [1], (1,), None)
    monkeypatch.setattr(identify, "walk_model", lambda _data, _part, orders, *_: walk if orders == [1] else None)
    task = Task(data, whole, by, whole, RequestedSizes(order), [1], None)
    assert (identify._identified_from_changes(task)[0] is not None) is told
    free = replace(task, orders=[5]).free
    assert told if free is None else free.orders == [1, 2, 3, 4, 5], "each order's starts come from one less"


@pytest.mark.slow
def test_a_random_walk_is_found_in_two_logs_with_gaps_and_two_inputs() -> None:
    one = log(16803)
    y = np.where(np.arange(N) % 400 == 399, np.nan, one.y[0])
    second = np.random.default_rng(16804).standard_normal((N, 1))
    two = replace(one, inputs=("u", "v"), u=(np.hstack([one.u[0], second]),), y=(y + second[:, 0],))
    parts = (slice(0, 600), slice(600, N))
    cut = replace(two, u=tuple(two.u[0][p] for p in parts), y=tuple(two.y[0][p] for p in parts))
    with pytest.warns(LogWarning):
        found = identify_channels(cut, order=1, delay=0)
    assert "random_walk" in [note.code for note in found.notes]
    gains = [float(b.sum() / f.sum()) for b, f in found.model.transfer_functions()]
    assert gains == pytest.approx([GAIN, 1.0], abs=0.15)


def test_a_random_walk_that_is_small_beside_the_output_is_ignored() -> None:
    whole, _ = scaled(log(16801, 0.003))
    assert walk_model(whole, whole, [1], (1,), None) is None


def test_an_integrating_plant_is_not_taken_for_a_random_walk() -> None:
    one = log(16805, 0.0, 0.05)
    summed = replace(one, y=(np.cumsum(0.1 * one.y[0]) + np.random.default_rng(1).standard_normal(N),))
    whole, _ = scaled(summed)
    assert walk_model(whole, whole, [2], (1,), None) is None


def test_random_walks_are_distinguished_from_returning_sums_and_smooth_changes() -> None:
    white = np.random.default_rng(16806).standard_normal((40, 600))
    walks = np.array([dickey_fuller_statistic(one) > LARGEST_WALK_STATISTIC for one in white])
    noise = np.array([dickey_fuller_statistic(np.diff(one)) > LARGEST_WALK_STATISTIC for one in white])
    assert walks.sum() >= 37
    assert noise.sum() == 0
    smooth = white[:, 2:] + white[:, 1:-1] + white[:, :-2]
    beside = white[:, 1:] + 2.0 * np.diff(np.random.default_rng(16807).standard_normal((40, 600)))
    assert sum(map(has_long_memory, smooth)) == 40
    assert sum(map(has_long_memory, white)) + sum(map(has_long_memory, beside)) <= 1


def test_a_fit_to_changes_is_converted_to_one_of_levels() -> None:
    plain = log(16808, 0.0)
    whole, _ = scaled(plain)
    changed, by = scaled(changes_of(whole))
    fit = fit_linear(Form(1, (1,), (1,)), changed)
    found = fit_of_levels(fit, whole, by)
    assert found.cost < 1e-9
    assert found.f[1] == pytest.approx(-POLE, abs=1e-6)


@pytest.mark.parametrize("gaps", [False, True])
def test_an_output_with_constant_changes_or_without_any_has_no_random_walk(gaps: bool) -> None:
    ramp = 0.5 * np.arange(float(N))
    if gaps:
        ramp[::2] = np.nan
    whole, _ = scaled(channels_from([LEVELS[:, None]], [ramp], 0.1, ["u"], "y"))
    assert walk_model(whole, whole, [1], None, None) is None


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_feedback_from_the_noise_is_noted_and_not_taken_for_a_random_walk() -> None:
    """A fit to changes gave a gain of 1.7 instead of 1, without a note."""
    loop = closed_loop(0)
    data = channels_from([loop["u"][:, None]], [loop["y"]], 0.01, ["u"], "y")
    whole, _ = scaled(data)
    assert walk_model(whole, whole, [1], (1,), None) is not None
    said = [str(note.code) for note in identify_channels(data, order=1, delay=1).notes]
    assert "feedback" in said
    assert "random_walk" not in said


@pytest.mark.parametrize(
    ("seed", "step", "structure", "notes"),
    [(16808, 0.03, "narx", ["walk_followed"]), (16810, 0.0, "output-error", ["error_modelled"])],
)
def test_auto_notes_a_random_walk_in_the_residual_of_a_nonlinear_model(
    seed: int, step: float, structure: str, notes: list[str]
) -> None:
    """A nonlinearity hides the walk from the linear models that are tested for it."""
    rng, y, n = np.random.default_rng(seed), np.zeros(N), 600
    for t in range(1, N):
        y[t] = POLE * y[t - 1] + (1.0 - POLE) * (LEVELS[t - 1] + LEVELS[t - 1] ** 2)
    y += np.cumsum(step * rng.standard_normal(N)) + 0.02 * rng.standard_normal(N)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        data = channels_from([LEVELS[:n, None]], [y[:n]], 0.1, ["u"], "y")
        found = identify_channels(data, structure="auto", order=1, delay=1)
    assert found.model.structure == structure
    assert [note.code for note in found.notes] == notes
    assert found.sound == (not step)
