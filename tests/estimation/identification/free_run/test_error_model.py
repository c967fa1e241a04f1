"""A polynomial of free run and inputs predicts what a model leaves, if held-back blocks surely say so."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.export.c_model import model_in_c
from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.error_model import MOST_CUBED, ErrorModel, error_model_of
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.input_range import (
    doubts_about_inputs,
    input_range_notes,
)
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.saved import load_models, save_models
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import HydrostateError

SAMPLES = 800


def signals(seed: int, product: float = 0.3) -> tuple[Array, Array]:
    """Return an input, and an output with the product of a fast and a slow answer, which no product of few lags is."""
    rng = np.random.default_rng(seed)
    u = filtered([0.1], [1.0, -0.9], rng.normal(size=SAMPLES))
    u /= np.std(u)
    fast, slow = filtered([0.2], [1.0, -0.8], u), filtered([0.05], [1.0, -0.95], u)
    return u[:, None], fast + product * slow * fast + 0.005 * rng.normal(size=SAMPLES)


def linear_run(u: Array) -> Array:
    return filtered([0.2], [1.0, -0.8], u[:, 0])


def channels(u: Array, y: Array) -> Channels:
    return channels_from([u], [y], 0.01, [f"u{k}" for k in range(u.shape[1])], "y")


def error_model(seed: int = 0, product: float = 0.3, **changed: Array) -> ErrorModel | None:
    u, y = signals(seed, product)
    data = replace(Channels(("u",), "y", 0.01, (u,), (y,)), **{name: (one,) for name, one in changed.items()})
    return error_model_of([linear_run(u)], data, [0])


@cache
def identified(structure: str = "auto") -> Identified:
    return identify_channels(channels(*signals(3)), structure=structure, order=2, delay=0)


def test_an_error_model_leaves_a_third_of_the_error_on_another_record() -> None:
    found = error_model()
    assert found is not None
    u, y = signals(5)
    run = linear_run(u)
    error = found.predicted(u, run)
    assert error is not None
    before, after = np.std(y - run), np.std(y - run - error)
    assert after < 0.35 * before
    assert found.error < 0.5 * found.plain_error


def test_what_a_model_leaves_on_average_is_not_penalised() -> None:
    u, y = signals(0)
    found = error_model(y=y + 0.7)
    assert found is not None
    assert found.values[0] == pytest.approx(np.mean(y + 0.7 - linear_run(u)), rel=1e-12)


@pytest.mark.parametrize(("outputs", "fitted"), [(11, False), (12, True)])
def test_an_error_model_takes_two_outputs_for_each_coefficient(outputs: int, fitted: bool) -> None:
    u = np.random.default_rng(0).uniform(-1.0, 1.0, (SAMPLES, 1))
    y, run = np.full(SAMPLES, np.nan), linear_run(u)
    at = np.linspace(0, SAMPLES - 1, outputs).astype(int)
    y[at] = run[at] + u[at, 0] ** 2  # six coefficients: a constant, two signals, three products
    found = error_model_of([run], Channels(("u",), "y", 0.01, (u,), (y,)), [0])
    assert (found is not None) == fitted


@pytest.mark.parametrize("seed", range(8))
def test_what_is_noise_alone_has_no_error_model(seed: int) -> None:
    assert error_model(seed, product=0.0) is None


@pytest.mark.parametrize(("quarters", "corrected"), [(3, False), (4, True)])
def test_an_error_that_one_of_four_blocks_does_not_have_is_left_to_chance(quarters: int, corrected: bool) -> None:
    rng, driven = np.random.default_rng(0), np.arange(SAMPLES) < quarters * SAMPLES // 4
    u = np.where(driven, rng.uniform(-1.0, 1.0, SAMPLES), 0.0)[:, None]
    run, noise = linear_run(u), 0.3 * rng.standard_normal(SAMPLES)
    y = run + np.where(driven, u[:, 0] ** 2 - 1.0 / 3.0, noise)
    assert (error_model_of([run], Channels(("u",), "y", 0.01, (u,), (y,)), [0]) is not None) == corrected


def test_missing_and_undetermined_outputs_do_not_count() -> None:
    u, y = signals(0)
    wrong = np.where(np.arange(SAMPLES) < 100, 1e3, y)
    holes = np.where(np.arange(SAMPLES) % 3 == 0, np.nan, y)
    late = error_model_of([linear_run(u)], Channels(("u",), "y", 0.01, (u,), (wrong,)), [100])
    thin = error_model(y=holes)
    assert late is not None
    assert thin is not None
    assert max(late.plain_error, thin.plain_error) < 0.5


def test_products_of_three_are_tried_for_few_signals_only() -> None:
    u, y = signals(0)
    many = np.column_stack([u, *np.random.default_rng(1).normal(size=(2, SAMPLES))])
    few, crowded = error_model(), error_model_of([linear_run(u)], Channels((), "y", 0.01, (many,), (y,)), [0])
    assert few is not None
    assert crowded is not None
    for one, inputs in ((few, 1), (crowded, 3)):
        assert one.degree == 2 or len(one.lags) * (inputs + 1) <= MOST_CUBED
        assert one.n_values == one.values.size == one.means.size + 1


def test_signals_beyond_their_range_count_as_at_its_ends() -> None:
    found = error_model()
    assert found is not None
    agreed = replace(found, parts=np.array([found.values, found.values]))  # or such inputs would not determine it
    u, _ = signals(0)
    run = linear_run(u)
    low, high = found.ends
    at_end = agreed.predicted(np.full_like(u, high[1]), np.full_like(run, low[0]))
    assert at_end is not None
    assert np.all(np.abs(at_end) > 0.1)
    for far in (1e2, 1e4):
        ended = agreed.predicted(np.full_like(u, far), np.full_like(run, -far))
        assert ended is not None
        np.testing.assert_array_equal(ended, at_end)


def test_an_error_that_fits_without_a_block_do_not_agree_on_is_not_corrected() -> None:
    found = error_model()
    assert found is not None
    u, _ = signals(0)
    run = linear_run(u)
    apart = replace(found, parts=found.values + 100.0 * (found.parts - found.values))
    assert apart.predicted(u, run) is None
    assert found.predicted(u, run) is not None
    grown = np.where(np.arange(SAMPLES) > 9, np.nan, run)
    assert found.predicted(u, grown) is None


def test_auto_adds_an_error_model_and_says_so() -> None:
    found, plain = identified(), identified("output-error")
    assert found.model.error_model is not None
    assert plain.model.error_model is None
    assert IdentificationCode.ERROR_MODELLED in {note.code for note in found.notes}
    assert found.candidates[-1]["error_model"]["n_values"] == found.model.error_model.n_values
    u, y = signals(6)
    left = {one.model: np.std(one.model.simulate(u, y) - y) / np.std(y) for one in (found, plain)}
    assert left[found.model] < 0.5 * left[plain.model]
    held = (100.0 - found.held_back_percent) / 100.0
    assert held == pytest.approx(left[found.model], rel=0.6)


def test_a_saved_model_keeps_its_error_model(tmp_path: Path) -> None:
    model, (u, y) = identified().model, signals(7)
    save_models([model], tmp_path / "model.json")
    (again,) = load_models(tmp_path / "model.json")
    np.testing.assert_allclose(again.simulate(u, y), model.simulate(u, y), rtol=1e-12)
    assert again.n_values == model.n_values
    assert (model.to_dict()["version"], replace(model, error_model=None).to_dict()["version"]) == (2, 1)


@pytest.mark.parametrize(
    "change",
    [
        {"degree": 4},
        {"lags": [0, -1]},
        {"values": [1.0]},
        {"parts": [[1.0, 2.0]]},
        {"ends": [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]},
        {"means": "none"},
    ],
)
def test_a_saved_error_model_that_does_not_fit_together_is_refused(change: dict[str, object]) -> None:
    entries = identified().model.to_dict()
    with pytest.raises(HydrostateError, match="a saved model is not usable"):
        FreeRunModel.from_dict({**entries, "error_model": {**entries["error_model"], **change}})


def test_a_long_log_is_corrected_piece_by_piece_with_the_same_result(monkeypatch: pytest.MonkeyPatch) -> None:
    found, (u, _) = error_model(), signals(5)
    assert found is not None
    at_once = found.predicted(u, linear_run(u))
    assert at_once is not None
    monkeypatch.setattr("estimation.identification.free_run.error_model.MOST_ROWS", 37)
    in_pieces = found.predicted(u, linear_run(u))
    assert in_pieces is not None
    np.testing.assert_allclose(in_pieces, at_once, atol=1e-12)


def test_a_prediction_one_step_ahead_includes_the_error_model_if_it_is_the_free_run() -> None:
    model, (u, y) = identified("output-error").model, signals(7)
    beside = replace(model, error_model=error_model())
    np.testing.assert_array_equal(beside.predict(u, y), beside.simulate(u, y))
    assert not np.array_equal(beside.simulate(u, y), model.simulate(u, y))


def test_a_model_with_an_error_model_is_not_exported_and_warns_of_inputs_beyond_its_range() -> None:
    model = identified().model
    with pytest.raises(HydrostateError, match="--structure output-error"):
        model_in_c(model, name="model")
    u, y = signals(7)
    (note,) = input_range_notes(model, channels(3.0 * u, y))
    assert note.code == IdentificationCode.INPUT_BEYOND_RANGE
    assert not input_range_notes(model, channels(0.9 * u, y))


def test_a_run_without_the_error_model_says_so() -> None:
    model, (u, y) = identified().model, signals(7)
    assert model.error_model is not None
    assert doubts_about_inputs(model, channels(u, y), [model.free_run(u, y)]) == []
    spread = model.error_model.values + 100.0 * (model.error_model.parts - model.error_model.values)
    apart = replace(model, error_model=replace(model.error_model, parts=spread))
    (note,) = doubts_about_inputs(apart, channels(u, y), [apart.free_run(u, y)])
    assert note.code == IdentificationCode.ERROR_MODEL_LEFT_OUT
    np.testing.assert_array_equal(apart.simulate(u, y), replace(model, error_model=None).simulate(u, y))
