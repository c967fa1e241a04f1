"""User equations are fitted by least squares, with intervals that cover and a gate that detects misfits."""

# ruff: noqa: ARG001 - every function is given the same three things

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from estimation.equations.definition import Equations, Parameter
from estimation.equations.fit import EquationsFit, fit_equations, simulated_outputs
from estimation.equations.problem import Problem, part_of
from estimation.finding import Outcome
from plant.errors import HydrostateError, LogError
from plant.log.record import Record

SAMPLES, SAMPLE_TIME = 600, 0.02
TIME = SAMPLE_TIME * np.arange(SAMPLES)
TORQUE = 0.6 * np.sign(np.sin(2.0 * TIME)) * np.cos(0.7 * TIME)
TRUTH = {"inertia": 0.2, "weight": 2.0, "damping": 0.05}


def pendulum(state: Any, inputs: Any, p: Any) -> Any:
    angle, speed = state
    return speed, (inputs.torque - p.damping * speed - p.weight * np.sin(angle)) / p.inertia


def model(derivative: Callable[..., Any] = pendulum, **changes: Any) -> Equations:
    parameters = {
        "inertia": Parameter(0.1, (0.01, 1.0)),
        "weight": Parameter(1.0, (0.1, 10.0)),
        "damping": Parameter(0.1, (0.0, 1.0)),
    }
    names = {"states": {"angle": "rad", "speed": "rad/s"}, "inputs": {"torque": "N m"}, "outputs": {"angle": "rad"}}
    return Equations(derivative, **{**names, "parameters": parameters, **changes})


@pytest.fixture(scope="module")
def swing() -> np.ndarray[Any, Any]:
    """Return the angle, integrated by SciPy."""

    def rates(t: float, x: Any) -> Any:
        torque = np.interp(t, TIME, TORQUE)
        return x[1], (torque - 0.05 * x[1] - 2.0 * np.sin(x[0])) / 0.2

    run = solve_ivp(rates, (0.0, TIME[-1]), [0.3, 0.0], t_eval=TIME, rtol=1e-9, atol=1e-10, max_step=SAMPLE_TIME)
    return run.y[0]


def logged(angle: Any, seed: int = 100, noise: float = 0.005) -> Record:
    channels = {"torque": TORQUE, "angle": angle + noise * np.random.default_rng(seed).standard_normal(SAMPLES)}
    return Record(SAMPLE_TIME, channels)


@pytest.fixture(scope="module")
def found(swing: Any) -> EquationsFit:
    return fit_equations(model(), [logged(swing)])


def test_intervals_contain_the_true_parameters(found: EquationsFit) -> None:
    assert found.finding.outcome is Outcome.OK
    assert found.finding.gate.passed
    assert all(found.finding.quantities[name].covers(truth) for name, truth in TRUTH.items())
    assert found.noise["angle"] == pytest.approx(0.005, rel=0.1)
    assert found.finding.quantities["initial angle"].covers(0.3)
    assert found.finding.quantities["initial angle"].unit == "rad"


def test_intervals_contain_the_truth_in_19_of_20_fits(swing: Any) -> None:
    fits = [fit_equations(model(), [logged(swing, seed)]) for seed in range(100, 120)]
    hits = [one.finding.quantities[name].covers(truth) for one in fits for name, truth in TRUTH.items()]
    assert 0.85 <= np.mean(hits) <= 1.0
    z = [
        (one.values[name] - truth) / (one.finding.quantities[name].std or 0.0)
        for one in fits
        for name, truth in TRUTH.items()
    ]
    assert 0.75 < np.std(z) < 1.25


def test_sensitivities_are_exact_for_both_schemes(swing: Any) -> None:
    for scheme in ("rk4", "ros2"):
        problem = Problem(model(), (part_of(model(), logged(swing)),), scheme, 2, np.array([0.005]))
        theta = problem.coordinates(np.array([0.15, 1.5, 0.1, 0.2, 0.1]))
        slopes = problem.slopes(theta)
        for j, step in enumerate(1e-5 * np.eye(5)):
            rise = (problem.residuals(theta + step)[0] - problem.residuals(theta - step)[0]).ravel() / 2e-5
            np.testing.assert_allclose(slopes[:, j], rise, atol=1e-5 * np.abs(rise).max())


def test_a_simulation_follows_the_exact_solution_of_the_differential_equation(swing: Any) -> None:
    run = simulated_outputs(model(), logged(swing), TRUTH, {"angle": 0.3, "speed": 0.0})
    np.testing.assert_allclose(run["angle"], swing, atol=1e-4)


