"""Free runs of linear models on small logs, and how the models are chosen, kept in `numbers.json`."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run import (
    believable,
    choose_linear,
    dead_times,
    held_back,
    linear_comparison,
    linear_fit,
)
from estimation.identification.free_run.choose_linear import Candidate
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.least_squares import least_squares
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_kernel import decay_rows
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.other_structures import fit_other_structure
from estimation.identification.free_run.quality import _fit
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.search import criterion
from tests.estimation.identification.free_run.made_channels import NOISE, N, U, answer, channels
from tests.kernels import loops_in_python
from tests.numbers import Found, Numbers, Roughly, refused, some

NUMBERS = Numbers(__file__)


def data(inputs: int = 1, lost: bool = False, delay: int = 1) -> Channels:
    return scaled(channels(inputs, lost, delay))[0]


FORMS = {"one input": Form(2, (2,), (1,)), "late": Form(1, (3,), (2,)), "two inputs": Form(2, (1, 2), (1, 0))}


@NUMBERS.case()
def problems() -> dict[str, Any]:
    told: dict[str, Any] = {}
    with loops_in_python():
        rows = U[:50].T.copy()
        decay_rows(np.array([1.0, -1.4, 0.6]), rows, np.array([0.5, -0.2]))
        told["decayed"] = [some(one, 7) for one in rows]
        for name, form in FORMS.items():
            problem = Problem(form, data(len(form.sizes), lost=True))
            theta = 0.3 * np.cos(np.arange(problem.n_parameters))
            output, slopes = problem.jacobian(theta)
            f = np.array([1.0, -1.2, 0.5])[: form.order + 1]
            cost, values = problem.profiled(f)
            told[name] = {
                "sizes": [problem.n_parameters, form.n_b, form.n_values],
                "output": some(output, 7),
                "slopes": [some(one, 4) for one in slopes.T],
                "columns": [some(one, 3) for one in problem.linear_columns(f).T],
                "profiled": [cost, values],
                "rows": [some(one, 3) for one in linear_fit.columns_of(form, U[:, : len(form.sizes)]).T],
                "before": problem.first_columns(1),
                "quick": linear_fit.quick_fit(form, problem.data),
                "starts": linear_fit.steiglitz_mcbride(problem),
            }
    told["lagged beyond the log"] = linear_fit.columns_of(Form(1, (3,), (2,)), U[:3, :1])
    told["no inputs"] = list(linear_fit.columns_of(Form(1, (), ()), U[:3, :0]).shape)
    told["inside"] = [
        criterion.with_bounded_roots(np.poly(roots), 100, 0.95)
        for roots in ((0.9, 0.5), (0.97, 0.5), (1.3, 0.2), (-0.99, 0.1))
    ]
    told["longest pole"] = [linear_fit.record_length_pole(n) for n in (10, 1000)]
    told["least squares"] = [*least_squares(np.column_stack([U[:9], np.zeros(9)]), NOISE[:9])]
    return told


def told_of(found: LinearFit) -> dict[str, Any]:
    return {
        "values": [Found(float(one), 1e-3) for one in found.theta],
        "cost": Roughly(found.cost, 1e-6),
        "bounded": found.bounded,
        "parts": [one.size for one in found.numerators],
    }


def slow() -> Channels:
    """Return a log shorter than its plant's time constant."""
    y = np.zeros(N)
    for t in range(1, N):
        y[t] = 0.9995 * y[t - 1] + 0.01 * U[t - 1, 0]
    return channels_from([U[:, :1]], [y + 0.002 * NOISE], 0.1, ("a",), "y")


@NUMBERS.case()
def fits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, form in FORMS.items():
        told[name] = told_of(fit_linear(form, data(len(form.sizes), lost=True)))
    begun = [np.array([1.0, -0.5, 0.1]), np.array([1.0, -1.3, 0.5])]
    told["begun"] = told_of(fit_linear(FORMS["one input"], data(), begun))
    one = scaled(slow())[0]
    free, held = (fit_linear(Form(1, (1,), (1,)), one, bounded=bounded) for bounded in (False, True))
    told["slow"] = [told_of(free), told_of(held)]
    told["extended"] = linear_fit.extended_denominators(free)
    told["unsearched"] = [len(linear_fit._searched_denominators(Problem(FORMS["two inputs"], data(2))))]
    problem = Problem(FORMS["one input"], data(lost=True))
    start = np.concatenate([[0.1, 0.1, -1.0, 0.3], np.zeros(problem.n_parameters - 4)])
    told["descended"] = told_of(problem.descend(start))
    return told


def made(error: float, bic: float, doubt: str = "", late: int = 1, **changes: Any) -> Candidate:
    """Return an invented candidate."""
    form = changes.pop("form", Form(1, (1,), (late,)))
    fit = changes.pop("fit", LinearFit(form, np.array([0.5, -0.5, 0.0, 0.0]), 1.0))
    return Candidate(fit, bic, doubt, block_errors=(error,) * 4, bic=bic)


