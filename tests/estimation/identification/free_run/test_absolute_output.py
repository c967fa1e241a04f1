"""If the sign of an output is not measured, the linear model before the absolute value is found."""

import json

import numpy as np
import pytest

from estimation.identification.free_run.absolute_dynamics import AbsoluteDynamics
from estimation.identification.free_run.absolute_output import AbsoluteProblem, lagged, signs_at_first
from estimation.identification.free_run.choose_absolute import may_lack_sign, relative_to_zero
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.arrays import Array
from plant.errors import LogWarning

F = np.array([1.0, -1.6, 0.8])
"""Denominator of a belt that rings."""


def logged(seed: int, n: int = 300, lag: float = 0.0) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.5, 1.5, n // 5), 5)
    speed = filtered(np.array([0.0, 0.2]), F, u)
    return u, lagged(np.abs(speed)[None, :].copy(), lag)[0] + 0.01 * rng.normal(size=n)


def channels(seed: int, lag: float = 0.0) -> Channels:
    u, y = logged(seed, lag=lag)
    return channels_from([u[:, None]], [y], 0.02, ["u"], "y")


@pytest.fixture(scope="module")
def found() -> Identified:
    with pytest.warns(LogWarning, match="without its sign"):
        return identify_channels(channels(0), structure="auto", order=2, delay=1)


def test_auto_finds_an_absolute_value_at_the_output(found: Identified) -> None:
    assert (found.model.structure, found.sound) == ("wiener", True)
    assert found.model.nonlinearity is not None
    assert found.model.nonlinearity["kind"] == "absolute-value"
    u, y = logged(1)
    left = found.model.simulate(u, y) - y
    assert left.std() < 0.1 * y.std()
    others = [one["held_back_percent"] for one in found.candidates if one["structure"] == "output-error"]
    assert max(others) < 50.0 < 90.0 < found.held_back_percent


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
@pytest.mark.parametrize(("shift", "told"), [(0.0, True), (1.0, False)])
def test_the_default_follows_an_output_whose_sign_is_missing(shift: float, told: bool) -> None:
    u, y = logged(0)
    found = identify_channels(channels_from([u[:, None]], [y + shift], 0.02, ["u"], "y"), order=2, delay=1)
    assert found.model.structure == ("wiener" if told else "output-error")
    assert (IdentificationCode.SIGN_NOT_MEASURED in [note.code for note in found.notes]) is told
    if told:
        assert found.sound
        assert found.held_back_percent > 90.0


def test_a_saved_model_simulates_the_same_output(found: Identified) -> None:
    again = FreeRunModel.from_dict(json.loads(json.dumps(found.model.to_dict())))
    u, y = logged(2)
    np.testing.assert_array_equal(again.simulate(u, y), found.model.simulate(u, y))
    # without outputs, a run begins at rest
    assert (again.simulate(u) - y)[50:].std() < 0.1 * y.std()


def test_a_lag_behind_the_absolute_value_is_found() -> None:
    model = identify_channels(channels(3, lag=0.5), structure="wiener", order=2, delay=1).model
    assert isinstance(model.dynamics, AbsoluteDynamics)
    assert model.dynamics.lag == pytest.approx(0.5, abs=0.03)
    assert model.nonlinearity is not None
    assert model.nonlinearity["lag_s"]["value"] == pytest.approx(0.02 / np.log(2.0), rel=0.1)
    np.testing.assert_allclose(model.dynamics.linear.f, F, atol=0.02)


def test_derivatives_are_exact_if_no_sample_changes_its_sign() -> None:
    data, by = scaled(channels(4))
    problem = AbsoluteProblem(Form(2, (1,), (1,)), relative_to_zero(data, by))
    theta = np.array([0.3, 0.5, *F[1:], 0.2, 0.4, -0.1])
    output, jacobian = problem.jacobian(theta)
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-6
        ahead, behind = (problem.jacobian(theta + side * step)[0] for side in (1.0, -1.0))
        np.testing.assert_allclose((ahead - behind) / 2e-6, jacobian[:, k], atol=2e-4 * np.abs(jacobian[:, k]).max())
    assert (output > 0.0).all()


def test_signs_are_estimated_from_the_square_of_the_output() -> None:
    data, by = scaled(channels(5))
    truth = np.sign(filtered(np.array([0.0, 0.2]), F, logged(5)[0]))
    agree = [abs(float(np.mean(one * truth))) for one in signs_at_first(relative_to_zero(data, by))[1:]]
    assert max(agree) > 0.8


@pytest.mark.parametrize(("shift", "sign", "may"), [(0.0, 1.0, True), (1.0, 1.0, False), (0.0, -1.0, False)])
def test_only_an_output_that_touches_zero_from_above_may_lack_its_sign(shift: float, sign: float, may: bool) -> None:
    u, y = logged(6)
    data, by = scaled(channels_from([u[:, None]], [sign * y + shift], 0.02, ["u"], "y"))
    assert may_lack_sign(data, by) is may