def test_a_held_input_is_constant_between_samples() -> None:
    def growing(state: Any, inputs: Any, p: Any) -> Any:
        return inputs.rate * p.one

    names = {
        "states": {"x": "1"},
        "inputs": {"rate": "1"},
        "outputs": {"x": "1"},
        "parameters": {"one": Parameter(1.0)},
    }
    steps = Record(1.0, {"rate": np.array([0.0, 1.0, 3.0, 0.0])})
    held = simulated_outputs(Equations(growing, **names, held=("rate",)), steps, {}, {"x": 0.0})
    line = simulated_outputs(Equations(growing, **names), steps, {}, {"x": 0.0})
    np.testing.assert_allclose(held["x"], [0.0, 0.0, 1.0, 4.0])
    np.testing.assert_allclose(line["x"], [0.0, 0.5, 2.5, 4.0])


def test_several_logs_share_parameters_and_have_separate_initial_states(swing: Any) -> None:
    whole = logged(swing)
    fit = fit_equations(model(), [whole.slice(0, 300), whole.slice(300, 600)])
    assert {"initial angle of log 1", "initial angle of log 2"} <= fit.finding.quantities.keys()
    assert all(fit.finding.quantities[name].covers(truth) for name, truth in TRUTH.items())
    assert fit.finding.quantities["initial angle of log 2"].covers(swing[300])


def test_gaps_in_an_output_are_left_out_and_noted(swing: Any) -> None:
    log = logged(swing)
    gappy = log["angle"].copy()
    gappy[100:200] = np.nan
    fit = fit_equations(model(), [log.replace(angle=gappy)])
    assert all(fit.finding.quantities[name].covers(truth) for name, truth in TRUTH.items())
    assert "samples_missing" in {str(note.code) for note in fit.finding.notes}


def test_a_robust_fit_is_hardly_affected_by_outliers(swing: Any) -> None:
    log = logged(swing)
    spoilt = log["angle"].copy()
    spoilt[60:90] += 2.0
    sound, robust = (fit_equations(model(), [log.replace(angle=spoilt)], robust=one) for one in (False, True))
    wrong = {one: abs(one.values["damping"] - 0.05) for one in (sound, robust)}
    assert wrong[robust] < 0.2 * wrong[sound]
    assert robust.noise["angle"] == pytest.approx(0.005, rel=0.2)


def test_parameters_with_only_their_ratios_determined_have_no_value(swing: Any) -> None:
    def scaled(state: Any, inputs: Any, p: Any) -> Any:
        turned = p.gain * inputs.torque - p.damping * state.speed - p.weight * np.sin(state.angle)
        return state.speed, turned / p.inertia

    free = {**model().parameters, "gain": Parameter(1.0, (0.1, 10.0)), "idle": Parameter(1.0)}
    fit = fit_equations(model(scaled, parameters=free), [logged(swing)])
    assert [name for name in free if fit.finding.quantities[name].value is None] == list(free)
    assert fit.finding.quantities["initial angle"].covers(0.3)
    codes = {str(note.code) for note in fit.finding.not_told}
    assert codes == {"parameters_not_told", "parameter_not_felt"}
    assert fit.finding.outcome is Outcome.NOT_OBSERVABLE
    assert not np.isfinite(fit.covariance.condition)


def test_equations_of_another_plant_fail_the_gate(swing: Any) -> None:
    def linear(state: Any, inputs: Any, p: Any) -> Any:
        return state.speed, (inputs.torque - p.damping * state.speed - p.weight * state.angle) / p.inertia

    fit = fit_equations(model(linear), [logged(swing)])
    assert not fit.finding.gate.passed
    assert "misfit_correlated" in {str(note.code) for note in fit.finding.gate.reasons}


def test_residuals_are_judged_by_the_given_noise(swing: Any) -> None:
    fit = fit_equations(model(), [logged(swing)], noise={"angle": 0.002})
    assert {str(note.code) for note in fit.finding.gate.reasons} == {"misfit_beyond_noise"}


def test_a_log_of_noise_is_a_mismatch() -> None:
    fit = fit_equations(model(), [logged(np.zeros(SAMPLES), noise=1.0)])
    assert fit.finding.outcome is Outcome.MISMATCH


def test_a_parameter_at_its_bound_fails_the_gate(swing: Any) -> None:
    narrow = {**model().parameters, "weight": Parameter(1.0, (0.1, 1.5))}
    fit = fit_equations(model(parameters=narrow), [logged(swing)])
    assert "parameter_at_bound" in {str(note.code) for note in fit.finding.gate.reasons}


def test_an_end_stop_that_the_equations_lack_is_reported(swing: Any) -> None:
    stopped = logged(np.clip(swing, -0.25, 0.25), noise=0.002)
    fit = fit_equations(model(), [stopped])
    told = {
        note.data["end"]: note.data["value"]
        for note in fit.finding.gate.reasons
        if "channel" in note.data and "end" in note.data
    }
    assert told == {"least": pytest.approx(-0.25, abs=0.002), "largest": pytest.approx(0.25, abs=0.002)}


