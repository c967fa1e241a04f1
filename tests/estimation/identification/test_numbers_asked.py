"""Effort of searches: the number of starts, steps and finalists, and tolerances, kept in `numbers_asked.json`.

These limits change no result of a small record, but they determine what a fit costs, and where it ends.
"""

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
import scipy.optimize

from estimation.identification.design import dead_time
from estimation.identification.fit import continuous, instrumental, output_error, prediction_error, profile_interval
from estimation.identification.fit.fitted import Task
from estimation.identification.free_run import (
    choose_hammerstein,
    dead_times,
    dense_polynomial,
    hammerstein_fit,
    identify,
    linear_comparison,
    linear_fit,
    linear_problem,
    polynomial_fit,
    polynomial_terms,
)
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.linear_problem import Form, LinearFit
from estimation.identification.free_run.normal_equations import NormalEquations
from estimation.identification.free_run.polynomial_fit import Runs
from estimation.identification.search import pole_search
from estimation.identification.search.criterion import Structure
from estimation.identification.search.experiments import Experiments, experiments_from
from estimation.identification.state_space import choose, fit
from estimation.identification.state_space import identify as identify_states
from estimation.identification.state_space.joint import Joint
from estimation.identification.state_space.problem import Problem, Size
from plant.arrays import Array
from tests.numbers import Numbers, Roughly
from tests.watched import watched

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(67)
N = 200
U: Array = np.repeat(RNG.choice([-1.0, 1.0], N // 4), 4)
FORM = Structure(2, 2, 1)


def answer() -> Array:
    y = np.zeros(N)
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.3 * U[t - 1] - 0.1 * U[t - 2]
    return y + 0.1 * np.random.default_rng(68).standard_normal(N)


def experiments() -> Experiments:
    return experiments_from(U, answer(), ("u", "y"), n_excited=4, n_wanted=20).scaled()


def channels() -> Channels:
    return scaled(channels_from([U[:, None]], [answer()], 0.1, ("a",), "y"))[0]


def options(
    *_: Any, tolerance: float, most_steps: int, slower: float = 3.0, least_gain: float = 0.0, within: Any = None
) -> list[float]:
    assert within is None or callable(within)
    return [tolerance, most_steps, slower, *([least_gain] if least_gain else [])]


@NUMBERS.case()
def output_error_fits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    costs = iter([3.0, 1.0, 1.0 + 0.9e-7, 1.0 + 1.1e-7, 2.0, 5.0, 6.0, *np.full(90, 9.0)])

    def ended(form: Structure, start: Array, data: Any, *_: Any) -> tuple[float, Array]:
        whole = np.zeros(form.n_main + form.n_initial * data.count)
        whole[: start.size] = start
        return next(costs), whole

    def said(_: Any, start: Array, data: Any, steps: int, tolerance: float = 0.0) -> list[Any]:
        return [start.size, data.u.size, steps, tolerance]

    begun = [np.full(4, 0.01 * k) for k in range(12)]
    with (
        watched(output_error, "starting_values", lambda *_: 0, lambda *_: begun),
        watched(output_error, "descend_from", said, ended) as asked,
    ):
        output_error.minimise(FORM, experiments())
    told["descents"] = asked
    n = 100_000
    long = Experiments(np.resize(U, n), np.resize(answer(), n), np.ones(n, dtype=bool), np.array([0, n]))
    with (
        watched(output_error, "starting_values", lambda *given: given[2], lambda *_: [np.zeros(4)]) as counts,
        watched(output_error, "descend_from", said, lambda *_: (1.0, np.zeros(6))) as asked,
    ):
        for part in (
            experiments(),
            long,
            experiments_from(np.resize(U, 9000), np.resize(answer(), 9000), ("u", "y"), n_excited=1, n_wanted=1),
        ):
            output_error.minimise(FORM, part)
    told["starts"], told["of long records"] = counts, asked
    with watched(pole_search, "refine_banded", lambda *given: [len(given[0]), given[6]]) as asked:
        pole_search.search_poles(Structure(2, 3, 1), pole_search.banded_spectra(experiments().bridged()), N)
    told["pole search"] = asked
    with watched(pole_search, "explained_power", lambda *given: list(given[0].shape)) as asked:
        pole_search.search_poles(Structure(2, 3, 1), pole_search.banded_spectra(experiments().bridged()), N)
    told["pole search, tried"] = asked
    with watched(dead_time, "descend_from", lambda *given: [given[0].delay, given[3]]) as asked:
        dead_time.estimate_delay(U, answer(), most=8)
    told["dead times"] = [len(asked), len({one for one, _ in asked}), sorted({steps for _, steps in asked})]
    return told


@NUMBERS.case()
def other_fits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    with watched(prediction_error, "levenberg", options) as asked:
        prediction_error.fit_armax(U, answer(), 0.1, n_numerator=2, n_denominator=2, n_c=1, delay=1)
    told["one step ahead"] = asked
    data = experiments_from(U, answer(), ("u", "y"), n_excited=4, n_wanted=20).scaled()
    task = Task(FORM, 0.1, "white", ("u", "y"))
    with watched(instrumental, "_pass", lambda *_: 0) as asked:
        instrumental._refined(task, np.array([1.0, -0.5, 0.1]), data)
    told["passes"] = len(asked)
    swinging = iter(np.tile([0.1, 0.2], 99))
    with watched(instrumental, "_pass", lambda *_: 0, lambda *_: np.full(FORM.n_parameters, next(swinging))) as asked:
        instrumental._refined(task, np.array([1.0, -0.5, 0.1]), data)
    told["passes at most"] = len(asked)
    problem = continuous._Problem(data, 0.1, 0, 2, 0.0)

    def least(*_: Any, **given: Any) -> dict[str, Any]:
        return {key: value for key, value in given.items() if key != "jac"}

    with (
        watched(scipy.optimize, "least_squares", least) as asked,
        watched(continuous, "descend_from", lambda *given: given[3]) as steps,
    ):
        problem.descend(problem.starts()[0])
    told["continuous"] = [asked, steps]
    model = output_error.fit_output_error(U, answer(), 0.1, n_numerator=2, n_denominator=2, delay=1)
    with (
        watched(profile_interval, "starting_values", lambda *given: given[2]) as starts,
        watched(profile_interval, "descend_from", lambda *given: given[3]) as steps,
        watched(profile_interval, "levenberg", options) as forced,
    ):
        profile_interval.dc_gain_interval(model, U, answer())
    told["intervals of the gain"] = [starts, steps, forced[0], Roughly(len(forced), 0.3)]
    return told


@NUMBERS.case()
def free_runs() -> dict[str, Any]:
    told: dict[str, Any] = {}
    form = Form(2, (2,), (1,))
    with watched(linear_problem, "levenberg", options) as asked:
        found = linear_fit.fit_linear(form, channels())
    told["linear"] = asked
    problem = linear_problem.Problem(form, channels())
    costs = [(1.0, 0), (1.0 + 0.9e-7, 1), (1.0 + 1.1e-7, 2), (2.0, 3), (3.0, 4)]
    given = iter(costs)
    with (
        watched(linear_problem.Problem, "profiled", lambda *_: 0, lambda *_: (next(given)[0], found.theta)),
        watched(linear_problem.Problem, "descend", lambda *_, **__: 0, lambda *_, **__: found) as descended,
    ):
        linear_fit.fit_linear(form, channels(), [found.f] * 5)
    told["linear, descended"] = len(descended)
    n = 50_001
    logs = [np.resize(U, n)[:, None]] * 2
    for name, size in (("searched", n - 1), ("not searched", n)):
        two = channels_from([one[:size] for one in logs], [np.resize(answer(), size)] * 2, 0.1, ("a",), "y")
        with watched(linear_fit, "descend_from", lambda *_: 0, lambda *_: (0.0, np.zeros(9))) as asked:
            linear_fit._searched_denominators(linear_problem.Problem(form, two))
        told[name] = len(asked)
    swinging = iter(np.tile([0.1, 0.2], 99))
    with watched(linear_fit, "least_squares", lambda *_: 0, lambda *_: (np.full(5, next(swinging)), 0.0)) as asked:
        linear_fit.steiglitz_mcbride(problem)
    told["passes at most"] = len(asked)
    creeping = iter(0.1 + np.cumsum([0.1, 0.1, 0.9e-6, 0.1, 0.1]))
    with watched(linear_fit, "least_squares", lambda *_: 0, lambda *_: (np.full(5, next(creeping)), 0.0)) as asked:
        linear_fit.steiglitz_mcbride(problem)
    told["passes that settle"] = len(asked)
    begun = polynomial_terms.polynomial_of_linear(found, channels())
    assert begun is not None
    with watched(polynomial_fit, "levenberg", options) as asked:
        polynomial_terms.polynomial_of_linear(found, channels())
        polynomial_terms.with_best_product(begun, polynomial_terms.candidate_terms(begun.variables), channels())
        polynomial_terms.without_term(begun, 1, channels())
        dense_polynomial.Recipe(Form(1, (1,), (1,)), 2, 1e-3, (0.1, 0.01)).fit(channels())
    told["polynomial"] = asked
    with (
        watched(hammerstein_fit, "levenberg", options) as asked,
        watched(hammerstein_fit, "fit_linear", lambda *given, **_: len(given[2])) as fits,
    ):
        hammerstein_fit.fit_hammerstein("dead-zone", Form(1, (1,), (1,)), channels(), [np.array([1.0, -0.8])])
    told["Hammerstein"] = [asked, fits]
    runs = Runs(begun.variables, begun.terms, channels())
    with watched(NormalEquations, "outputs", lambda *_: 0) as asked:
        runs.fit(begun.theta, 5)
    told["runs"] = len(asked)
    return told


@NUMBERS.case()
def choices() -> dict[str, Any]:
    told: dict[str, Any] = {}

    def stop(*_: Any, **__: Any) -> Any:
        raise StopIteration

    for name, structure, given in (
        ("orders", "output-error", {}),
        ("one order", "output-error", {"order": 2, "delay": 3, "n_numerator": 1}),
    ):
        whole = channels_from([U[:, None]], [answer()], 0.1, ("a",), "y")
        with watched(
            linear_comparison, "linear_candidates", lambda data, *rest: [data.n_samples, *rest], stop
        ) as asked:
            try:
                identify._identified(whole, structure, given.get("order"), given.get("delay"), given.get("n_numerator"))
            except StopIteration:
                told[name] = asked
    n = 900
    long = channels_from([np.resize(U, n)[:, None]], [np.resize(answer(), n)], 0.1, ("a",), "y")
    costs = iter([2.0, 1.0051, 1.0049, 1.0, *np.full(90, 3.0)])
    with watched(dead_times, "quick_fit", lambda form, _: form.delays, lambda *_: next(costs)) as asked:
        told["dead times"] = dead_times.estimate_delays(long)
    told["dead times tried"] = [len(asked), asked[-1]]
    base = Form(1, (1,), (1,))
    linear = [
        choose_hammerstein.Candidate(
            LinearFit(Form(k, (1,), (1,)), np.zeros(k + 2), 1.0), 0.0, "", block_errors=(1.0,), bic=0.0
        )
        for k in (1, 2, 3, 4, 5)
    ]
    with (
        watched(choose_hammerstein, "fit_hammerstein", lambda *given: given[1].order, lambda *_: None) as asked,
    ):
        choose_hammerstein.hammerstein_candidates(linear, channels())
    told["Hammerstein"] = asked
    ran = hammerstein_fit.fit_hammerstein("dead-zone", base, channels(), [np.array([1.0, -0.8])])
    with (
        watched(choose_hammerstein, "fit_hammerstein", lambda *_: 0, lambda *_: ran),
        watched(choose_hammerstein, "_held_back_errors", lambda *_: 0, lambda *_: 1.0) as judged,
    ):
        choose_hammerstein.hammerstein_candidates(linear, channels())
    told["Hammerstein, judged"] = len(judged)
    return told


def _charted(costs: Iterator[float], _: Any, theta: Array, *__: Any) -> tuple[float, Array]:
    return next(costs), theta


@NUMBERS.case()
def state_spaces() -> dict[str, Any]:
    told: dict[str, Any] = {}
    data = Joint(0.1, (U[:, None],), ((answer() / answer().std())[:, None],))
    size = Size(2, 1, 1, direct=False)
    with (
        watched(fit, "levenberg", options) as asked,
        watched(fit, "_descended", lambda *_: 0) as descended,
    ):
        fit.fit_state_space(size, data)
    told["levenberg"] = [asked[0], Roughly(len(asked), 0.5), len(descended)]
    problem = Problem(size, data)
    start = fit._starts(problem)[0]
    for name, costs in (("falls", [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3]), ("stands", [1.0, 1.0 - 0.9e-7, 0.5])):
        with watched(fit, "_minimum_near", lambda *_: 0, partial(_charted, iter(np.tile(costs, 9)))) as charts:
            fit._descended(problem, start, fit.THOROUGH_EFFORT)
        told[f"charts where it {name}"] = len(charts)
    one = channels()
    with watched(
        choose,
        "fit_state_space",
        lambda *given, **named: [vars(e) for e in (*given, *named.values()) if isinstance(e, fit.Effort)],
    ) as asked:
        choose.state_candidates([one], [1], 1)
    told["efforts"] = asked
    return told


@NUMBERS.case()
def threads() -> dict[str, Any]:
    """Return the number of threads for matrix products: more threads make small products slower."""
    told: dict[str, Any] = {}
    whole = channels_from([U[:, None]], [answer()], 0.1, ("a",), "y")
    for name, place, inner, call in (
        ("free runs", identify, "_identified", lambda: identify.identify_channels(whole)),
        ("state spaces", identify_states, "_identified_outputs", lambda: identify_states.identify_state_space([whole])),
    ):
        with (
            watched(place, "threadpool_limits", lambda **given: given) as asked,
            watched(place, inner, lambda *_: 0, _nothing),
        ):
            try:
                call()
            except StopIteration:
                told[name] = asked
    return told


def _nothing(*_: Any) -> Any:
    raise StopIteration


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