@NUMBERS.case(relative=1e-5)
def choices() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, given in {
        "of orders": (data(), [1, 2, 3, 4, 5], (1,)),
        "of dead times": (data(delay=4), [1, 2], None),
        "of two inputs": (data(2, lost=True), [1], None),
        "slow": (scaled(slow())[0], [1], (1,)),
    }.items():
        found = choose_linear.linear_candidates(*given)
        told[name] = [
            [one.form.order, list(one.form.sizes), list(one.form.delays), one.doubt, one.fit.bounded] for one in found
        ]
        told[f"{name}, errors"] = [
            [Found(one.held_back, 1e-3), Found(one.bic, 1.0), Found(one.aic, 1.0)] for one in found
        ]
        told[f"{name}, chosen"] = [
            choose_linear.chosen_linear(found).form.order,
            choose_linear.chosen_linear(found).price,
        ]
    told["sizes that are given"] = [one.form.sizes for one in choose_linear.linear_candidates(data(), [2], (1,), 3)]
    fit = fit_linear(FORMS["one input"], data(lost=True))
    told["blocks"] = list(held_back.held_back_blocks(fit, data(lost=True)))
    one = choose_linear.candidate(fit, data(lost=True))
    told["criteria"] = [one.bic, one.aic, one.held_back]
    late = fit_linear(Form(2, (2,), (2,)), data(lost=True))
    told["criteria of a dead time"] = choose_linear.candidate(late, data(lost=True)).bic
    exact = choose_linear.candidate(replace(late, cost=0.0), data(lost=True))
    told["criteria of what leaves nothing"] = [exact.bic, exact.aic]
    told["prices"] = [made(0.5, 0.0, late=k).price for k in (0, 1, 2)]
    told["delays"] = [dead_times.estimate_delays(data(delay=k), most) for k, most in ((0, 20), (3, 20), (3, 2), (1, 9))]
    told["delays of two inputs"] = dead_times.estimate_delays(data(2))
    told["forms"] = [
        [[form.sizes, form.delays] for form in choose_linear._forms(2, late, 1, size)]
        for late, size in (((0,), None), ((1,), None), ((3,), None), ((3,), 4))
    ]
    told["chosen"] = [
        choose_linear.chosen_linear(rows).bic
        for rows in (
            [made(1.0, 3.0), made(1.009, 2.0), made(1.011, 1.0)],
            [made(1.0, 3.0, late=2), made(1.02, 2.0), made(1.05, 1.0)],
            [made(1.0, 3.0), made(0.5, 1.0, "no_fit")],
            [made(1.0, 3.0, "no_fit"), made(0.5, 1.0, "no_fit")],
        )
    ]
    base = data()
    told["doubts"] = [
        choose_linear.doubt_of(LinearFit(Form(1, (1,), (1,)), np.array([0.5, -pole, 0.0, 0.0, 0.0]), cost), base)
        for pole, cost in (
            *((0.5, 1.0), (0.5, 290.0), (0.5, 270.0), (0.5, 0.0)),
            *((np.exp(-1.0 / 179.0), 1.0), (np.exp(-1.0 / 181.0), 1.0), (1.0, 1.0), (1.1, 1.0), (0.0, 1.0)),
        )
    ]
    told["doubts without poles"] = choose_linear.doubt_of(LinearFit(Form(0, (1,), (1,)), np.zeros(2), 1.0), base)
    told["pooled"] = [held_back.pooled_error(one) for one in ([3.0, 4.0, np.nan], [], [np.nan])]
    none = held_back.block_error(np.ones(3), np.zeros(3, dtype=bool))
    told["block errors"] = [held_back.block_error(np.array([3.0, 4.0, 9.0]), np.array([True, True, False])), none]
    return told


@NUMBERS.case()
def believed() -> dict[str, Any]:
    """Return which candidate is believed, on either side of each threshold."""
    base, by = scaled(channels())
    integrator = LinearFit(Form(1, (1,), (1,)), np.array([0.5, -0.9999, 0.0, 0.0, 0.0]), 1.0, integrates=True)
    beyond = LinearFit(Form(1, (1,), (1,)), np.array([0.5, -1.0, 0.0, 0.0, 0.0]), 1.0)
    held = replace(integrator, bounded=True, integrates=False)
    slow_one = partial(made, bic=0.0, doubt="time_constant")
    rows: dict[str, list[Candidate]] = {
        "integrates": [made(1.0, 0.0), slow_one(0.69, fit=integrator)],
        "does not": [made(1.0, 0.0), slow_one(0.71, fit=integrator)],
        "alone, well": [slow_one(0.49, fit=integrator)],
        "alone, badly": [slow_one(0.51, fit=integrator)],
        "alone, beyond": [slow_one(0.51, fit=beyond)],
        "beside one that is held": [slow_one(0.6, fit=integrator), made(0.65, 0.0, fit=held)],
        "passed over": [made(1.0, 0.0), slow_one(0.9), slow_one(0.95), slow_one(1.1)],
    }
    told: dict[str, Any] = {}
    for name, given in rows.items():
        best, notes = believable.believable_candidate(given, base, by)
        told[name] = [best.held_back, best.doubt, best.fit.bounded, [[str(one.code), dict(one.data)] for one in notes]]
    cancelled = fit_linear(Form(3, (3,), (1,)), base)
    clean = fit_linear(Form(2, (2,), (1,)), base)
    for name, error in (("as good", 1.019), ("not as good", 1.021)):
        given = [made(1.0, -9.0, fit=cancelled, form=cancelled.form), made(error, 0.0, fit=clean, form=clean.form)]
        best, notes = believable.believable_candidate(given, base, by)
        told[f"simpler, {name}"] = [best.form.order, [[str(one.code), dict(one.data)] for one in notes]]
    told["undetermined"] = [
        believable._is_undetermined(made(1.0, 0.0, fit=one), base, by) for one in (cancelled, clean)
    ]
    return told


