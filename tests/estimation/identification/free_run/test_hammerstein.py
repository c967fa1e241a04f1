"""A nonlinearity at a model's input is found, with intervals in the input's unit, and saved with the model."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.identification.bent_inputs import PLANTED_NONLINEARITIES, PlantedNonlinearity, draw_log
from estimation.identification.free_run import choose_hammerstein
from estimation.identification.free_run.choose_hammerstein import (
    ORDERS,
    HammersteinCandidate,
    _bases,
    _cancellation_doubt,
    chosen_hammerstein,
    hammerstein_candidates,
    worthwhile_candidate,
)
from estimation.identification.free_run.choose_linear import linear_candidates
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.hammerstein_fit import HammersteinFit, HammersteinProblem, fit_hammerstein
from estimation.identification.free_run.held_back import BLOCKS, pooled_error
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES, play
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.free_run.model import FreeRunModel
from plant.errors import HydrostateError


def identified(data: Channels) -> Identified:
    return identify_channels(data, structure="hammerstein", order=2, delay=1)


@pytest.fixture(scope="module", params=PLANTED_NONLINEARITIES, ids=lambda one: one.kind)
def planted(request: pytest.FixtureRequest) -> PlantedNonlinearity:
    return request.param


@pytest.fixture(scope="module")
def found(planted: PlantedNonlinearity) -> Identified:
    return identified(draw_log(planted, 1))


def test_the_true_nonlinearity_is_found_within_its_interval(planted: PlantedNonlinearity, found: Identified) -> None:
    assert found.sound
    assert found.model.structure == "hammerstein"
    assert isinstance(found.model.dynamics, HammersteinDynamics)
    said = found.model.dynamics.nonlinearity(found.model.scaling)
    assert said["kind"] == planted.kind
    for name, value in planted.values.items():
        assert abs(said[name]["value"] - value) < 4.0 * said[name]["std"] < 0.1
        assert said[name]["ci95"] == pytest.approx(
            [said[name]["value"] + side * said[name]["std"] for side in (-1.96, 1.96)], rel=1e-3
        )
    assert found.held_back_percent > 94.0
    kinds = {row["nonlinearity"] for row in found.candidates if row["structure"] == "hammerstein"}
    assert planted.kind in kinds <= set(NONLINEARITIES)


def test_a_saved_model_simulates_the_same_output(planted: PlantedNonlinearity, found: Identified) -> None:
    data, model = draw_log(planted, 2), found.model
    again = FreeRunModel.from_dict(json.loads(json.dumps(model.to_dict())))
    np.testing.assert_array_equal(again.simulate(data.u[0], data.y[0]), model.simulate(data.u[0], data.y[0]))
    assert isinstance(again.dynamics, HammersteinDynamics)
    assert again.dynamics.nonlinearity(again.scaling) == model.dynamics.nonlinearity(model.scaling)  # type: ignore[attr-defined]
    with pytest.raises(HydrostateError, match="a hammerstein model has no transfer function"):
        model.to_control()


def test_a_free_run_without_measured_outputs_follows_the_plant(planted: PlantedNonlinearity, found: Identified) -> None:
    data, model = draw_log(planted, 3), found.model
    left = (model.simulate(data.u[0]) - data.y[0])[200:]
    assert left.std() < 0.1 * data.y[0].std()


def test_derivatives_are_exact_if_no_sample_changes_its_branch_of_the_nonlinearity(
    planted: PlantedNonlinearity,
) -> None:
    data, by = scaled(draw_log(planted, 4))
    problem = HammersteinProblem(planted.kind, Form(2, (2,), (1,)), data)
    values = np.array(list(planted.values.values())) - (by.u_mean[0] if NONLINEARITIES[planted.kind].level else 0.0)
    starts = np.full(problem.n_starts, data.u[0][0, 0])
    theta = np.concatenate([values / by.u_std[0], starts, [0.1, 0.05, -1.6, 0.75, 0.0, 0.1, 0.2]])
    _, jacobian = problem.jacobian(theta)
    for j, step in enumerate(1e-7 * np.eye(theta.size)):
        rise = (problem.jacobian(theta + step)[0] - problem.jacobian(theta - step)[0]) / 2e-7
        np.testing.assert_allclose(jacobian[:, j], rise, atol=1e-5 * max(np.abs(rise).max(), 1.0))


def test_a_linear_plant_gets_a_linear_model() -> None:
    rng = np.random.default_rng(5)
    u, y = np.repeat(rng.normal(size=120), 10), np.zeros(1200)
    for k in range(2, 1200):
        y[k] = 1.6 * y[k - 1] - 0.75 * y[k - 2] + 0.15 * u[k - 1]
    found = identified(channels_from([u[:, None]], [y + 0.05 * rng.normal(size=1200)], 0.01, ["u"], "y"))
    assert found.model.structure == "output-error"
    assert "no_nonlinearity" in {str(note.code) for note in found.notes}


def test_a_nonlinearity_is_found_in_several_logs_with_gaps() -> None:
    parts = [draw_log(PLANTED_NONLINEARITIES[2], seed) for seed in (6, 7)]
    outputs = [np.array(one.y[0]) for one in parts]
    outputs[0][300:350] = np.nan
    both = channels_from([one.u[0] for one in parts], outputs, 0.01, ["u"], "y")
    found = identified(both)
    assert isinstance(found.model.dynamics, HammersteinDynamics)
    said = found.model.dynamics.nonlinearity(found.model.scaling)["half_width"]
    assert abs(said["value"] - 0.3) < 4.0 * said["std"]


def test_several_inputs_are_refused() -> None:
    rng = np.random.default_rng(8)
    data = channels_from([rng.normal(size=(100, 2))], [rng.normal(size=100)], 1.0, ["a", "b"], "y")
    with pytest.raises(HydrostateError, match="structure hammerstein takes one input, got a, b"):
        identify_channels(data, structure="hammerstein", order=1, delay=1)


def test_a_saturation_is_not_fitted_to_an_input_of_two_levels() -> None:
    data = channels_from([np.array([[0.0], [1.0]] * 30)], [np.sin(np.arange(60.0))], 1.0, ["u"], "y")
    narrow = fit_hammerstein("saturation", Form(1, (1,), (1,)), scaled(data)[0], [np.array([1.0, -0.5])])
    assert narrow is None or narrow.cost > 0.0


def test_backlash_follows_at_half_its_width_and_is_constant_in_between() -> None:
    out, slopes = np.empty(6), np.empty((6, 2))
    play(np.array([0.0, 2.0, 1.5, 0.5, -1.0, 0.0]), 0.5, 0.2, out, slopes)
    np.testing.assert_array_equal(out, [0.2, 1.5, 1.5, 1.0, -0.5, -0.5])
    np.testing.assert_array_equal(slopes, [[0, 1], [-1, 0], [-1, 0], [1, 0], [1, 0], [1, 0]])


@pytest.mark.parametrize(
    "bent",
    [
        pytest.param(one, id=one.kind, marks=() if one.kind == "saturation" else pytest.mark.slow)
        for one in PLANTED_NONLINEARITIES
    ],
)  # a test above covers that each kind is found
def test_auto_takes_a_nonlinearity_that_is_best_on_held_back_blocks(bent: PlantedNonlinearity) -> None:
    found = identify_channels(draw_log(bent, 5), structure="auto", order=2, delay=1)
    assert found.model.structure == "hammerstein"
    assert isinstance(found.model.dynamics, HammersteinDynamics)
    assert found.model.dynamics.at_input == bent.kind
    rest = [row["held_back_percent"] for row in found.candidates if row["structure"] != "hammerstein"]
    assert found.held_back_percent > max(rest)
    # the linear model that was judged with it replaces it on inputs that do not determine it
    fallback = found.model.dynamics.fallback
    assert fallback is not None
    assert len(fallback.parts) == len(fallback.linear_parts) == BLOCKS
    assert fallback.own_error == pytest.approx(1.0 - found.held_back_percent / 100.0)


def test_a_saved_model_of_an_unknown_kind_is_refused() -> None:
    with pytest.raises(ValueError, match=f"a nonlinearity among {', '.join(NONLINEARITIES)} is needed, got 'bent'"):
        HammersteinDynamics.from_dict({"bend": "bent", "std": [None, 0.1], "values": [0.0, 1.0], "linear": {}})


def candidate(order: int, held_back: float, delay: int = 1, doubt: str = "", f: float = -0.5) -> Any:
    fit = SimpleNamespace(f=np.array([1.0, f]))
    return SimpleNamespace(
        form=SimpleNamespace(order=order, delays=(delay,)), held_back=held_back, doubt=doubt, fit=fit
    )


def test_nonlinear_fits_begin_at_the_best_linear_model_of_each_order_with_and_without_dead_time() -> None:
    best, late = candidate(1, 0.2), candidate(1, 0.3, delay=0)
    linear = [candidate(1, 0.25, delay=2), best, candidate(1, 0.4, delay=7), late, candidate(ORDERS + 1, 0.1)]
    assert _bases(linear) == [best, late]


def test_a_denominator_with_a_doubtful_time_constant_is_a_start_only_without_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: list[list[float]] = []

    def fit(kind: str, form: Any, data: Channels, denominators: list[np.ndarray]) -> None:  # noqa: ARG001
        given.append([float(one[1]) for one in denominators])

    monkeypatch.setattr(choose_hammerstein, "fit_hammerstein", fit)
    slow = candidate(1, 0.2, doubt="time_constant", f=-1.0)
    data = scaled(draw_log(PLANTED_NONLINEARITIES[0], 1))[0]
    assert hammerstein_candidates([slow, candidate(1, 0.3), candidate(2, 0.4, f=-0.9)], data) == []
    assert given == [[-0.5], [-0.9]] * len(NONLINEARITIES)
    given.clear()
    hammerstein_candidates([slow], data)
    assert given == [[-1.0]] * len(NONLINEARITIES)  # this denominator alone is better than none


def test_the_best_nonlinear_fit_of_each_kind_and_order_is_judged_on_held_back_blocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = scaled(draw_log(PLANTED_NONLINEARITIES[0], 3))[0]
    linear = linear_candidates(data, [1, 2, 3], (1,))
    hopeful = hammerstein_candidates(linear, data)
    # a saturation leaves more of the fitted data than a linear model leaves of held-back data
    assert "dead-zone" in {one.fit.kind for one in hopeful}
    assert "saturation" not in {one.fit.kind for one in hopeful}
    monkeypatch.setattr("estimation.identification.free_run.choose_hammerstein.BENT_MARGIN", -100.0)
    found = hammerstein_candidates(linear, data)
    orders = {kind: [one.fit.linear.form.order for one in found if one.fit.kind == kind] for kind in NONLINEARITIES}
    assert orders == {kind: [1, 2, 3] for kind in NONLINEARITIES}
    assert chosen_hammerstein(found).fit.kind == "dead-zone"
    assert chosen_hammerstein(found).fit.linear.form.order == 2  # the order of the plant, although 3 fits no worse
    assert found[2].fit.cost <= found[1].fit.cost


@pytest.mark.parametrize(("pole", "doubt"), [(0.999, "cancelling"), (0.99, "")])
def test_a_pole_slower_than_a_block_and_cancelled_by_a_zero_is_doubtful(pole: float, doubt: str) -> None:
    data = scaled(draw_log(PLANTED_NONLINEARITIES[0], 3))[0]
    b, f = 0.3 * np.array([1.0, -pole]), np.convolve([1.0, -0.8], [1.0, -pole])
    fit = HammersteinFit(
        "dead-zone",
        np.array([-0.4, 0.6]),
        np.empty(0),
        LinearFit(Form(2, (2,), (1,)), np.array([*b, *f[1:], 0, 0, 0]), 1),
    )
    assert _cancellation_doubt(fit, data) == doubt


def test_a_doubtful_nonlinearity_is_taken_only_if_all_are_doubtful() -> None:
    fit: Any = None
    good, better = (
        HammersteinCandidate(fit, doubt, block_errors=(error,), bic=bic)
        for doubt, error, bic in (("", 0.3, 2.0), ("cancelling", 0.2, 1.0))
    )
    assert chosen_hammerstein([good, better]) is good
    assert chosen_hammerstein([better]) is better


def bent(blocks: tuple[float, ...]) -> HammersteinCandidate:
    fit: Any = None
    return HammersteinCandidate(fit, block_errors=blocks, bic=1.0)


def straight(blocks: tuple[float, ...]) -> Any:
    return SimpleNamespace(held_back=pooled_error(blocks), block_errors=blocks)


def test_a_nonlinearity_that_was_not_requested_must_gain_more_than_the_scatter_of_blocks() -> None:
    best = straight((0.3, 0.3, 0.3, 0.3))
    even, chance = bent((0.28, 0.29, 0.28, 0.29)), bent((0.31, 0.32, 0.31, 0.10))
    assert chance.held_back < even.held_back < 0.98 * best.held_back
    for asked in (True, False):
        assert worthwhile_candidate([even], [best], best, surely=not asked) is even
        as_good = straight((0.285,) * 4)
        assert worthwhile_candidate([even], [best, as_good], best, surely=not asked) is None
        assert worthwhile_candidate([], [best], best, surely=not asked) is None
    assert worthwhile_candidate([chance], [best], best, surely=True) is None  # it is better in only one block of four
    assert worthwhile_candidate([chance], [best], best, surely=False) is chance
    halfway = bent((0.2, 0.2, 0.29, 0.31))  # better on two blocks of four, and on all together by 1.7 standard errors
    assert worthwhile_candidate([halfway], [best], best, surely=True) is None


def test_the_chosen_nonlinear_fit_is_repeated_only_if_it_was_judged_on_fewer_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, again = draw_log(PLANTED_NONLINEARITIES[0], 1), list[int]()

    def refit(fit: HammersteinFit, part: Channels) -> HammersteinFit:
        again.append(part.n_samples)
        return fit

    monkeypatch.setattr("estimation.identification.free_run.identify.refitted_hammerstein", refit)
    identified(data)
    assert again == []
    monkeypatch.setattr("estimation.identification.free_run.identify.MOST_COMPARED", data.n_samples - 1)
    identified(data)
    assert again == [data.n_samples]  # it was judged on fewer samples


def test_only_auto_requires_a_significant_advantage_of_a_nonlinearity(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[bool] = []

    def none(*_: Any, surely: bool) -> None:
        asked.append(surely)

    monkeypatch.setattr("estimation.identification.free_run.identify.worthwhile_candidate", none)
    monkeypatch.setattr("estimation.identification.free_run.identify.hammerstein_candidates", lambda *_: [])
    monkeypatch.setattr("estimation.identification.free_run.identify.polynomial_candidates", lambda *_: [])
    for structure in ("auto", "hammerstein"):
        identify_channels(draw_log(PLANTED_NONLINEARITIES[0], 1), structure=structure, order=2, delay=1)
    assert asked == [True, False]


def test_without_a_fitted_nonlinearity_the_model_is_linear_with_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimation.identification.free_run.identify.hammerstein_candidates", lambda *_: [])
    found = identified(draw_log(PLANTED_NONLINEARITIES[0], 1))
    assert found.model.structure == "output-error"
    assert "no_nonlinearity" in {str(note.code) for note in found.notes}


@pytest.mark.parametrize(
    ("kind", "allowed", "refused"),
    [
        ("backlash", [[0.0], [0.99]], [[-0.01], [1.0], [1.5]]),  # a play as wide as the input moves nothing
        ("dead-zone", [[-0.5, 0.5], [0.2, 0.2], [-1.0, 1.0]], [[0.5, 0.4], [-1.1, 0.0], [0.0, 1.1]]),
        ("saturation", [[-0.5, 0.5], [-1.0, 1.0]], [[0.2, 0.2], [-1.1, 0.0], [0.0, 1.1]]),
    ],
)
def test_the_values_of_a_nonlinearity_must_lie_within_the_range_of_the_input(
    kind: str, allowed: list[list[float]], refused: list[list[float]]
) -> None:
    u, bend = np.linspace(-1.0, 1.0, 201), NONLINEARITIES[kind]
    assert [bend.may(u, np.array(values)) for values in allowed] == [True] * len(allowed)
    assert [bend.may(u, np.array(values)) for values in refused] == [False] * len(refused)
    assert all(bend.may(u, start) for start in bend.starts(u))
