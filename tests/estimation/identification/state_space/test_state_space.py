"""State space with several inputs and outputs: derivatives, start, covariance, order, and what the outputs share."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.identification.state_space import (
    A,
    draw_log,
    identified_model,
    model_values,
    plant,
    with_covariance_bound,
)
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.saved import load_models, save_models
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from estimation.identification.state_space import choose, identify
from estimation.identification.state_space.choose import chosen_state, state_candidates
from estimation.identification.state_space.identify import _judged_output, identify_outputs, identify_state_space
from estimation.identification.state_space.joint import joined_outputs
from estimation.identification.state_space.problem import Problem, Size
from estimation.identification.state_space.starts import subspace_starts
from plant.errors import HydrostateError, LogWarning


def in_scale(samples: int = 200, seed: int = 1) -> list[Channels]:
    return [scaled(one)[0] for one in draw_log(seed, samples)]


def test_sensitivities_are_the_derivatives_of_the_outputs() -> None:
    size = Size(3, 2, 2, direct=True)
    problem = Problem(size, joined_outputs(in_scale(60)))
    theta = 0.3 * np.random.default_rng(2).normal(size=size.n_matrices + size.n)
    _, slopes = problem.jacobian(theta)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-6
        moved = (problem.jacobian(theta + step)[0] - problem.jacobian(theta - step)[0]) / 2e-6
        assert moved == pytest.approx(slopes[:, :, k], abs=1e-6)


def test_a_change_of_the_state_basis_changes_no_output_and_is_excluded_from_the_search() -> None:
    size = Size(3, 2, 2, direct=False)
    problem = Problem(size, joined_outputs(in_scale(60)))
    theta = 0.3 * np.random.default_rng(3).normal(size=size.n_matrices + size.n)
    turned = problem.balanced(theta)
    assert problem.outputs(problem.unpacked(turned)) == pytest.approx(problem.outputs(problem.unpacked(theta)))
    basis = problem.directions(theta)
    assert basis.shape[1] == theta.size - 9
    slopes = problem.jacobian(theta)[1].reshape(-1, theta.size)
    assert np.linalg.matrix_rank(slopes) == np.linalg.matrix_rank(slopes @ basis)


def test_the_subspace_start_has_nearly_the_true_poles() -> None:
    starts = subspace_starts(joined_outputs(in_scale(600)), 3)
    wanted = np.sort_complex(np.linalg.eigvals(A))
    distance = [float(np.abs(np.sort_complex(np.linalg.eigvals(a)) - wanted).max()) for a, _ in starts]
    assert min(distance) < 0.05


def test_deviations_from_one_log_equal_the_cramer_rao_bound_and_errors_are_consistent_with_it() -> None:
    data = draw_log(0, 500)
    (values, deviations), limit = model_values(identified_model(data, 3)), model_values(with_covariance_bound(data))[1]
    free = limit > 1e-9
    assert deviations[free] == pytest.approx(limit[free], rel=0.1)
    assert np.mean(deviations[free] / limit[free]) == pytest.approx(1.0, abs=0.1)
    assert np.sqrt(np.mean(((values - model_values(plant())[0])[free] / limit[free]) ** 2)) < 2.0


@pytest.mark.slow
def test_errors_over_eight_logs_equal_the_cramer_rao_bound_and_the_deviations() -> None:
    truth, errors, own = model_values(plant())[0], [], []
    for seed in range(8):
        data = draw_log(seed, 500)
        values, deviations = model_values(identified_model(data, 3))
        limit = model_values(with_covariance_bound(data))[1]
        free = limit > 1e-9
        errors.append(((values - truth)[free] / limit[free]) ** 2)
        own.append(((values - truth)[free] / deviations[free]) ** 2)
    # eight logs of 23 correlated values: the mean of squares scatters by 0.2
    assert np.sqrt(np.mean(errors)) == pytest.approx(1.0, abs=0.3)
    assert np.sqrt(np.mean(own)) == pytest.approx(1.0, abs=0.3)


def test_the_number_of_states_is_chosen_on_blocks_held_back() -> None:
    candidates = state_candidates(in_scale(400), [1, 2, 3, 4], delay=1)
    best = chosen_state(candidates)
    assert (best.fit.size.n, best.fit.size.direct, best.doubt) == (3, False, "")
    assert best.price < 0.1
    assert candidates[0].price > 2.0 * best.price


def test_dead_times_are_estimated_once_and_not_for_each_order(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[str]()

    def found(data: Channels) -> tuple[int, ...]:
        asked.append(data.output)
        return (0, 0)

    monkeypatch.setattr(choose, "estimate_delays", found)
    data = in_scale(200)
    assert {one.fit.size.n for one in state_candidates(data, [1, 2])} == {1, 2}
    assert asked == [one.output for one in data]


def test_outputs_share_one_model_that_simulates_the_same_after_loading(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    data = draw_log(3, 400)
    found = identify_state_space(data, order=3, delay=1)
    path = tmp_path_factory.mktemp("saved") / "model.json"
    save_models([one.model for one in found], path)
    again = load_models(path)
    for one, other, channels in zip(found, again, data, strict=True):
        assert one.sound
        assert one.quality.fit_percent > 90.0
        ours = one.model.simulate(channels.u[0], channels.y[0])
        assert other.simulate(channels.u[0], channels.y[0]) == pytest.approx(ours)
        # without the output, the run begins at rest, and forgets its start
        assert one.model.simulate(channels.u[0])[200:] == pytest.approx(ours[200:], abs=1e-3)
    gains = [[float(b.sum() / f.sum()) for b, f in one.model.transfer_functions()] for one in found]
    assert gains == pytest.approx(plant().dc_gain, abs=0.1)
    assert [one.model.offset for one in found] == pytest.approx([5.0, -2.0], abs=0.05)


def test_dead_times_as_states_give_the_same_response_as_delayed_inputs() -> None:
    late = replace(plant(), delays=(2, 0))
    a, b, c, d = late.with_delays_as_states()
    z = complex(np.exp(0.3j))
    response = c @ np.linalg.inv(z * np.eye(len(a)) - a) @ b + d
    assert response == pytest.approx(late.response(z)[0])


@pytest.mark.slow  # kept numbers test this with smaller logs
def test_one_model_is_fitted_to_several_logs_with_missing_samples() -> None:
    first, second = draw_log(5, 300), draw_log(6, 300)
    both = [
        channels_from([*a.u, *b.u], [*a.y, np.where(np.arange(300) % 7 == k, np.nan, b.y[0])], 0.01, ["a", "b"], name)
        for k, (a, b, name) in enumerate(zip(first, second, "yz", strict=True))
    ]
    found = identify_state_space(both, order=3, delay=1)
    assert min(one.quality.fit_percent for one in found) > 90.0


@pytest.mark.slow  # kept numbers test this with a smaller log
def test_auto_takes_the_state_space_if_outputs_share_their_dynamics() -> None:
    shared = identify_outputs(draw_log(7, 300), structure="auto", order=3, delay=1)
    assert {one.model.structure for one in shared} == {"state-space"}
    compared = {row["structure"] for row in shared[0].candidates}
    assert compared >= {"state-space", "output-error"}


@pytest.mark.slow
def test_outputs_without_common_dynamics_keep_separate_models() -> None:
    rng = np.random.default_rng(8)
    u = np.repeat(rng.normal(size=(60, 2)), 4, axis=0)
    y = filtered([0.0, 0.4], [1.0, -0.8], u[:, 0]) + 0.05 * rng.normal(size=240)
    z = filtered([0.0, 0.0, 0.0, 1.0], [1.0, -0.3], u[:, 1]) + 0.05 * rng.normal(size=240)
    data = [channels_from([u], [one], 1.0, ["a", "b"], name) for one, name in ((y, "y"), (z, "z"))]
    found = identify_outputs(data, structure="auto", order=1)
    assert "state-space" not in {one.model.structure for one in found}


def test_too_high_an_order_a_numerator_size_and_different_inputs_are_refused() -> None:
    data = draw_log(9, 40)
    with pytest.raises(HydrostateError, match="give a lower order"):
        identify_state_space(data, order=12)
    with pytest.raises(HydrostateError, match="no numerator of its own"):
        identify_outputs(data, structure="state-space", n_numerator=2)
    other = channels_from([data[0].u[0]], [data[0].y[0]], 0.01, ["a", "c"], "y")
    with pytest.raises(HydrostateError, match="must have the same inputs"):
        identify_state_space([other, data[1]], order=1)


def test_a_model_no_better_than_the_mean_is_not_sound() -> None:
    rng = np.random.default_rng(10)
    u = rng.normal(size=(200, 2))
    data = [channels_from([u], [rng.normal(size=200)], 1.0, ["a", "b"], name) for name in "yz"]
    with pytest.warns(LogWarning) as said:
        found = identify_state_space(data, order=2, delay=1)
    assert not any(one.sound for one in found)
    places = {one.message.note.code: one.filename for one in said}  # type: ignore[union-attr]
    assert places[IdentificationCode.NO_FIT] == __file__


@pytest.mark.parametrize(("radius", "slowest"), [(0.9, -0.02 / np.log(0.9)), (1.0, np.inf), (1.2, np.inf)])
def test_a_time_constant_too_long_for_the_log_is_noted_in_seconds(
    radius: float, slowest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identify, "doubtful_channels", lambda *_: [])
    a = np.array([[radius, 1.0], [0.0, 0.3]])
    best: Any = SimpleNamespace(doubt="time_constant", fit=SimpleNamespace(a=a, size=SimpleNamespace(n=2)))
    data: Any = SimpleNamespace(u=[], y=[], sample_time=0.02, duration=5.0, output="y")
    model: Any = SimpleNamespace(quality=lambda *_: SimpleNamespace(fit_percent=90.0))
    found = _judged_output(model, data, best, 0.1, ())
    (note,) = found.notes
    assert note.code == IdentificationCode.TIME_CONSTANT_BEYOND_RECORD
    assert note.data["time_constant_s"] == pytest.approx(slowest)
    assert (note.data["duration_s"], note.data["order"], found.held_back_percent) == (5.0, 2, pytest.approx(90.0))
    best.doubt = ""
    assert _judged_output(model, data, best, 0.1, ()).notes == ()
    assert [one.code for one in _judged_output(model, data, best, 1.0, ()).notes] == [IdentificationCode.NO_FIT]
