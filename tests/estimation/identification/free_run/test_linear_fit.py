"""Output-error models with several inputs, offset and initial states, and the choice of their order."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.fit.output_error import screened
from estimation.identification.free_run import linear_fit
from estimation.identification.free_run.choose_linear import _forms, candidate, chosen_linear, linear_candidates
from estimation.identification.free_run.data import Channels, blocks, channels_from, scaled
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_kernel import decay_rows, settles
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.free_run.other_structures import fit_other_structure
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import Experiments
from plant.errors import HydrostateError, LogWarning

F = [1.0, -1.5, 0.7]


def steps(n: int, seed: int, hold: int = 8) -> Array:
    return np.repeat(np.random.default_rng(seed).normal(size=n // hold + 1), hold)[:n]


def plant(u: Array, seed: int, noise: float = 0.02, offset: float = 5.0) -> Array:
    """Return the output of a second-order plant that responds after three samples, with offset and noise."""
    y = filtered([0.0, 0.0, 0.0, 0.2, 0.1], F, u - u[0])
    return offset + y + noise * np.random.default_rng(seed).normal(size=u.size)


def one_log(n: int = 600, seed: int = 1) -> Channels:
    u = 3.0 + steps(n, seed)
    return channels_from([u[:, None]], [plant(u, seed + 100)], 0.1, ["valve"], "level")


def test_a_long_dead_time_adds_no_states_to_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    u = steps(400, 3, 20)
    y = filtered([*[0.0] * 60, 0.5], [1.0, -0.5], u - u[0]) + 0.02 * np.random.default_rng(3).normal(size=u.size)
    data = scaled(channels_from([u[:, None]], [y], 0.1, ["valve"], "level"))[0]
    searched: list[int] = []

    def spied(structure: Structure, pair: Experiments) -> list[tuple[float, Array]]:
        searched.append(structure.n_states)
        return screened(structure, pair)

    monkeypatch.setattr(linear_fit, "screened", spied)
    found = fit_linear(Form(1, (1,), (60,)), data)
    assert searched == [1]
    assert found.f[1] == pytest.approx(-0.5, abs=0.05)


@pytest.mark.parametrize("order", [0, 1, 2, 5])
@pytest.mark.parametrize(("rows", "n"), [(1, 40), (2, 40), (5, 40), (3, 4), (2, 1), (0, 9), (2, 0)])
def test_rows_filtered_together_equal_each_filtered_alone_from_the_steady_state_of_its_level(
    order: int, rows: int, n: int
) -> None:
    f = np.atleast_1d(np.poly([0.9, 0.8, -0.3, 0.5, 0.2][:order])).astype(np.float64)
    rng = np.random.default_rng(order)
    series, levels = rng.normal(size=(rows, n)), rng.normal(size=rows)
    ran = series.copy()
    decay_rows(f, ran, levels)
    rest = np.repeat(levels[:, None], 600, axis=1)  # long enough to reach the steady state of the level
    alone = [filtered([1.0], f, np.concatenate([a, b]))[600:] for a, b in zip(rest, series, strict=True)]
    assert ran == pytest.approx(np.array(alone).reshape(ran.shape), rel=1e-9, abs=1e-9)


def test_a_denominator_with_a_sum_lost_to_rounding_is_not_run() -> None:
    data, _ = scaled(one_log(120))
    problem = Problem(Form(2, (2,), (3,)), data)
    swallowed = np.array([-1.9999999999999947, 0.9999999999999947])
    assert stable(swallowed), "its roots are inside the circle"
    with pytest.raises(ArithmeticError):
        problem.jacobian(np.array([1.0, 1.0, *swallowed, 0.0, 0.0, 0.0]))
    assert not settles(swallowed)
    assert settles(np.array([-1.5, 0.7]))
    assert not settles(np.array([-2.1, 1.1]))


def test_sensitivities_are_the_derivatives_of_the_output() -> None:
    data, _ = scaled(one_log(120))
    problem = Problem(Form(2, (2,), (3,)), data)
    theta = problem.profiled(np.array([1.0, -1.2, 0.5]))[1]
    _, jacobian = problem.jacobian(theta)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-6
        moved = (problem.jacobian(theta + step)[0] - problem.jacobian(theta - step)[0]) / 2e-6
        assert moved == pytest.approx(jacobian[:, k], abs=1e-6)


def test_delay_and_offset_are_found_with_a_mean_other_than_zero() -> None:
    """The order is given as 2, since two more poles act nearly like a dead time of three samples."""
    found = identify_channels(one_log(300), order=2)
    linear = found.model.linear
    assert linear is not None
    assert (linear.denominator.size - 1, linear.delay) == (2, 3)
    assert linear.dc_gain == pytest.approx(1.5, abs=4.0 * linear.dc_gain_std)
    assert found.model.offset == pytest.approx(5.0 - 1.5 * (3.0 + steps(600, 1)[0]), abs=0.05)
    assert found.sound
    assert found.held_back_percent == pytest.approx(found.quality.fit_percent, abs=1.0)


def test_the_transfer_function_simulates_the_same_output_as_the_model() -> None:
    data = one_log()
    model = identify_channels(data, order=2, delay=3).model
    assert model.linear is not None
    u = data.u[0][:, 0]
    ours = model.simulate(u, data.y[0])
    theirs = model.linear.simulate(u, initial=model.linear.initial_state)
    assert theirs[20:] == pytest.approx(ours[20:], abs=1e-3)
    (b, f) = model.transfer_functions()[0]
    assert b.sum() / f.sum() == pytest.approx(model.linear.dc_gain)


def test_one_model_is_fitted_to_several_inputs_and_several_logs() -> None:
    u, y = [], []
    for seed in (1, 2):
        both = np.column_stack([steps(300, seed), 10.0 * steps(300, seed + 10)])
        out = filtered([0.0, 0.5], [1.0, -0.8], both[:, 0]) + filtered([0.0, 0.0, 0.02], [1.0, -0.8], both[:, 1])
        u.append(both)
        y.append(7.0 * seed**0 + out + 0.01 * np.random.default_rng(seed).normal(size=300))
    y[1][40:60] = np.nan
    data = channels_from(u, y, 1.0, ["a", "b"], "y")
    found = identify_channels(data, order=1)
    gains = [b.sum() / f.sum() for b, f in found.model.transfer_functions()]
    assert gains == pytest.approx([2.5, 0.1], rel=0.02)
    assert found.model.offset == pytest.approx(7.0, abs=0.05)
    assert found.model.to_control().ninputs == 2


def test_a_held_back_block_does_not_affect_the_fit() -> None:
    data, _ = scaled(one_log(300))
    masks = blocks(data, 4)[1]
    spoilt = data.without([np.zeros(300, dtype=bool)])
    wrong = np.where(masks[0], 1e3, spoilt.y[0])
    clean = fit_linear(Form(2, (2,), (3,)), data.without(masks))
    same = fit_linear(Form(2, (2,), (3,)), Channels(data.inputs, "y", 0.1, data.u, (wrong,)).without(masks))
    assert same.theta == pytest.approx(clean.theta)


def test_a_drift_is_not_taken_for_a_time_constant_longer_than_the_record() -> None:
    rng = np.random.default_rng(3)
    u = steps(400, 3, hold=5)
    y = filtered([0.0, 0.4], [1.0, -0.6], u) + 1e-2 * np.cumsum(rng.normal(size=400))
    candidates = linear_candidates(scaled(channels_from([u[:, None]], [y], 1.0, ["u"], "y"))[0], [1, 2, 3], (1,))
    best = chosen_linear(candidates)
    poles = np.abs(np.roots(best.fit.f))
    assert not best.doubt
    assert (-1.0 / np.log(poles) <= 400).all()


def test_a_fit_with_a_time_constant_longer_than_the_record_is_repeated_with_a_bound() -> None:
    rng = np.random.default_rng(3)
    u = steps(400, 3, hold=5)
    y = filtered([0.0, 0.4], [1.0, -0.6], u) + 0.05 * np.cumsum(rng.normal(size=400))
    data = scaled(channels_from([u[:, None]], [y], 1.0, ["u"], "y"))[0]
    candidates = linear_candidates(data, [2], (1,))
    beyond = [one for one in candidates if one.doubt == "time_constant" and not one.fit.integrates]
    within = [one for one in candidates if one.fit.bounded]
    assert len(beyond) == len(within) == 1
    slowest = -1.0 / np.log(np.abs(np.roots(within[0].fit.f)).max())
    assert 100.0 < slowest <= 400.0
    assert not within[0].doubt
    # the bound costs little compared with other poles
    assert within[0].fit.cost < 1.05 * beyond[0].fit.cost


def test_of_equally_good_models_the_lowest_bic_is_taken_and_a_dead_time_counts_as_a_parameter() -> None:
    data = scaled(one_log(300))[0]
    one = candidate(fit_linear(Form(1, (1,), (1,)), data), data)
    tried = {
        "small": replace(one, block_errors=(0.1005,), bic=-900.0),
        "probable": replace(one, block_errors=(0.1000,), bic=-1000.0),
        "worse": replace(one, block_errors=(0.1020,), bic=-2000.0),
        "beyond": replace(one, block_errors=(0.0500,), bic=-3000.0, doubt="time_constant"),
    }
    assert chosen_linear(list(tried.values())) is tried["probable"]
    late, theta = fit_linear(Form(1, (1,), (3,)), data), one.fit.theta.size
    n = data.n_samples
    assert candidate(late, data).bic == pytest.approx(n * np.log(late.cost / n) + (theta + 1) * np.log(n))


@pytest.mark.parametrize("form", [{"order": 1, "delay": 1}, pytest.param({}, marks=pytest.mark.slow)], ids=str)
def test_a_model_no_better_than_the_mean_is_not_sound(form: dict[str, Any]) -> None:
    rng = np.random.default_rng(5)
    data = channels_from([rng.normal(size=(300, 1))], [rng.normal(size=300)], 1.0, ["u"], "y")
    with pytest.warns(LogWarning) as said:
        found = identify_channels(data, **form)
    assert not found.sound
    places = {one.message.note.code: one.filename for one in said}  # type: ignore[union-attr]
    assert places[IdentificationCode.NO_FIT] == __file__


def test_an_integrating_plant_gets_a_sound_model_and_a_warning() -> None:
    u = steps(200, 8, hold=10)
    y = np.cumsum(0.1 * u) + 0.02 * np.random.default_rng(8).normal(size=200)
    with pytest.warns(LogWarning, match="integrates its input"):
        found = identify_channels(channels_from([u[:, None]], [y], 1.0, ["u"], "y"), order=1)
    assert found.sound
    assert found.quality.fit_percent > 90.0


@pytest.mark.parametrize(
    ("u", "y", "said"),
    [
        (np.ones((50, 1)), np.arange(50.0), "channel 'u' must vary, got 1 throughout"),
        (np.arange(50.0)[:, None], np.ones(50), "channel 'y' must vary"),
        (np.arange(5.0)[:, None], np.arange(5.0), "needs 20 samples or more, got 5"),
        (np.full((50, 1), np.nan), np.arange(50.0), "must be finite"),
        (np.ones((50, 2)), np.arange(50.0), "shape"),
    ],
)
def test_unusable_channels_are_refused(u: Array, y: Array, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        channels_from([u], [y], 1.0, ["u"], "y")


@pytest.mark.parametrize("samples", [20, 25, 26])
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_a_log_with_hardly_more_samples_than_needed_gets_a_model(samples: int) -> None:
    """The whiteness of the residual is tested at as many lags as the log allows."""
    u = steps(samples, 8, hold=3)
    y = filtered([0.0, 0.5], [1.0, -0.5], u) + 0.01 * np.random.default_rng(8).normal(size=samples)
    found = identify_channels(channels_from([u[:, None]], [y], 1.0, ["u"], "y"), order=1, delay=1)
    assert found.quality.fit_percent > 90.0
    assert found.model.linear is not None
    assert np.isfinite(found.model.linear.covariance).all()


def test_a_further_parameter_adds_two_to_aic_and_the_logarithm_of_the_sample_count_to_bic() -> None:
    data, _ = scaled(one_log(200))
    small, large = (candidate(fit_linear(Form(order, (1,), (1,)), data), data) for order in (1, 2))
    values = large.fit.theta.size - small.fit.theta.size
    assert values > 0
    gained = data.n_samples * float(np.log(small.fit.cost / large.fit.cost))
    assert small.aic - large.aic == pytest.approx(gained - 2.0 * values)
    assert small.bic - large.bic == pytest.approx(gained - values * float(np.log(data.n_samples)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sample_time": 0.0}, "sample_time must be positive and finite, got 0.0"),
        ({"sample_time": np.inf}, "sample_time must be positive and finite, got inf"),
        ({"u": []}, "as many inputs as outputs are needed, got 0 and 1"),
        ({"u": [np.ones((50, 2))]}, r"inputs valve of shape \(50, 1\) are needed beside 'level', got \(50, 2\)"),
        ({"u": [np.where(np.arange(50)[:, None] == 7, np.nan, 1.0)]}, "inputs valve must be finite at every sample"),
        ({"y": [np.where(np.arange(50) == 7, -np.inf, 1.0)]}, "output 'level' must be finite or missing"),
        ({"u": [np.ones((50, 1))]}, "valve"),
    ],
)
def test_inconsistent_channels_are_refused(changes: dict[str, Any], said: str) -> None:
    good = {"u": [steps(50, 1)[:, None]], "y": [steps(50, 2)], "sample_time": 0.1, "inputs": ["valve"]}
    with pytest.raises(HydrostateError, match=said):
        channels_from(**{**good, **changes}, output="level")


def test_a_run_with_other_inputs_or_another_number_of_outputs_is_refused() -> None:
    model = identify_channels(one_log(200), structure="output-error", order=2, delay=3).model
    with pytest.raises(HydrostateError, match=r"inputs valve are needed, shape \(n, 1\), got \(9, 2\)"):
        model.simulate(np.zeros((9, 2)), None)
    with pytest.raises(HydrostateError, match=r"input and output must be of one length, got 9 and \(8,\) samples"):
        model.simulate(np.zeros(9), np.zeros(8))
    away = model.quality([np.ones((30, 1))], [np.full(30, np.nan)])
    assert np.isnan([away.fit_percent, away.rmse]).all()


def two_inputs() -> Channels:
    u = np.stack([steps(300, 1), steps(300, 2)], axis=1)
    return channels_from([u], [plant(u[:, 0], 3)], 0.1, ["valve", "pump"], "level")


def with_a_gap(log: Channels) -> Channels:
    return replace(log, y=(np.where(np.arange(log.y[0].size) == 40, np.nan, log.y[0]),))


@pytest.mark.parametrize(
    ("structure", "log", "said"),
    [
        ("arx", two_inputs(), "structure arx takes one input, got valve, pump: use output-error"),
        ("subspace", with_a_gap(one_log(300)), "structure subspace needs every sample of 'level'"),
        ("instrumental", with_a_gap(one_log(300)), "structure instrumental needs every sample of 'level'"),
        (
            "subspace",
            Channels(("valve",), "level", 0.1, 2 * one_log(300).u, 2 * one_log(300).y),
            "takes one log, got 2",
        ),
    ],
)
def test_a_log_unsuitable_for_a_structure_is_refused(structure: str, log: Channels, said: str) -> None:
    by = scaled(log)[1]
    with pytest.raises(HydrostateError, match=said):
        fit_other_structure(structure, Form(2, (2,), (1,)), log, by)


def test_each_order_is_tried_with_the_estimated_dead_times_and_with_none_or_one_sample() -> None:
    assert _forms(2, (3, 0), 2, None) == [
        Form(2, (2, 3), (3, 0)),  # one value more if the output responds at once
        Form(2, (3, 3), (3, 0)),
        Form(2, (3, 3), (0, 0)),
        Form(2, (2, 2), (1, 1)),
    ]
    assert _forms(2, (1,), 1, None) == [Form(2, (2,), (1,)), Form(2, (3,), (1,)), Form(2, (3,), (0,))]
    assert _forms(2, (3, 0), 2, 4) == [Form(2, (4, 4), (3, 0))]
