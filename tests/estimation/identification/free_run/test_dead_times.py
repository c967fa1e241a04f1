"""Dead times: long ones are found by default, and do not make a fit less certain."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.dead_times import estimate_delays, late_response_notes
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.state_space.fit import fit_state_space
from estimation.identification.state_space.joint import Joint, joined_outputs
from estimation.identification.state_space.problem import Size
from estimation.identification.state_space.starts import subspace_starts
from plant.errors import LogWarning

NOISE = 0.02


def late_plant(delay: int, count: int = 700, seed: int = 0, held: int = 9) -> Channels:
    """Return a log of a second-order plant behind a dead time, driven by random levels since long before the log."""
    rng = np.random.default_rng(seed)
    before = 200
    u = np.repeat(rng.choice([-1.0, 1.0], (count + before) // held + 1), held)[: count + before]
    y = np.zeros(u.size)
    for t in range(delay + 2, u.size):
        y[t] = 1.7 * y[t - 1] - 0.74 * y[t - 2] + 0.04 * u[t - delay]
    y += NOISE * y.std() * rng.normal(size=u.size)
    return channels_from([u[before:, None]], [y[before:] + 3.0], 1e-3, ["valve"], "flow")


@pytest.mark.parametrize("delay", [30, 80])
def test_a_dead_time_longer_than_those_tried_individually_is_found(delay: int) -> None:
    (found,) = estimate_delays(scaled(late_plant(delay))[0])
    assert delay - 5 <= found <= delay + 1


def test_a_dead_time_of_more_than_a_twentieth_of_a_short_log_is_found_and_its_fit_leaves_the_noise() -> None:
    data = late_plant(18, 200, seed=1, held=5)
    (found,) = estimate_delays(scaled(data)[0])
    assert 16 <= found <= 19
    fit = fit_linear(Form(2, (1,), (18,)), scaled(data)[0])
    assert fit.cost / 200 == pytest.approx(NOISE**2, rel=0.15)


def test_a_dead_time_is_found_with_nearly_half_of_the_outputs_missing() -> None:
    data = late_plant(80)
    y = data.y[0].copy()
    y[80:400] = np.nan
    (found,) = estimate_delays(scaled(replace(data, y=(y,)))[0])
    assert 75 <= found <= 81


def test_each_of_two_inputs_has_its_own_dead_time() -> None:
    first, second = scaled(late_plant(60))[0], scaled(late_plant(3, seed=1, held=7))[0]
    both = replace(
        first,
        inputs=("a", "b"),
        u=(np.column_stack([first.u[0], second.u[0]]),),
        y=(first.y[0] + second.y[0],),
    )
    late, early = estimate_delays(both)
    assert 55 <= late <= 61
    assert early <= 4


def test_with_periodic_inputs_the_shortest_dead_time_is_found() -> None:
    u = np.tile(np.repeat([1.0, -1.0], 40), 10)
    y = np.concatenate([np.full(3, -1.0), u[:-3]]) + 0.01 * np.random.default_rng(0).normal(size=u.size)
    (found,) = estimate_delays(scaled(channels_from([u[:, None]], [y], 1.0, ["u"], "y"))[0])
    assert 2 <= found <= 3


def test_outputs_that_respond_to_inputs_before_the_log_are_left_out_of_a_fit() -> None:
    data = scaled(late_plant(80))[0]
    fit = fit_linear(Form(2, (1,), (80,)), data)
    answered = (Problem(fit.form, data).jacobian(fit.theta)[0] - data.y[0])[80:]
    assert np.sqrt(np.mean(answered**2)) == pytest.approx(NOISE, rel=0.1)
    assert fit.cost == pytest.approx(np.sum(answered**2) * 700 / 620)
    assert fit.f == pytest.approx([1.0, -1.7, 0.74], abs=0.01)


@pytest.mark.parametrize("short", [60, 130])
def test_each_of_several_logs_leaves_out_the_outputs_within_its_dead_time(short: int) -> None:
    long, brief = late_plant(80), late_plant(80, short, seed=1)
    both = scaled(replace(long, u=(*brief.u, *long.u), y=(*brief.y, *long.y)))[0]
    fit = fit_linear(Form(2, (1,), (80,)), both)
    assert fit.f == pytest.approx([1.0, -1.7, 0.74], abs=0.01)
    problem = Problem(fit.form, both)
    left = (problem.jacobian(fit.theta)[0] - problem.y)[problem.used]
    assert left.size == max(short - 80, 0) + 620
    assert np.sqrt(np.mean(left**2)) == pytest.approx(NOISE, rel=0.1)


def test_subspace_starts_ignore_a_log_without_outputs() -> None:
    rng = np.random.default_rng(0)
    y = np.zeros((300, 1))
    u = rng.choice([-1.0, 1.0], (300, 1))
    for t in range(1, 300):
        y[t] = 0.8 * y[t - 1] + u[t - 1]
    told, silent = Joint(1.0, (u,), (y,)), Joint(1.0, (u[:60], u), (np.full((60, 1), np.nan), y))
    assert np.array_equal(subspace_starts(silent, 1)[0][0], subspace_starts(told, 1)[0][0])


def test_the_default_finds_a_dead_time_of_eighty_samples_and_rates_the_fit_after_it() -> None:
    found = identify_channels(late_plant(80), order=2)
    (numerator, _) = found.model.transfer_functions()[0]
    assert found.sound
    assert 75 <= np.flatnonzero(numerator)[0] <= 81
    assert found.quality.fit_percent == pytest.approx(98.0, abs=0.5)
    assert found.held_back_percent == pytest.approx(98.0, abs=0.5)


def test_a_run_is_constant_during_its_dead_time() -> None:
    # an integrator has no steady state under its first input
    form = Form(2, (1,), (13,))
    dynamics = LinearDynamics(form, np.array([0.3, -1.69999999, 0.699999993, 0.0]))
    u = np.random.default_rng(0).normal(1.0, 1.0, 220)
    y = 3.0 + np.concatenate([np.zeros(13), np.cumsum(u[:-13])])
    run = dynamics.run(u[:, None], y)
    assert np.abs(run - y).max() < 5.0 * np.std(y)
    assert np.ptp(run[:14]) == 0.0


def test_a_state_space_fit_leaves_out_outputs_that_respond_to_inputs_before_the_log() -> None:
    late = joined_outputs([scaled(late_plant(80))[0]]).delayed((79,))
    assert late.slices == [slice(79, 700)]
    fit = fit_state_space(Size(2, 1, 1, direct=False), late)
    assert np.sqrt(fit.noise[0, 0]) == pytest.approx(NOISE, rel=0.1)
    assert np.isnan(late.y[0][:79]).all()
    assert np.isfinite(late.y[0][79:]).all()
    assert np.isfinite(joined_outputs([scaled(late_plant(80))[0]]).delayed((20,)).y[0]).all()


def test_a_dead_time_beyond_the_searched_range_is_noted() -> None:
    data = scaled(late_plant(200, 600))[0]
    (note,) = late_response_notes(data, rmse=0.9)
    assert note.code == "answers_late"
    assert 195 <= note.data["samples"] <= 201
    assert note.data["left"] < 0.05
    assert late_response_notes(data, rmse=0.4) == []  # a model that explains most of the output has found the response


def test_neither_a_dead_time_in_the_searched_range_nor_unrelated_noise_is_noted() -> None:
    assert late_response_notes(scaled(late_plant(80, 600))[0], rmse=0.9) == []
    noise = np.random.default_rng(0).standard_normal((2, 300))
    assert late_response_notes(channels_from([noise[0][:, None]], [noise[1]], 0.1, ["u"], "y"), rmse=0.99) == []


def test_a_model_is_not_sound_if_the_dead_time_is_beyond_the_searched_range() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        found = identify_channels(late_plant(200, 600), order=1)
    assert found.notes[-1].code == "answers_late"
    assert not found.sound