def test_a_stiff_model_is_stepped_implicitly() -> None:
    def lag(state: Any, inputs: Any, p: Any) -> Any:
        return -p.rate * (state.x - inputs.u), 1e5 * (state.x - state.fast)

    names = {"states": {"x": "1", "fast": "1"}, "inputs": {"u": "1"}, "outputs": {"fast": "1"}}
    stiff = Equations(lag, **names, parameters={"rate": Parameter(1.0, (0.1, 100.0))})
    u = np.sign(np.sin(3.0 * TIME))
    log = Record(SAMPLE_TIME, {"u": u})
    fast = simulated_outputs(stiff, log, {"rate": 5.0}, {"x": 0.0, "fast": 0.0})["fast"]
    fit = fit_equations(stiff, [log.replace(fast=fast + 0.01 * np.random.default_rng(2).standard_normal(SAMPLES))])
    assert fit.solution.problem.scheme == "ros2"
    assert fit.finding.quantities["rate"].covers(5.0)


def test_parameters_are_found_from_a_distant_start(swing: Any) -> None:
    far = {
        "inertia": Parameter(2.0, (1e-4, 100.0)),
        "weight": Parameter(2.0, (0.01, 1e3)),
        "damping": Parameter(0.05, (0.0, 10.0)),
    }
    fit = fit_equations(model(parameters=far), [logged(swing)])
    assert all(fit.finding.quantities[name].covers(truth) for name, truth in TRUTH.items())


def test_a_free_run_on_another_log_begins_at_the_initial_state_of_that_log(found: EquationsFit, swing: Any) -> None:
    later = logged(swing, seed=9).slice(200, 500)
    np.testing.assert_allclose(found.predicted(later)["angle"], swing[200:500], atol=0.01)
    bare = later.replace(angle=None)
    begun = found.predicted(logged(swing).replace(angle=None), {"angle": 0.3, "speed": 0.0})
    np.testing.assert_allclose(begun["angle"], swing, atol=0.02)
    assert abs(found.predicted(bare)["angle"][0]) < 1e-12


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda log: log.replace(torque=None), "channel 'torque' is needed; the log has angle"),
        (lambda log: log.replace(torque=np.where(np.arange(SAMPLES) == 5, np.nan, TORQUE)), "the first at 0.1 s"),
        (
            lambda log: log.replace(angle=np.full(SAMPLES, np.nan)),
            "output 'angle' must have two samples or more, got 0",
        ),
        (lambda log: log.replace(angle=np.full(SAMPLES, np.inf)), "output 'angle' must be finite or missing"),
        (lambda log: log.slice(0, 4), "more samples than unknowns are needed, got 4 for 5"),
    ],
)
def test_a_log_that_cannot_be_used_is_refused(swing: Any, spoil: Callable[[Record], Record], said: str) -> None:
    with pytest.raises(LogError, match=said):
        fit_equations(model(), [spoil(logged(swing))])


def test_equations_that_diverge_are_refused() -> None:
    def exploding(state: Any, inputs: Any, p: Any) -> Any:
        return p.rate * np.sqrt(-1.0 - state.angle**2), state.angle

    bursting = model(exploding, parameters={"rate": Parameter(1e3)})
    with pytest.raises(HydrostateError, match="run away"):
        fit_equations(bursting, [logged(np.sin(TIME))])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"noise": {"speed": 1.0}}, "noise names 'speed', which is none of the outputs angle"),
        ({"noise": {"angle": 0.0}}, "must be a positive standard deviation, got 0.0"),
        ({"starts": 0}, "starts must be a whole number from 1 on, got 0"),
    ],
)
def test_invalid_options_are_refused(swing: Any, options: Any, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        fit_equations(model(), [logged(swing)], **options)


def test_a_simulation_refuses_unknown_names(swing: Any) -> None:
    with pytest.raises(HydrostateError, match="initial names 'velocity'"):
        simulated_outputs(model(), logged(swing), {}, {"velocity": 1.0})
    with pytest.raises(HydrostateError, match="values names 'mass'"):
        simulated_outputs(model(), logged(swing), {"mass": 1.0}, {})


def test_a_log_too_short_for_residual_tests_is_still_fitted(swing: Any) -> None:
    whole = logged(swing)
    short = Record(SAMPLE_TIME, {name: whole[name][:20] for name in ("torque", "angle")})
    values = fit_equations(model(), [whole, short]).values
    assert {name: round(value, 1) for name, value in values.items()} == pytest.approx(TRUTH, abs=0.06)