@NUMBERS.case()
def fed_back() -> dict[str, Any]:
    """Return the models for which the input is tested for feedback of the output's noise."""
    told: dict[str, Any] = {}
    fed = U + np.column_stack([np.concatenate([[0.0], 3.0 * NOISE[:-1]])] * 2)
    for name, inputs in (("a line", 1), ("two inputs", 2)):
        body = LinearDynamics(Form(1, (1,) * inputs, (1,) * inputs), np.array([0.1] * inputs + [-0.5, 0.0]))
        logs = [slice(0, 60), slice(60, N)]
        one = channels_from([fed[log, :inputs] for log in logs], [NOISE[log] for log in logs], 0.1, "ab"[:inputs], "y")
        model = FreeRunModel(one.inputs, "y", 0.1, "", scaled(one)[1], body)
        told[name] = [dict(note.data) for note in linear_comparison.closed_loop_notes(model, one)]
    return told


@NUMBERS.case(relative=1e-5)
def models_in_units() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, one in (("whole", channels()), ("lost", channels(lost=True)), ("wanders", _wandering())):
        inside, by = scaled(one)
        fit = fit_linear(FORMS["one input"], inside)
        found = linear_model(fit, inside, by)
        told[name] = {
            "values": [Found(float(v), 1e-3) for v in (*found.free_numerator, *found.denominator)],
            "deviations": [np.sqrt(np.diag(c)) for c in (found.covariance, found.covariance_white)],
            "state": [Found(float(v), 1e-2) for v in found.initial_state],
            "fit": [found.fit_percent, found.rmse, found.residual_std, found.n_samples, found.offset],
        }
        model = FreeRunModel(one.inputs, one.output, 0.1, "output-error", by, LinearDynamics.of(fit), found)
        told[name] |= {
            "quality": [*vars(model.quality(one.u, one.y)).values()],
            "levels": [model.level, model.offset, model.n_values],
            "run": some(model.simulate(one.u[0], one.y[0]), 5),
            "run without outputs": some(model.simulate(one.u[0]), 5),
        }
    body = LinearDynamics.of(fit_linear(FORMS["two inputs"], data(2)))
    told["two inputs"] = [[Found(float(v), 1e-3) for v in b] for b, _ in body.transfer_functions()]
    few = np.where(np.arange(120) < 2, data().y[0], np.nan), np.where(np.arange(120) < 3, data().y[0], np.nan)
    told["of few outputs"] = [some(LinearDynamics.of(fit).run(data().u[0], y), 3) for y in few]
    measured = np.array([1.0, np.nan, 3.0, 5.0])
    rows = (([1.0, 2.0, 3.5, 4.0], True), ([1.0, 2.0, np.nan, 4.0], True), ([1.0, 2.0, np.nan, 4.0], False))
    told["fits"] = [_fit(measured, np.array(row), running=running) for row, running in rows]
    told["fit of a constant"] = _fit(np.ones(3), np.zeros(3), running=True)
    told["fit of nothing"] = _fit(np.full(3, np.nan), np.zeros(3), running=True)
    return told


def _wandering() -> Channels:
    y = answer(two=False) + 0.1 * np.cumsum(NOISE)
    return channels_from([U[:, :1]], [y], 0.1, ("a",), "y")


@NUMBERS.case()
def adopted() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = channels_from([U[:, :1]], [answer(two=False)], 0.1, ("a",), "y")
    by = scaled(one)[1]
    for name in ("arx", "armax", "box-jenkins", "instrumental", "subspace", "continuous"):
        body, model, held_back = fit_other_structure(name, FORMS["one input"], one, by)
        told[name] = [
            [Found(float(v), 1e-2) for v in body.theta],
            Found(model.offset, 1e-2),
            Found(held_back, 1e-2),
            [body.form.order, list(body.form.sizes), list(body.form.delays)],
        ]
    arx = partial(fit_other_structure, "arx", FORMS["one input"])
    told["two logs"] = Found(arx(channels(lost=True), by)[2], 1e-2)
    told["refused"] = [
        refused(lambda: arx(channels(2), by)),
        refused(lambda: fit_other_structure("subspace", FORMS["one input"], channels(), by)),
        refused(lambda: fit_other_structure("instrumental", FORMS["one input"], channels(lost=True), by)),
    ]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
