"""A linear model replaces a nonlinear one on inputs that do not determine the latter, and a note says so."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels, Scaling, channels_from
from estimation.identification.free_run.fallback import Fallback, jackknife
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.input_range import linear_fallback_notes
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_variables import Variables
from plant.notes import Note

N = 400


def gain(value: float) -> LinearDynamics:
    """Return ``y = value u``."""
    return LinearDynamics(Form(0, (1,), (0,)), np.array([value, 0.0]))


def bend(value: float) -> HammersteinDynamics:
    """Return ``y = value u`` up to the limits of a saturation."""
    return HammersteinDynamics("saturation", np.array([-5.0, 5.0]), np.full(2, np.nan), gain(value))


def notes_on_runs(model: FreeRunModel, data: Channels) -> list[Note]:
    return linear_fallback_notes(model, [*map(model.free_run, data.u, data.y)], data.output)


class Fails:
    """Stub of a polynomial fit that diverges."""

    def run(self, u: Array, _: Array) -> Array:
        return np.full(u.shape[0], np.nan)


def test_the_jackknife_gives_the_standard_error_of_a_mean() -> None:
    x = np.random.default_rng(0).normal(size=(5, 4000))  # five groups of one value each, 4000 times
    whole = x.mean(axis=0)
    parts = [(x.sum(axis=0) - one) / 4.0 for one in x[1:]]
    assert jackknife(whole, parts) == pytest.approx(1.0 / np.sqrt(5.0), rel=0.02)
    assert jackknife(whole, [*parts, np.full(4000, np.nan)]) == np.inf
    assert jackknife(whole, []) == np.inf


@pytest.mark.parametrize(
    ("apart", "linear_apart", "taken"),
    [(0.04, 0.0, "own"), (0.06, 0.0, "linear"), (0.06, 0.05, "own"), (0.5, 0.05, "linear")],
)
def test_the_linear_run_is_taken_if_its_expected_error_is_smaller(
    apart: float, linear_apart: float, taken: str
) -> None:
    # runs of a unit input that are off by `apart` on both sides have a variance of four times its square
    parts = tuple(gain(2.0 + sign * apart) for sign in (1, -1, 1, -1))
    straight = tuple(gain(1.0 + sign * linear_apart) for sign in (1, -1, 1, -1))
    one = Fallback(gain(1.0), straight, parts, 0.1)
    u, y, own = np.ones((9, 1)), np.full(9, np.nan), np.full(9, 2.0)
    assert one.errors(u, y, own) == pytest.approx((2.0 * apart, np.hypot(0.1, 2.0 * linear_apart)))
    assert np.array_equal(one.judged(u, y, own)[0], own if taken == "own" else np.ones(9))


def test_a_model_fitted_to_more_samples_has_a_smaller_uncertainty() -> None:
    parts = tuple(gain(2.0 + sign * 0.06) for sign in (1, -1, 1, -1))
    few = Fallback(gain(1.0), (gain(1.0),) * 4, parts, 0.1)
    u, y, own = np.ones((9, 1)), np.full(9, np.nan), np.full(9, 2.0)
    assert few.errors(u, y, own) == pytest.approx((0.12, 0.1))
    many = replace(few, share=0.25)  # the model has four times as many samples
    assert many.errors(u, y, own) == pytest.approx((0.06, 0.1))
    assert np.array_equal(few.judged(u, y, own)[0], np.ones(9))
    assert np.array_equal(many.judged(u, y, own)[0], own)


@pytest.mark.parametrize(("own_error", "apart", "taken"), [(0.05, 0.04, "own"), (0.05, 0.08, "linear")])
def test_the_held_back_error_of_a_nonlinearity_adds_to_its_uncertainty(
    own_error: float, apart: float, taken: str
) -> None:
    parts = tuple(bend(2.0 + sign * apart / 2.0) for sign in (1, -1, 1, -1))
    fallback = Fallback(gain(1.0), (gain(1.0),) * 4, parts, 0.085, own_error=own_error)
    whole = replace(bend(2.0), fallback=fallback)
    u, y = np.ones((9, 1)), np.full(9, np.nan)
    run, errors = whole.judged_run(u, y)
    assert errors == pytest.approx((np.hypot(own_error, apart), 0.085))
    assert run == pytest.approx(np.full(9, 2.0 if taken == "own" else 1.0))
    by = Scaling(np.zeros(1), np.ones(1), 0.0, 1.0)
    model = FreeRunModel(("u",), "y", 1.0, "hammerstein", by, whole)
    again = FreeRunModel.from_dict(json.loads(json.dumps(model.to_dict())))
    assert again.simulate(u) == pytest.approx(run)
    near = 1.0 + 1e-3 * np.arange(20.0)
    notes = linear_fallback_notes(again, [again.free_run(near, near)], "y")
    assert [note.code for note in notes] == ([] if taken == "own" else ["linear_stands_in"])
    assert all("--structure hammerstein" in str(note) for note in notes)
    # a model that was requested is run as it is
    assert replace(whole, fallback=None).run(u, y) == pytest.approx(np.full(9, 2.0))


def test_a_diverging_run_is_replaced_by_the_linear_one() -> None:
    away: Any = Fails()
    u, y = np.ones((9, 1)), np.full(9, np.nan)
    one = Fallback(gain(1.0), (gain(1.0),) * 4, (gain(2.0),) * 3 + (away,), 0.1)
    assert np.array_equal(one.judged(u, y, np.full(9, 2.0))[0], np.ones(9))
    sound = Fallback(gain(1.0), (gain(1.0),) * 4, (gain(2.0),) * 4, 0.1)
    assert np.array_equal(sound.judged(u, y, np.full(9, np.nan))[0], np.ones(9))


class Held:
    """Stub of a polynomial whose output follows a linear model up to its limits."""

    def __init__(self, linear: LinearDynamics) -> None:
        self.linear = linear

    def run(self, u: Array, y: Array) -> Array:
        return np.clip(self.linear.run(u, y), *ENDS)


ENDS = np.array([-1.2, 1.2])


@pytest.mark.parametrize(("decay", "level", "taken"), [(1e-9, 1.0, 0), (1e-9, 2.0, 1), (1e-9, 9.0, 1), (0.2, 9.0, 0)])
def test_an_integrating_output_beyond_the_limits_of_a_nonlinear_run_adds_to_its_error(
    decay: float, level: float, taken: int
) -> None:
    """All fits are clipped at the same limit and agree there; only an output that settles may be clipped."""
    linear = LinearDynamics(Form(1, (1,), (1,)), np.array([1.0, decay - 1.0, 0.0]))
    held: Any = Held(linear)
    one = Fallback(linear, (linear,) * 4, (held,) * 4, 0.1)
    u, y = np.r_[0.0, np.full(8, level / 7.0)][:, None], np.full(9, np.nan)
    straight, own = linear.run(u, y), held.run(u, y)
    integrates = decay < 0.1
    assert straight[-1] == pytest.approx(level if integrates else level / 7.0 * (1.0 - 0.8**7) / 0.2)
    run, (undetermined, left) = one.judged(u, y, own, ENDS)
    beyond = float(np.sqrt(np.mean((straight - own) ** 2))) if integrates else 0.0
    assert (undetermined, left) == pytest.approx((beyond, 0.1))
    assert np.array_equal(run, (own, straight)[taken])
    # a nonlinearity at the input has no such limits
    assert np.array_equal(one.judged(u, y, own)[0], own)


def squared(coefficient: float, end: float) -> PolynomialDynamics:
    """Return ``y = coefficient u[t - 1]^2``, with the input clipped in the square at the same value on both sides."""
    limits = np.array([[-9.0, 9.0], [-end, end]])
    variables = Variables(np.array([0, 1]), np.array([1, 1]), limits)
    return PolynomialDynamics(variables, np.array([[1, 1, -1]]), np.array([coefficient]))


@pytest.mark.parametrize(
    ("parts", "u", "wanted"),
    [
        # fits agree on the square, but not on its limit: a block that is left out contains the largest input
        ([(0.5, 1.0), (0.5, 0.8), (0.5, 1.0), (0.5, 0.8)], 1.5, 0.5 * 1.5**2),
        # farther out, they no longer agree
        ([(0.5, 1.0), (0.5, 0.8), (0.5, 1.0), (0.5, 0.8)], 3.0, 0.5),
        # they disagree on the square itself
        ([(0.4, 1.0), (0.6, 1.0), (0.4, 1.0), (0.6, 1.0)], 1.5, 0.5),
        # within the range, nothing is clipped
        ([(0.5, 1.0), (0.5, 0.8), (0.5, 1.0), (0.5, 0.8)], 0.7, 0.5 * 0.7**2),
    ],
)
def test_products_are_extrapolated_beyond_the_fitted_range_if_all_fits_agree(
    parts: list[tuple[float, float]], u: float, wanted: float
) -> None:
    linear = gain(0.2)
    fallback = Fallback(linear, (linear,) * 4, tuple(squared(*one) for one in parts), 1.0)
    whole = replace(squared(0.5, 1.0), fallback=fallback)
    run, errors = whole.judged_run(np.full((9, 1), u), np.full(9, wanted))
    assert run[1:] == pytest.approx(np.full(8, wanted))
    assert errors is not None
    assert errors[0] < errors[1]
    assert whole.variables.with_wider_clipping().limits[1] == pytest.approx([-2.0, 2.0])
    # a model that was requested has no other fits to decide this by
    asked = replace(whole, fallback=None).run(np.full((9, 1), u), np.full(9, wanted))
    assert asked[1:] == pytest.approx(np.full(8, 0.5 * min(u, 1.0) ** 2))


def answered(u: Array) -> Array:
    y = np.zeros(u.size)
    for t in range(1, u.size):
        # the current of a diode into a capacitor with a leak
        y[t] = y[t - 1] + 0.1 * min(np.exp(2.0 * (u[t - 1] - y[t - 1])) - 1.0, 4.0) - 0.05 * y[t - 1]
    return y


def log(u: Array) -> Channels:
    y = answered(u)
    return channels_from([u[:, None]], [y + 0.003 * np.random.default_rng(5).normal(size=u.size)], 1.0, ["u"], "y")


@pytest.fixture(scope="module")
def switched() -> tuple[Channels, Identified]:
    """Return a log with two levels of the input, and its model, which is not determined between the levels."""
    u = np.repeat(np.where(np.random.default_rng(4).random(N // 5) < 0.5, -1.0, 1.0), 5)
    data = log(u)
    return data, identify_channels(data, structure="auto", order=2, delay=1)


@pytest.fixture
def between() -> Channels:
    u = np.repeat(np.random.default_rng(6).uniform(-0.5, 0.5, N // 20), 20)
    return log(u)


def test_the_linear_model_runs_between_two_fitted_levels_if_the_nonlinear_fits_disagree(
    switched: tuple[Channels, Identified], between: Channels
) -> None:
    data, found = switched
    dynamics = found.model.dynamics
    assert isinstance(dynamics, PolynomialDynamics)
    assert dynamics.fallback is not None
    assert found.quality.fit_percent > 90.0
    assert notes_on_runs(found.model, data) == []
    spread = replace(
        dynamics.fallback, parts=tuple(_bent(one, 0.3 * k) for k, one in enumerate(dynamics.fallback.parts))
    )
    torn = replace(found.model, dynamics=replace(dynamics, fallback=spread))
    (note,) = notes_on_runs(torn, between)
    assert note.code == "linear_stands_in"
    assert note.data["undetermined"] > note.data["linear"]
    straight = replace(found.model, dynamics=dynamics.fallback.linear)
    assert np.array_equal(torn.simulate(between.u[0]), straight.simulate(between.u[0]))
    again = FreeRunModel.from_dict(torn.to_dict())
    assert np.array_equal(again.simulate(between.u[0]), straight.simulate(between.u[0]))


def _bent(one: Any, much: float) -> Any:
    """Return a fit with a changed constant."""
    coefficients = one.coefficients.copy()
    coefficients[np.flatnonzero((one.terms == -1).all(axis=1))] += much
    return replace(one, coefficients=coefficients)


def test_a_requested_polynomial_model_has_no_linear_fallback(between: Channels) -> None:
    found = identify_channels(between, structure="narx", order=1, delay=1).model
    assert isinstance(found.dynamics, PolynomialDynamics)
    assert found.dynamics.fallback is None
    assert notes_on_runs(found, between) == []
