"""Results of every filter, smoother and bank for one short log, kept in `numbers.json`.

The log lacks samples, has two outliers, and drives a nonlinear model against a bound, so that each branch of a method
is taken.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from estimation.engine.contract import FilterProblem, Trace
from estimation.filters.batch import filter_batch
from estimation.filters.imm import IMM_SETTINGS, bank_parameters, log_transitions
from estimation.filters.methods import METHODS
from estimation.filters.online import OnlineFilter
from estimation.filters.particle import PARTICLE_SETTINGS
from estimation.filters.relinearised import relinearised
from estimation.filters.run import filter_problem, in_si, run_filter
from estimation.filters.sif import SIF_SETTINGS
from estimation.filters.svsf import SVSF_SETTINGS
from estimation.filters.ukf import UKF_SETTINGS
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import FORMS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.functions import Scalar, sin
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters, EhaValues
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_names
from tests.estimation.filters.banks import Mode, run_imm
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = EhaParameters()
PLACES = [0, 7, 20, 33, 59]


def _step(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    """The step of a pendulum of unknown stiffness, pushed by the mean motor speed."""
    del p
    x, v, k = state
    return x + h * v, v + h * (0.5 * (speeds[0] + speeds[1]) - k * sin(x) - 0.4 * v * v), k


def _observe(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0] + 0.3 * state[0] * state[0], "velocity_m_s": state[1] * state[2] / 30.0}


CURVED = ProcessModel(
    "curved",
    (
        StateVariable("position_m", "m", 0.1, 1e-4, -0.6, 0.42),
        StateVariable("velocity_m_s", "m/s", 1.0, 2e-2),
        StateVariable("stiffness", "1/s^2", 30.0, 0.0, 1.0, 200.0, logarithmic=True),
    ),
    _step,
    _observe,
    5e-3,
    parameters=EhaParameters,
)
PRIOR = Gaussian(np.array([0.05, 0.1, 24.0]), np.diag([0.01, 0.04, 60.0]))
VARIANCES = {"position_m": 4e-4, "velocity_m_s": 1e-2}


@cache
def log() -> Record:
    rng = np.random.default_rng(11)
    time = 0.01 * np.arange(60)
    speed = 6.0 * np.sin(9.0 * time) + np.where(time > 0.3, 7.0, 0.0)
    x, v = 0.0, 0.0
    seen: list[tuple[float, float]] = []
    for push in speed:
        seen.append((x + 0.3 * x * x, v))
        x, v = x + 0.01 * v, v + 0.01 * (push - 30.0 * np.sin(x) - 0.4 * v * v)
    position, velocity = np.array(seen).T + np.array([[0.02], [0.1]]) * rng.standard_normal((2, 60))
    position[[14, 41]] += 0.2, -0.3
    position[[5, 6, 30]] = velocity[[6, 18]] = np.nan
    return Record(0.01, {"motor_speed_rad_s": speed, "position_m": position, "velocity_m_s": velocity}, start_time=3.0)


def task(robust: str = "none", **settings: float) -> FilterProblem:
    problem = filter_problem(CURVED, PRIOR, log(), PAPER, variances=VARIANCES)
    return replace(problem, keep_innovations=True, robust=robust, settings=settings)


def told(problem: FilterProblem, trace: Trace) -> dict[str, Any]:
    found = in_si(problem, trace, 3.0)
    assert found.belief is not None
    return {
        "mean": dict(zip((state.name for state in found.model.states), found.belief.mean, strict=True)),
        "deviation": np.sqrt(np.diag(found.belief.covariance)),
        "covariances": [found.belief.covariance[i, j] for i, j in ((0, 1), (0, 2), (1, 2))],
        "log-likelihood": found.log_likelihood,
        "NIS": dict(found.nis),
        "samples": trace.count,
        "track": {state.name: found.mean[PLACES, i] for i, state in enumerate(found.model.states)},
        "variance along it": {state.name: found.variance[PLACES, i] for i, state in enumerate(found.model.states)},
        "innovations": {name: found.residuals[PLACES, i] for i, name in enumerate(found.channels)},
        "their variances": {name: found.residual_variances[PLACES, i] for i, name in enumerate(found.channels)},
        "settled stiffness": list(found.settled("stiffness")),
        "time [s]": found.time[PLACES],
    }


TASKS: Mapping[str, tuple[str, FilterProblem]] = {
    **{method: (method, task()) for method in METHODS if method not in ("imm", "particle")},
    **{
        f"{method}, Huber": (method, task("huber"))
        for method in ("ekf", "iekf", "ukf", "smoother", "iterated-smoother")
    },
    **{f"{method}, Student": (method, task("student-t")) for method in ("ekf", "ckf", "iterated-smoother")},
    "ukf, spread otherwise": ("ukf", task(alpha=0.6, beta=1.0, kappa=1.0)),
    "svsf, narrow layer": ("svsf", task(gamma=0.3, boundary_layer=1.0)),
    "svsf, layer between": ("svsf", task(gamma=0.3, boundary_layer=4.0)),
    "sif, narrow layer": ("sif", task(boundary_layer=1.5)),
    "particle": ("particle", task(particles=300.0, seed=4.0)),
    "particle, no walk": ("particle", task(particles=300.0, walk=0.0)),
}


def _of(name: str) -> dict[str, Any]:
    method, problem = TASKS[name]
    return told(problem, METHODS[method](problem))


for _name in TASKS:
    NUMBERS.made[_name] = partial(_of, _name), 1e-6


@NUMBERS.case()
def bank_of_two_modes() -> dict[str, Any]:
    modes = [
        Mode(name, CURVED, PAPER, noise={"velocity_m_s": q, "position_m": 1e-4, "stiffness": 0.0})
        for name, q in (("calm", 1e-2), ("rough", 4.0))
    ]
    found = run_imm(
        modes,
        PRIOR,
        log(),
        dwell_time=(0.05, 0.12),
        probabilities=(0.7, 0.3),
        variances=VARIANCES,
        keep_innovations=True,
    )
    assert found.estimate.belief is not None
    return {
        "probability of calm": found.probability[PLACES, 0],
        "mean": found.estimate.belief.mean,
        "deviation": np.sqrt(np.diag(found.estimate.belief.covariance)),
        "log-likelihood": found.estimate.log_likelihood,
        "NIS": dict(found.estimate.nis),
        "track": [found.estimate.mean[PLACES, i] for i in range(3)],
        "innovations": [found.estimate.residuals[PLACES, i] for i in range(2)],
        "their variances": [found.estimate.residual_variances[PLACES, i] for i in range(2)],
        "logarithms of the transitions": log_transitions((0.05, 0.12, 0.4), 0.01),
    }


@cache
def actuator_log() -> Record:
    rng = np.random.default_rng(5)
    speed = make_drive("steps", 0.45, 1e-3, PAPER, rng)
    return simulate(LUMPED, speed, 1e-3, replace(PAPER, leakage_coefficient=2e-11), sensors=BENCH, rng=rng)


@NUMBERS.case()
def bank_of_the_nine_conditions() -> dict[str, Any]:
    model = FORMS["pressure"]
    prior = first_belief(model, actuator_log(), 2e8, 4e7)
    found = run_filter(METHODS["imm"], model, prior, actuator_log(), PAPER, settings={"dwell_time": 2.0})
    rows = bank_parameters(filter_problem(model, prior, actuator_log(), PAPER))
    assert found.belief is not None
    return {
        "modes": [dict(zip(parameter_names(EhaParameters)[5:10], row[5:10], strict=True)) for row in rows],
        "modes of a frictionless rig": len(
            bank_parameters(
                filter_problem(
                    model,
                    prior,
                    actuator_log(),
                    replace(PAPER, friction_quadratic=0.0, friction_linear=0.0, friction_coulomb=0.0),
                )
            )
        ),
        "mean": dict(zip((state.name for state in model.states), found.belief.mean, strict=True)),
        "deviation": dict(
            zip((state.name for state in model.states), np.sqrt(np.diag(found.belief.covariance)), strict=True)
        ),
        "log-likelihood": found.log_likelihood,
        "NIS": dict(found.nis),
        "usual dwell": run_filter(METHODS["imm"], model, prior, actuator_log(), PAPER).log_likelihood,
    }


ALLOWED = (-3.0, -2.9, -0.1, 0.0, 1e-9, 0.1, 0.99, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)


@NUMBERS.case()
def settings_that_are_allowed() -> dict[str, Any]:
    each = {
        "ukf": UKF_SETTINGS,
        "svsf": SVSF_SETTINGS,
        "sif": SIF_SETTINGS,
        "imm": IMM_SETTINGS,
        "particle": PARTICLE_SETTINGS,
    }
    told = {
        f"{method}, {one.name}": {"usual": one.default, "of three states": [x for x in ALLOWED if one.allows(x, 3)]}
        for method, settings in each.items()
        for one in settings
    }
    return told | {"log-likelihood of a usual ukf": METHODS["ukf"](task()).log_likelihood}


@NUMBERS.case()
def beliefs_begun_again() -> dict[str, Any]:
    problem = task()
    begun = METHODS["ekf"](problem)
    return {
        "once": told(problem, relinearised(problem, begun.mean, begun.covariance, 1)),
        "until the same": told(problem, relinearised(problem, begun.mean, begun.covariance)),
    }


@NUMBERS.case()
def many_at_once_and_a_stream() -> dict[str, Any]:
    problem = replace(task(), keep_innovations=False)
    problems = [replace(problem, mean=problem.mean * (1.0 + 0.1 * i)) for i in range(9)]
    traces = list(filter_batch(problems))
    stream = OnlineFilter(problem, "ukf")
    drives = problem.drives.copy()
    drives[30:33] = np.nan
    stream.take(drives[:25], problem.measured[:25])
    stream.take(drives[25:], problem.measured[25:])
    now = stream.now()
    return {
        "log-likelihoods": [trace.log_likelihood for trace in traces],
        "means": [trace.mean for trace in traces[::4]],
        "stream": {
            "values": now.values,
            "deviations": now.deviations,
            "NIS": now.nis,
            "log-likelihood": now.log_likelihood,
        },
    }


@NUMBERS.case()
def lengths_of_a_track() -> dict[str, Any]:
    long = Record(0.01, {name: np.tile(log()[name], 900) for name in log()})
    problem = filter_problem(CURVED, PRIOR, long, PAPER, variances=VARIANCES)
    trace = METHODS["smoother"](problem)
    return {
        "every so many samples": problem.every,
        "rows": len(trace.track),
        "smoothed": [trace.track[[0, 999, 20000], i] for i in range(3)],
        "its variances": [trace.track_variance[[0, 999, 20000], i] for i in range(3)],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
