"""If an output saturates or is held by stops, the linear model between its limits is found."""

import json
from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.limited_output import LimitedProblem, Limits, hold_between_stops, limits_of
from estimation.identification.free_run.linear_comparison import Task
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.arrays import Array
from plant.errors import LogWarning
from tests.thinned import thinned


def driven(seed: int, n: int = 600) -> tuple[Array, Array]:
    """Return an input in steps, and the output of a first-order plant with a gain of 2."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1.0, 1.0, n), rng.integers(5, 40, n))[:n]
    return u, filtered(np.array([0.0, 0.2]), np.array([1.0, -0.9]), u)


def cut_off(seed: int, high: float, *, after: float = 0.01) -> Channels:
    """Return a log whose output saturates, with noise before or after the saturation."""
    u, clean = driven(seed)
    rng = np.random.default_rng([seed, 1])
    y = np.clip(clean + (0.01 - after) * rng.normal(size=u.size), -np.inf, high) + after * rng.normal(size=u.size)
    return channels_from([u[:, None]], [y], 0.01, ["u"], "y")


def between_stops(seed: int, n: int = 600) -> tuple[Array, Array]:
    """Return an input in steps, and the output of an integrator that runs into stops, with noise."""
    u = driven(seed, n)[0]
    y = np.zeros(n)
    for t in range(1, n):
        y[t] = min(max(y[t - 1] + 0.08 * u[t - 1], -0.5), 0.5)
    return u, y + 0.005 * np.random.default_rng([seed, 2]).normal(size=n)


@pytest.mark.parametrize(("after", "order"), thinned([(0.0, 1), (0.01, None)], [(0.0, 1)]))
def test_the_gain_of_the_plant_is_found_from_an_output_that_is_cut_off(after: float, order: int | None) -> None:
    with pytest.warns(LogWarning, match="cut off at"):
        found = identify_channels(cut_off(0, 0.4, after=after), order=order, delay=1)
    assert found.sound
    assert found.model.linear is not None
    assert abs(found.model.linear.dc_gain - 2.0) < 3.0 * found.model.linear.dc_gain_std < 0.05
    assert found.held_back_percent > 95.0
    u, y = driven(5)
    # without outputs, a run begins at the steady state of its first input
    assert np.abs(found.model.simulate(u) - np.minimum(y, 0.4))[80:].max() < 0.05


@pytest.mark.parametrize(("every", "seed"), thinned([(3, 0), (5, 1), (10, 0)], [(3, 0)]))
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_limits_are_found_with_outputs_missing_at_regular_intervals(every: int, seed: int) -> None:
    data = cut_off(seed, 0.5)
    rows = np.arange(data.y[0].size) % every
    missing = rows == 2 if every == 3 else rows > 0
    found = identify_channels(replace(data, y=(np.where(missing, np.nan, data.y[0]),)), order=1, delay=1)
    assert IdentificationCode.OUTPUT_CUT_OFF in {note.code for note in found.notes}
    assert found.model.linear is not None
    assert abs(found.model.linear.dc_gain - 2.0) < 3.0 * found.model.linear.dc_gain_std < 0.2


def test_an_output_that_is_not_cut_off_has_no_limits() -> None:
    found = identify_channels(cut_off(0, np.inf), order=1, delay=1)
    assert not {IdentificationCode.OUTPUT_CUT_OFF, IdentificationCode.OUTPUT_STOPPED} & {n.code for n in found.notes}
    assert not isinstance(found.model.dynamics, LimitedDynamics)


def test_an_extreme_reached_in_one_block_only_is_noted_and_gives_no_limits() -> None:
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(-1.0, 1.0, 600), rng.integers(5, 40, 600))[:600]
    u *= np.where(np.arange(600) // 120 == 2, 1.0, 0.2)
    y = np.minimum(filtered(np.array([0.0, 0.2]), np.array([1.0, -0.9]), u), 0.5) + 0.01 * rng.normal(size=600)
    with pytest.warns(LogWarning, match="does not tell whether it is cut off"):
        found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=1)
    (said,) = (note for note in found.notes if note.code == IdentificationCode.OUTPUT_AT_END)
    assert float(said.data["limits"]) == pytest.approx(0.5, abs=0.01)
    assert not isinstance(found.model.dynamics, LimitedDynamics)


@pytest.mark.parametrize("seed", [0, 2])
def test_an_output_that_settles_at_the_level_of_its_input_has_no_limits(seed: int) -> None:
    """A plant that rises faster than it falls was reported as cut off (with a gain of 1.37 for 1) or held by stops."""
    rng = np.random.default_rng(seed)
    u, y = np.repeat(rng.integers(0, 2, 1500).astype(float), rng.integers(20, 120, 1500))[:1500], np.zeros(1500)
    for t in range(1, 1500):
        y[t] = y[t - 1] + (0.12 if u[t - 1] > y[t - 1] else 0.04) * (u[t - 1] - y[t - 1])
    y += 0.005 * rng.normal(size=1500)
    with pytest.warns(LogWarning, match="does not tell whether it is cut off"):
        found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=1)
    assert found.model.linear is not None
    assert found.model.linear.dc_gain == pytest.approx(1.0, abs=0.1)


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_the_stops_of_a_piston_driven_back_and_forth_are_found() -> None:
    """Its input has one value at each end, like the input of an output that has settled."""
    rng = np.random.default_rng(0)
    u, x, v = np.repeat(rng.choice([-1.0, 1.0], 1500), rng.integers(15, 90, 1500))[:1500], np.zeros(1500), 0.0
    for t in range(1, 1500):
        v = 0.7 * v + 0.009 * u[t - 1]
        x[t] = np.clip(x[t - 1] + v, -1.0, 1.0)
        v *= abs(x[t]) < 1.0
    y = x + 0.003 * rng.normal(size=1500)
    found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=1)
    assert IdentificationCode.OUTPUT_STOPPED in {note.code for note in found.notes}
    assert found.sound


def rubbing(seed: int, n: int = 300) -> Channels:
    """Return a motor's angle that dry friction, not a stop, holds at its turning points."""
    rng, v, x = np.random.default_rng(seed), 0.0, np.zeros(n)
    u = 2.0 * np.convolve(rng.normal(size=n + 40), np.ones(8) / 8.0, "same")[20 : 20 + n]
    for t in range(1, n):
        x[t] = x[t - 1]
        for _ in range(4):
            driven = v + 0.1 * (u[t - 1] - 0.5 * v)
            v = np.sign(driven) * max(abs(driven) - 0.03, 0.0)
            x[t] += 0.025 * v
    return channels_from([u[:, None]], [x + 0.002 * x.std() * rng.normal(size=n)], 0.01, ["u"], "x")


