"""Doubtful channels are reported: inputs that are alike, and outputs with outliers."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete

from estimation.identification.free_run.data import Channels, Scaling, channels_from
from estimation.identification.free_run.doubtful_channels import (
    _explained_by_filter,
    dependent_input_notes,
    outlier_notes,
    residual_notes,
)
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.input_range import doubts_about_inputs
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode

DELAY = 30


def channels(count: int = 400, seed: int = 0) -> Channels:
    rng = np.random.default_rng(seed)
    u = rng.normal(size=count)
    y = np.concatenate([np.zeros(DELAY), u[:-DELAY]]) + 0.05 * rng.normal(size=count)
    return channels_from([u[:, None]], [y], 1e-3, ["valve"], "flow")


@pytest.fixture(scope="module")
def model() -> FreeRunModel:
    return identify_channels(channels(), order=1, delay=DELAY).model


def test_an_input_that_is_an_exact_combination_of_others_is_noted() -> None:
    u = np.random.default_rng(0).normal(size=(300, 3))
    names = ("a", "b", "sum")

    def told(third: np.ndarray) -> list[tuple[object, object]]:
        data = Channels(names, "y", 1.0, (np.column_stack([u[:, :2], third]),), (u[:, 0],))
        return [(note.data["channel"], note.data["others"]) for note in dependent_input_notes(data)]

    assert told(u[:, 0] - 2.0 * u[:, 1] + 5.0) == [("sum", "'a' and 'b'")]
    assert told(3.0 * u[:, 1]) == [("sum", "'b'")]
    assert told(u[:, 0] + 1e-3 * u[:, 2]) == []
    assert told(np.full(300, 2.0)) == []  # a constant input is not a function of another


@pytest.mark.parametrize("size", [30.0, 1e6])
def test_outliers_of_the_output_are_noted(size: float) -> None:
    data = channels()
    y = data.y[0].copy()
    y[[50, 200, 310]] += size
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # other notes on such a fit do not matter here
        found = identify_channels(replace(data, y=(y,)), order=1, delay=DELAY)
    assert [note.data["count"] for note in found.notes if note.code == "outliers"] == [3]


def test_output_peaks_caused_by_the_input_are_not_taken_for_outliers(model: FreeRunModel) -> None:
    data = channels()
    u = 0.01 * data.u[0]
    u[[50, 200, 310]] = 40.0
    y = model.simulate(u) + 0.01 * data.y[0]
    assert outlier_notes(model, replace(data, u=(u,), y=(y,))) == []


def test_a_log_no_longer_than_the_dead_time_has_no_fit_and_a_note_with_the_reason(model: FreeRunModel) -> None:
    brief = channels(DELAY + 1)
    brief = replace(brief, u=(brief.u[0][:DELAY],), y=(brief.y[0][:DELAY],))
    assert np.isnan(model.quality(brief.u, brief.y).fit_percent)
    (note,) = doubts_about_inputs(model, brief, [])
    assert (note.code, note.data["longest"], note.data["dead_time"]) == ("nothing_answered", DELAY, DELAY)
    assert doubts_about_inputs(model, channels(), []) == []


def test_an_output_equal_to_its_input_gives_a_sound_linear_model() -> None:
    u = np.repeat([1.0, -1.0, 1.0, 1.0, -1.0], 60)
    data = channels_from([u[:, None]], [u], 1.0, ["u"], "y")
    found = identify_channels(data, structure="auto", order=1, delay=0)
    assert found.sound
    assert found.model.structure == "output-error"
    assert found.quality.fit_percent == pytest.approx(100.0)


@pytest.mark.parametrize(("dead", "told"), [(0.5, True), (0.0, False)])
def test_a_linear_model_of_a_plant_with_a_dead_zone_is_noted_to_leave_more_than_noise(dead: float, told: bool) -> None:
    rng = np.random.default_rng(3)
    u = filtered(np.array([0.1]), np.array([1.0, -0.9]), rng.normal(size=800))
    bent = np.sign(u) * np.maximum(np.abs(u) - dead * u.std(), 0.0)
    y = filtered(np.array([0.0, 0.2]), np.array([1.0, -0.8]), bent)
    found = identify_channels(
        channels_from([u[:, None]], [y + 0.02 * y.std() * rng.normal(size=800)], 0.01, ["u"], "y"), order=1, delay=1
    )
    assert (IdentificationCode.MORE_THAN_NOISE in {note.code for note in found.notes}) is told


def with_noise(kind: str, seed: int, n: int = 800) -> set[object]:
    """Return the note codes of a linear plant with coloured sensor noise of 15 %."""
    rng = np.random.default_rng(seed)
    u = filtered(np.array([0.1]), np.array([1.0, -0.9]), rng.normal(size=n))
    y = filtered(np.array([0.0, 0.2]), np.array([1.0, -0.8]), u)
    white = rng.normal(size=n)
    noise = np.repeat(white, 7)[:n] if kind == "held" else filtered(np.array([1.0]), np.array([1.0, -0.85]), white)
    data = channels_from([u[:, None]], [y + 0.15 * y.std() * noise / noise.std()], 0.01, ["u"], "y")
    return {note.code for note in identify_channels(data, order=1, delay=1).notes}


@pytest.mark.parametrize("kind", ["held", "filtered"])
def test_filtered_or_held_sensor_noise_is_not_taken_for_a_nonlinear_plant(kind: str) -> None:
    for seed in range(20, 24):
        assert IdentificationCode.MORE_THAN_NOISE not in with_noise(kind, seed)


@pytest.mark.parametrize(("order", "told"), [(None, True), (4, False)])
def test_a_model_that_is_too_small_for_a_sweep_is_noted(order: int | None, told: bool) -> None:
    """Held-back blocks of a sweep each have frequencies that no other has, so they prefer a model that is too small."""
    rng = np.random.default_rng(5)
    u = np.sin(np.cumsum(2.0 * np.pi * np.linspace(0.002, 0.3, 4000)))
    first, second = (np.array([1.0, 5.0, 900.0]), np.array([1.0, 10.0, 6000.0]))  # modes at 30 and 77 rad/s
    numerator, denominator, _ = cont2discrete(([540.0, 2160.0, 1.35e6], np.polymul(first, second)), 0.01, "zoh")
    y = filtered(numerator.ravel(), denominator, u)
    data = channels_from([u[:, None]], [y + 0.1 * y.std() * rng.normal(size=u.size)], 0.01, ["u"], "y")
    found = identify_channels(data, order=order)
    notes = {note.code: note.data for note in found.notes}
    assert (IdentificationCode.MODEL_TOO_SMALL in notes) is told
    if told:
        assert notes[IdentificationCode.MODEL_TOO_SMALL]["explained"] > 0.5


@pytest.mark.parametrize("every", [1, 3])
def test_the_check_for_more_than_noise_uses_present_samples_after_the_dead_time_only(every: int) -> None:
    rng = np.random.default_rng(3)
    u = filtered(np.array([0.1]), np.array([1.0, -0.97]), rng.normal(size=2000))
    y = np.concatenate([np.full(100, 5.0 * u.std()), u[:-100]]) + 0.05 * u.std() * rng.normal(size=2000)
    y[np.arange(2000) % every != 0] = np.nan
    form, by = Form(1, (1,), (100,)), Scaling(np.zeros(1), np.ones(1), 0.0, 1.0)
    model = FreeRunModel(("u",), "y", 0.01, "output-error", by, LinearDynamics(form, np.array([1.0, 0.0, 0.0])))
    assert residual_notes(model, Channels(("u",), "y", 0.01, (u[:, None],), (y,))) == []
    bent = y + 0.5 * np.abs(np.concatenate([np.zeros(100), u[:-100]]))
    assert residual_notes(model, Channels(("u",), "y", 0.01, (u[:, None],), (bent,))) != []


def test_an_absolute_value_that_is_also_cut_off_is_noted_and_not_sound() -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, 100), 12)[:1000]
    y = np.minimum(np.abs(filtered(np.array([0.0, 0.2]), np.array([1.0, -0.9]), u)), 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the choice of the model does not matter here
        data = channels_from([u[:, None]], [y + 0.005 * rng.normal(size=1000)], 0.01, ["u"], "y")
        found = identify_channels(data, order=1, delay=1)
    assert IdentificationCode.SIGN_NOT_MEASURED in {note.code for note in found.notes}
    assert not found.sound


@pytest.mark.parametrize(
    ("late", "noise", "pole", "told"),
    [
        (2, 0.01, 0.9, "INPUT_LOGGED_LATE"),
        (None, 0.01, 0.9, "SWAPPED"),
        # with noise, the model of the other direction leaves a large error, too
        (2, 0.03, 0.97, "INPUT_LOGGED_LATE"),
        (4, 0.06, 0.9, "INPUT_LOGGED_LATE"),
    ],
)
def test_an_input_logged_late_is_distinguished_from_swapped_columns(
    late: int | None, noise: float, pole: float, told: str
) -> None:
    rng = np.random.default_rng(50)
    u = filtered(np.array([0.1]), np.array([1.0, -pole]), rng.normal(size=800))
    y = filtered(np.array([0.0, 0.2]), np.array([1.0, -0.8]), u)
    y = y + noise * y.std() * rng.normal(size=800)
    one, other = (y, u) if late is None else (u[:-late], y[late:])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # only the notes matter here
        found = identify_channels(channels_from([one[:, None]], [other], 0.01, ["one"], "other"), order=1, delay=0)
    codes = {note.code for note in found.notes}
    both = {IdentificationCode.SWAPPED, IdentificationCode.INPUT_LOGGED_LATE}
    assert codes & both == {IdentificationCode[told]}
    assert not found.sound  # gains are off by many deviations


@pytest.mark.parametrize("caused", [0.0, 0.5])
def test_what_a_filter_explains_by_chance_does_not_count(caused: float) -> None:
    """Fifty coefficients explain a seventh of 400 samples of any noise."""
    found = list[float]()
    for seed in range(10):
        rng = np.random.default_rng(seed)
        u, noise = rng.standard_normal((400, 1)), rng.standard_normal(400)
        left = caused**0.5 * np.roll(u[:, 0], 3) + (1.0 - caused) ** 0.5 * noise
        found.append(_explained_by_filter([left], [u]))
    assert np.mean(found) == pytest.approx(caused, abs=0.03)
