"""Models with friction at the output: dry friction holds the output, and simulated friction is recovered."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.factored_kernel import run_factored, slopes_of
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.output_friction import continued_fit, fit_with_friction
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_fit import Runs
from plant.errors import HydrostateError

FRICTION, STEP = 0.4, 0.02
"""Deceleration by friction [m/s^2], and seconds between samples [s]."""

NOISE = 0.005
"""Deviation of the sensor's noise [m/s]."""


def body(n: int, seed: int, friction: float = FRICTION) -> tuple[Array, Array]:
    """Return force over mass, and velocity of a body with true stiction, in a hundred steps for each sample."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.5, 1.5, n // 20 + 1), 20)[:n]
    y, v, fine = np.zeros(n), 0.0, STEP / 100.0
    for t, force in enumerate(u.tolist()):
        y[t] = v
        for _ in range(100):
            free = v + fine * (force - 0.8 * v)
            v = math.copysign(max(abs(free) - fine * friction, 0.0), free)
    return u, y + NOISE * rng.normal(size=n)


@cache
def log(n: int = 700, seed: int = 1, friction: float = FRICTION) -> Channels:
    u, y = body(n, seed, friction)
    return channels_from([u[:, None]], [y], STEP, ["force"], "speed")


@cache
def found(order: int | None = 1, delay: int | None = 1) -> Identified:
    return identify_channels(log(), structure="auto", order=order, delay=delay)


@pytest.mark.parametrize("way", [lambda loop: loop, lambda loop: loop.__wrapped__], ids=["compiled", "Python"])
@pytest.mark.parametrize("rub", [[0.1, 0.2], [0.1, 0.2, 0.05]], ids=["position", "velocity"])
def test_friction_reduces_each_change_by_its_level_and_holds_smaller_changes(
    way: Callable[[Any], Any], rub: list[float]
) -> None:
    u = np.random.default_rng(3).uniform(-1.0, 1.0, 80)
    # factors of 1 and of the previous output: the input's contribution, and 0.6
    share, none = np.column_stack([0.5 * np.roll(u, 1), np.full(80, 0.6)]), np.zeros(2, dtype=np.int64)
    given = share, none, none, np.array([1]), np.array([[-9.0, 9.0]]), np.array([-9.0, 9.0]), 1, np.array(rub)
    out, slope = np.zeros(80), np.zeros((80, 2))
    assert way(run_factored)(*given, out) == -1
    way(slopes_of)(*given, out, np.zeros((80, 2)), slope)
    seen: set[int] = set()
    for t in range(1, 80):
        free = 0.6 * out[t - 1] + 0.5 * u[t - 1]
        rest = rub[2] if len(rub) == 3 else out[t - 1]
        moved = free - rest
        side = 1 if moved > 0.2 else -1 if moved < -0.1 else 0
        assert out[t] == pytest.approx(rest if side == 0 else free - 0.2 if side == 1 else free + 0.1)
        assert slope[t].tolist() == ([0.6, side] if side else [float(len(rub) == 2), 0.0])
        seen.add(side)
    assert seen == {-1, 0, 1}


@pytest.mark.parametrize("friction", ["velocity", "position"])
def test_sensitivities_are_the_derivatives_of_a_run_that_sticks(friction: str) -> None:
    data, _ = scaled(log(200))
    fit = fit_with_friction(fit_linear(Form(2, (2,), (1,)), data), friction, data)
    assert fit is not None
    size = fit.theta.size - fit.variables.n_friction
    fit = replace(fit, theta=np.concatenate([fit.theta[:size], np.array([0.012, 0.01, 0.0])[: fit.friction.size]]))
    runs = Runs(fit.variables, fit.terms, data)
    equations = NormalEquations(runs, runs.ends)
    assert equations.outputs(fit.theta) is not None
    assert {*equations._slopes(0)[1][2:, -1].tolist()} == {-1.0, 0.0, 1.0}
    left = np.random.default_rng(4).normal(size=runs.target.size)
    gram, right = equations.sums(left)
    steps = 1e-8 * np.eye(fit.theta.size)
    ends = [[runs.outputs(fit.theta + sign * step) for step in steps] for sign in (1.0, -1.0)]
    jacobian = (np.array(ends[0]) - np.array(ends[1])).T[runs.used] / 2e-8
    size = np.sqrt(np.diag(gram))
    assert gram / np.outer(size, size) == pytest.approx(jacobian.T @ jacobian / np.outer(size, size), abs=1e-4)
    assert right / size == pytest.approx(jacobian.T @ left[runs.used] / size, abs=1e-3)


@pytest.mark.parametrize(
    "form", [pytest.param((1, 1), id="told"), pytest.param((None, None), marks=pytest.mark.slow, id="searched")]
)
def test_the_true_friction_is_found_and_its_free_run_leaves_little_more_than_noise(
    form: tuple[int | None, int | None],
) -> None:
    model = found(*form).model
    assert model.structure == "narx"
    said = model.nonlinearity
    assert said is not None
    assert said["kind"] == "velocity-friction"
    for side in ("below", "above"):
        assert said[side]["value"] == pytest.approx(FRICTION, rel=0.1)
    assert said["rest"]["value"] == pytest.approx(0.0, abs=0.02)
    u, y = body(700, 2)
    left = float(np.sqrt(np.mean((model.simulate(u, y) - y)[5:] ** 2)))
    assert left < 2.0 * NOISE
    assert {one.get("friction") for one in found(*form).candidates} >= {None, "velocity"}


def test_a_body_without_friction_gets_no_friction() -> None:
    plain = identify_channels(log(400, 1, 0.0), structure="auto", order=1, delay=1)
    assert plain.model.structure == "output-error"
    assert plain.model.nonlinearity is None
    assert not any("friction" in one for one in plain.candidates)


def test_a_friction_fit_continues_on_a_part_of_the_data() -> None:
    data, by = scaled(log())
    fit = fit_with_friction(fit_linear(Form(1, (1,), (1,)), data), "velocity", data)
    assert fit is not None
    masks = [np.arange(data.y[0].size) > 350]
    part = continued_fit(fit, data.without(masks))
    assert part is not None
    assert not np.array_equal(part.theta, fit.theta)
    assert part.friction[:2] * by.y_std / STEP == pytest.approx([FRICTION, FRICTION], rel=0.1)


def test_a_saved_model_with_friction_simulates_and_predicts_the_same_output() -> None:
    model = found().model
    u, y = body(300, 3)
    again = FreeRunModel.from_dict(model.to_dict())
    assert np.array_equal(again.simulate(u, y), model.simulate(u, y))
    assert np.array_equal(again.predict(u, y), model.predict(u, y), equal_nan=True)
    assert again.nonlinearity == model.nonlinearity
    values = model.to_dict()
    values["body"]["friction"]["values"] = [0.1]
    with pytest.raises(HydrostateError, match="friction of 3 values is needed, got 1"):
        FreeRunModel.from_dict(values)


@pytest.mark.parametrize("friction", ["velocity", "position"])
def test_one_step_predictions_along_a_run_with_friction_equal_the_run(friction: str) -> None:
    data, _ = scaled(log(200))
    fit = fit_with_friction(fit_linear(Form(2, (2,), (1,)), data), friction, data)
    assert fit is not None
    body = PolynomialDynamics.of(fit)
    u = data.u[0]
    run = body.run(u, data.y[0])
    assert body.one_step(u, run)[4:] == pytest.approx(run[4:], abs=1e-9)