@pytest.mark.parametrize(("seed", "order"), thinned([(3, 1), (104, 4)], [(3, 1)]))
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_no_stops_are_reported_if_the_given_order_is_wrong(seed: int, order: int) -> None:
    """A linear model of another order explains more than stops do."""
    found = identify_channels(rubbing(seed), order=order, delay=1)
    assert IdentificationCode.OUTPUT_STOPPED not in {note.code for note in found.notes}


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_stops_that_are_better_on_blocks_but_not_on_the_whole_log_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    """On blocks, stops leave 0.20 of the deviation and the linear model 0.41, but stops leave more of the whole log."""
    monkeypatch.setattr(Task, "free", None)
    found = identify_channels(rubbing(0), order=4, delay=1)
    assert IdentificationCode.OUTPUT_STOPPED not in {note.code for note in found.notes}


@pytest.mark.slow
@pytest.mark.filterwarnings("error::plant.errors.LogWarning")
def test_the_extreme_levels_of_a_staircase_are_not_noted_as_possible_limits() -> None:
    """The levels between determine the gain; every log of steps had the warning."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.integers(-2, 3, 1500).astype(float), 60)[:1500]
    y = filtered(np.array([0.0, 0.1]), np.array([1.0, -0.9]), np.sign(u) * np.maximum(np.abs(u) - 0.2, 0.0))
    y += 0.01 * rng.normal(size=1500)
    found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), delay=1)
    assert IdentificationCode.OUTPUT_AT_END not in {note.code for note in found.notes}


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_a_model_with_stops_follows_an_integrating_output_that_leaves_them_at_once() -> None:
    u, y = between_stops(0)
    found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=1)
    codes = {note.code for note in found.notes}
    assert {IdentificationCode.OUTPUT_STOPPED, IdentificationCode.INTEGRATES} <= codes
    assert found.sound
    v, z = between_stops(1)
    run = found.model.simulate(v, np.where(np.arange(z.size) < 50, z, np.nan))
    assert np.sqrt(np.mean((run - z) ** 2)) < 0.1 * z.std()
    again = FreeRunModel.from_dict(json.loads(json.dumps(found.model.to_dict())))
    np.testing.assert_array_equal(again.simulate(v, z), found.model.simulate(v, z))
    assert found.model.nonlinearity is not None
    assert found.model.nonlinearity["kind"] == "stops"
    assert found.model.nonlinearity["high"]["value"] == pytest.approx(0.5, abs=0.005)


def test_an_output_between_stops_has_the_increments_of_the_free_series() -> None:
    free = np.array([0.0, 2.0, 3.0, 2.5, -4.0, -3.0])
    output, left = np.empty(6), np.empty(6, dtype=np.int64)
    hold_between_stops(free, -1.0, 1.0, output, left)
    assert output.tolist() == [0.0, 1.0, 1.0, 0.5, -1.0, 0.0]
    assert left.tolist() == [-1, 1, 2, 2, 4, 4]


@pytest.mark.parametrize("stops", [False, True])
def test_derivatives_of_a_limited_output_equal_numerical_ones(stops: bool) -> None:
    u, y = between_stops(3)
    data, _ = scaled(channels_from([u[:, None]], [y], 0.01, ["u"], "y"))
    problem = LimitedProblem(Form(2, (2,), (0,)), data, Limits(-1.1, 0.9, 0.01, stops))
    theta = np.array([0.05, 0.04, -1.5, 0.55, 0.1, 0.3, -0.1])
    output, jacobian = problem.jacobian(theta)
    assert 20 < np.count_nonzero((output == 0.9) | (output == -1.1)) < output.size - 20
    for k in range(theta.size):
        step = np.zeros(theta.size)
        step[k] = 1e-7
        ahead, behind = (problem.jacobian(theta + side * step)[0] for side in (1.0, -1.0))
        np.testing.assert_allclose((ahead - behind) / 2e-7, jacobian[:, k], atol=1e-4 * np.abs(jacobian).max())


def test_the_limit_is_the_level_at_which_the_output_stays() -> None:
    data, by = scaled(cut_off(1, 0.4))
    limits = limits_of(data)
    assert limits is not None
    assert by.y_mean + by.y_std * limits.high == pytest.approx(0.4, abs=0.005)
    assert Limits.from_dict(json.loads(json.dumps(limits.to_dict()))) == limits
