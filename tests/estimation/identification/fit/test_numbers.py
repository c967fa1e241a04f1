"""Fits of every structure to small records, kept in `numbers.json`."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.fit import continuous, covariances, instrumental, output_error, profile_interval
from estimation.identification.fit.arx import fit_arx
from estimation.identification.fit.continuous import fit_continuous
from estimation.identification.fit.fitted import Task, _require_effect, quality
from estimation.identification.fit.instrumental import fit_instrumental
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.fit.prediction_error import _acceptable, _starts, fit_armax, fit_box_jenkins
from estimation.identification.fit.profile_interval import dc_gain_interval
from estimation.identification.fit.residual_tests import ResidualTest
from estimation.identification.fit.subspace import fit_subspace
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.experiments import Experiments, experiments_from
from plant.arrays import Array
from tests.numbers import Found, Numbers, refused, some, warned

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(23)
N = 400
U: Array = 3.0 * np.repeat(RNG.choice([-1.0, 1.0], N // 5), 5) + 0.5
NOISE: Array = RNG.standard_normal(N)
FORM = {"n_numerator": 2, "n_denominator": 2, "delay": 1}


def answer(noise: float = 0.1, colour: float = 0.0) -> Array:
    y, e = np.zeros(N), NOISE.copy()
    for t in range(1, N):
        e[t] += colour * e[t - 1]
    for t in range(2, N):
        y[t] = 1.5 * y[t - 1] - 0.7 * y[t - 2] + 0.3 * U[t - 1] - 0.1 * U[t - 2]
    return y + noise * e


@cache
def records() -> dict[str, tuple[Any, Any]]:
    lost = np.where(np.arange(N) % 11 == 4, np.nan, answer())
    return {
        "white": (U, answer()),
        "coloured": (U, answer(0.1, 0.9)),
        "lost": (U, lost),
        "two": ([U[:150], U[150:]], [lost[:150], answer()[150:]]),
        "first longer": ([U[:260], U[260:]], [answer()[:260], answer()[260:]]),
    }


def told_of(model: LinearModel) -> dict[str, Any]:
    values = np.concatenate([model.free_numerator, model.denominator[1:]])
    with np.errstate(invalid="ignore"):
        spread = np.sqrt(np.diag(model.covariance_white))
        robust = np.sqrt(np.diag(model.covariance_robust))
    used = "robust" if np.array_equal(model.covariance, model.covariance_robust, equal_nan=True) else "white"
    size = np.linalg.norm(spread) if np.isfinite(spread).all() else 1e-3
    return {
        "values": [Found(*pair) for pair in zip(values, np.where(np.isfinite(spread), spread, 1e-3), strict=True)],
        "robust deviations": [Found(one, one) for one in robust],
        "covariance": used,
        "noise model": [Found(one, size) for one in (*model.noise_numerator, *model.noise_denominator)],
        "state": [Found(one, 0.1) for one in model.initial_state],
        "fit": Found(model.fit_percent, 1e-2),
        "errors": [Found(one, 1e-4) for one in (model.rmse, model.residual_std, model.one_step_rmse)],
        "sizes": [model.n_samples, model.delay, model.structure],
        "hash": model.data_hash,
        "dead time": [Found(model.dead_time, 1e-4), Found(model.dead_time_std, 1e-4)],
    }


FITS: dict[str, Callable[..., LinearModel]] = {
    "output error": partial(fit_output_error, **FORM),
    "at rest": partial(fit_output_error, **FORM, estimate_initial_state=False),
    "ARX": partial(fit_arx, **FORM),
    "ARMAX": partial(fit_armax, **FORM, n_c=1),
    "Box-Jenkins": partial(fit_box_jenkins, **FORM, n_c=1, n_d=1),
    "no noise model": partial(fit_box_jenkins, **FORM, n_c=0, n_d=0),
    "SRIV": partial(fit_instrumental, **FORM),
    "RIV": partial(fit_instrumental, **FORM, n_c=1, n_d=1),
}


@NUMBERS.case()
def fits_of_every_structure() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for kind, fit in FITS.items():
        for name, (u, y) in records().items():
            if name in ("lost", "two") and "IV" in kind:
                told[f"{kind}, {name}"] = refused(partial(fit, u, y, 0.01))
            else:
                told[f"{kind}, {name}"] = told_of(fit(u, y, 0.01, covariance="auto"))
    u, y = records()["coloured"]
    told["coloured is asked"] = told_of(fit_output_error(u, y, 0.01, **FORM, covariance="coloured"))["covariance"]
    for probability in (0.9e-3, 1.1e-3, 1.9e-3):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(covariances, "ljung_box", lambda _, n_lags, p=probability: ResidualTest(1.0, n_lags, p))
            model = fit_output_error(u, y, 0.01, **FORM, covariance="auto")
        told[f"coloured with a probability of {probability:g}"] = told_of(model)["covariance"]
    told["white is asked"] = told_of(fit_output_error(u, y, 0.01, **FORM))["covariance"]
    return told


@NUMBERS.case()
def subspaces() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for order in (None, 1, 2, 9):
        found = fit_subspace(U, answer(), 0.01, order=order)
        told[f"order {order}"] = {
            "values": [found.model.numerator, found.model.denominator],
            "state": found.model.initial_state,
            "singular values": [found.singular_values, found.noise_floor],
            "fit": [found.model.fit_percent, found.model.residual_std],
        }
    told["refused"] = [
        refused(lambda: fit_subspace(U, records()["lost"][1], 0.01)),
        refused(lambda: fit_subspace(U, NOISE, 0.01)),
        refused(lambda: fit_subspace(U, answer(), 0.01, order=0)),
        refused(lambda: fit_subspace(U[:179], answer()[:179], 0.01, order=1)),
        refused(lambda: fit_subspace(U[:180], answer()[:180], 0.01, order=1)),
    ]
    return told


def second_order(late: float = 0.0) -> Array:
    """Return noisy samples of 5 / (s^2 + 4 s + 25) with a held input and a dead time."""
    model = LinearModel([5.0], [1.0, 4.0, 25.0], 0.05, "u", "y", continuous=True, dead_time=late)
    return model.simulate(U) + 0.01 * NOISE


@NUMBERS.case()
def continuous_time() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, late, given in (
        ("no dead time", 0.0, 0.0),
        ("known", 0.12, 0.12),
        ("estimated", 0.12, None),
        ("long", 0.33, None),
    ):
        found = fit_continuous(U, second_order(late), 0.05, n_zeros=0, n_poles=2, dead_time=given)
        told[name] = told_of(found)
    u, y = [U[:150], U[150:]], [second_order()[:150], np.where(np.arange(250) < 9, np.nan, second_order()[150:])]
    told["zeros, two logs"] = told_of(fit_continuous(u, y, 0.05, n_zeros=1, n_poles=2))
    told["as many zeros"] = told_of(fit_continuous(U, 2.0 * U + second_order(), 0.05, n_zeros=2, n_poles=2))
    for zeros, poles in ((0, 0), (-1, 1), (2, 1), (1, 1)):
        told[f"{zeros} zeros, {poles} poles"] = refused(
            partial(fit_continuous, U, second_order(), 0.05, n_zeros=zeros, n_poles=poles)
        )
    for n in (29, 30):
        told[f"{n} samples"] = refused(
            partial(fit_continuous, U[20 : 20 + n], second_order()[20 : 20 + n], 0.05, n_zeros=0, n_poles=2)
        )
    return told


@NUMBERS.case()
def parts_of_continuous_fits() -> dict[str, Any]:
    data = experiments_from(U, second_order(0.12), ("u", "y"), n_excited=4, n_wanted=30).scaled()
    free = continuous._Problem(data, 0.05, 1, 2, None)
    held = continuous._Problem(data, 0.05, 1, 2, 0.12)
    values = np.array([0.01, 0.012, 0.2, 0.06])
    told: dict[str, Any] = {}
    quick = np.array([1e-5, 1e-4, 0.02, 1e-4])
    late = np.array([*values, 2.4])
    for name, problem, theta in (("free", free, late), ("held", held, values), ("sampled quickly", held, quick)):
        jacobian, residual = problem.parts(theta)
        told[name] = {
            "discrete": [*problem.discrete(theta)],
            "residual": some(residual, 7),
            "slopes": [some(column, 7) for column in jacobian.T],
            "starts": [[round(float(one), 6) for one in start] for start in problem.starts()],
        }
        told[f"{name}, descended"] = problem.descend(theta)[0]
    told["dead time below nothing"] = [*free.discrete(np.array([*values, -1.0]))]
    theta = np.array([0.1, 0.05, -0.3, -0.4])
    form = Structure(2, 2, 3)
    told["from discrete"] = [
        free._from_discrete(form, theta, 2.0),
        held._from_discrete(form, np.array([0.1, 0.05, 0.6, 0.05]), 2.0),
        held._from_discrete(form, np.array([0.1, 0.05, -1.2, 0.8]), 2.0),
    ]
    return told


@NUMBERS.case()
def parts_of_output_error() -> dict[str, Any]:
    told: dict[str, Any] = {}
    u, y = records()["two"]
    data = experiments_from(u, y, ("u", "y"), n_excited=4, n_wanted=20).scaled()
    form = Structure(2, 2, 1)
    theta = np.array([0.3, -0.1, -1.4, 0.6, 0.1, 0.2, 0.3, -0.1])
    jacobian, residual = output_error.jacobian_and_residual(form, theta, data)
    told["residual"] = some(residual, 9)
    told["slopes"] = [some(column, 5) for column in jacobian.T]
    told["one order less"] = output_error._one_order_less(form, data)
    told["none of one log"] = output_error._one_order_less(
        form, experiments_from(U, answer(), ("u", "y"), n_excited=4, n_wanted=20)
    )
    told["none of first order"] = [
        output_error._one_order_less(one, data) for one in (Structure(1, 2, 1), Structure(2, 1, 1))
    ]
    n = 2 * output_error.SCREENING_SAMPLES
    size = np.where(np.arange(n) >= n // 2, 2.0, 1.0)
    long = Experiments(size * np.resize(U, n), np.resize(answer(), n), np.arange(n) % 50 != 1, np.array([0, n]))
    part = output_error.liveliest_section(long)
    told["liveliest"] = [part.u.size, part.u[0], part.n_used, part.bounds]
    short = Experiments(long.u[: n - 1], long.y[: n - 1], long.used[: n - 1], np.array([0, n - 1]))
    told["none is cut"] = output_error.liveliest_section(short).u.size
    both = Experiments(long.u, long.y, long.used, np.array([0, 100, n]))
    told["several are kept whole"] = output_error.liveliest_section(both).u.size
    hidden = Experiments(long.u, long.y, long.used & ((np.arange(n) < n // 2) | (np.arange(n) % 9 == 0)), long.bounds)
    told["lively but missing"] = [output_error.liveliest_section(hidden).u[0]]
    return told


@NUMBERS.case()
def parts_of_prediction_errors() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for tied, task in (
        (True, Task(Structure(2, 2, 1), 0.01, "white", ("u", "y"), 1)),
        (False, Task(Structure(2, 2, 1), 0.01, "white", ("u", "y"), 1, 1)),
        (False, Task(Structure(2, 2, 1), 0.01, "white", ("u", "y"))),
    ):
        data = task.experiments(*records()["two"])
        begun = _starts(task, tied, data)
        told[f"{task.n_c}, {task.n_d}"] = [[Found(float(one), 1e-2) for one in start] for start in begun]
        for name, c, f in (("stable", 0.5, 0.7), ("C is not", 1.5, 0.7), ("F is not", 0.5, 1.7)):
            noise = [c, 0.1][: task.n_c + task.n_d]
            theta = np.array([0.1, 0.1, -0.1, f, *noise, *np.zeros(4)])
            told[f"{task.n_c}, {task.n_d}, {name}"] = _acceptable(task, tied, theta)
    return told


@NUMBERS.case()
def passes_of_instruments() -> dict[str, Any]:
    u, y = records()["first longer"]
    data = experiments_from(u, y, ("u", "y"), n_excited=4, n_wanted=20).scaled()
    task = Task(Structure(2, 2, 1), 1.0, "white", ("u", "y"))
    values = np.array([0.2, 0.1, -1.3, 0.6, 0.3, -0.1, 0.2, 0.1])
    one, with_offset = np.ones(1), replace(task, estimate_offset=True)
    told: dict[str, Any] = {
        "a pass": instrumental._pass(task, values, data, one, one),
        "a weighted pass": instrumental._pass(task, values, data, np.array([1.0, 0.4]), np.array([1.0, -0.5])),
        "a pass with an offset": instrumental._pass(with_offset, np.append(values, 0.1), data, one, one),
        "initial states": instrumental._with_denominator(task, np.array([1.0, -1.3, 0.6]), data),
        "initial states and offset": instrumental._with_denominator(with_offset, np.array([1.0, -1.3, 0.6]), data),
    }
    for n_c, n_d, offset in ((0, 0, False), (1, 1, False), (0, 0, True)):
        one_task = replace(task, n_c=n_c, n_d=n_d, estimate_offset=offset)
        theta, noise, jacobian, residual = instrumental._refined(one_task, np.array([1.0, -1.0, 0.3]), data)
        told[f"refined, {n_c}" + ", with an offset" * offset] = [
            [Found(float(one), 1e-3) for one in theta],
            [Found(float(one), 1e-3) for one in np.concatenate(noise)],
            Found(float(residual @ residual), 1e-2),
            Found(float(np.linalg.norm(jacobian)), 1e-1),
        ]
    return told


@NUMBERS.case()
def what_fits_say() -> dict[str, Any]:
    told: dict[str, Any] = {}
    u, y = U, answer()
    for name, sizes in {
        "no numerator": {"n_numerator": 0, "n_denominator": 2},
        "no denominator": {"n_numerator": 2, "n_denominator": 0},
        "a delay below nothing": {"n_numerator": 2, "n_denominator": 2, "delay": -1},
        "one of each": {"n_numerator": 1, "n_denominator": 1, "delay": 1},
    }.items():
        told[name] = refused(partial(fit_output_error, u, y, 0.01, **sizes))
    told["C below nothing"] = refused(lambda: fit_box_jenkins(u, y, 0.01, **FORM, n_c=-1, n_d=0))
    told["D below nothing"] = refused(lambda: fit_box_jenkins(u, y, 0.01, **FORM, n_c=0, n_d=-1))
    for n in (29, 30):
        told[f"{n} samples"] = refused(partial(fit_output_error, u[:n], y[:n], 0.01, **FORM))
    told["with C and D"] = [refused(partial(fit_armax, u[:n], y[:n], 0.01, **FORM, n_c=2)) for n in (39, 40)]
    told["noise"] = refused(lambda: fit_output_error(u, NOISE, 0.01, **FORM))
    for power, n, p in ((1.09, 100, 2), (1.10, 100, 2), (1.0, 100, 0), (1.5, 20, 3)):
        told[f"{power:g} of {n} by {p}"] = refused(partial(_require_effect, 1.0, power, n, p, ("u", "y")))
    told["nothing is left"] = refused(lambda: _require_effect(0.0, 1.0, 10, 2, ("u", "y")))
    grown = np.cumsum(np.cumsum(U)) * 0.01 + NOISE
    told["unstable"] = warned(lambda: fit_arx(U[:60], 1.2 ** np.arange(60.0) + U[:60], 0.01, **FORM))[:1]
    told["cancels"] = [one[:40] for one in warned(lambda: fit_output_error(u, y, 0.01, n_numerator=4, n_denominator=4))]
    told["runs away"] = told_of(fit_arx(U, grown, 0.01, n_numerator=1, n_denominator=1, delay=1))["fit"]
    data = experiments_from(*records()["two"], ("u", "y"), n_excited=4, n_wanted=20).scaled()
    left = np.where(data.used, 0.1 * NOISE, 0.0)
    return {**told, "quality": quality(left, data, 7)}


@NUMBERS.case(relative=1e-4)
def intervals_of_the_gain() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name in ("white", "two"):
        u, y = records()[name]
        model = fit_output_error(u, y, 0.01, **FORM)
        told[name] = [list(dc_gain_interval(model, u, y, level=level)) for level in (0.5, 0.95)]
    u, y = records()["coloured"]
    robust = fit_output_error(u, y, 0.01, **FORM, covariance="coloured")
    told["coloured"] = [list(dc_gain_interval(robust, u, y)), profile_interval._variance_ratio(robust)]
    rest = fit_output_error(U, answer(), 0.01, **FORM, estimate_initial_state=False)
    told["at rest"] = list(dc_gain_interval(rest, U, answer(), estimate_initial_state=False))
    arx = fit_arx(U, answer(), 0.01, **FORM)
    told["refused"] = [refused(partial(dc_gain_interval, arx, U, answer()))]
    told["refused"] += [refused(partial(dc_gain_interval, rest, U, answer(), level=level)) for level in (0.0, 1.0)]
    asked: list[float] = []

    def excess(value: float) -> float:
        asked.append(value)
        return abs(value - 1.0) - 2.0

    told["crossings"] = [profile_interval._crossing(excess, 1.0, step) for step in (0.1, -0.1, 3.0)]
    told["asked"] = len(asked)
    told["unbounded"] = [profile_interval._crossing(lambda _: -1.0, 1.0, step) for step in (0.1, -0.1)]
    told["just bounded"] = profile_interval._crossing(lambda x: x - 1.6**39, 0.0, 1.0) / 1.6**39
    data = experiments_from(U, answer(), ("u", "y"), n_excited=4, n_wanted=20).scaled()
    form, start = Structure(2, 2, 1), np.array([0.3, -0.1, -1.5, 0.7, 0.0, 0.0])
    for gain in (0.9, 1.05):
        cost, theta = profile_interval._fit_with_gain(form, data, start, gain, 1e-9)
        told[f"forced to {gain:g}"] = [cost, float(theta[:2].sum() / (1.0 + theta[2:4].sum()))]
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
