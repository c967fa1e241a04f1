"""State spaces of small logs: outputs, derivatives, starts, ends and reports, kept in `numbers.json`."""

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run.data import Channels, blocks, channels_from, scaled
from estimation.identification.state_space import choose, fit, identify, starts
from estimation.identification.state_space.dynamics import StateSpaceDynamics, system_in_units
from estimation.identification.state_space.fit import Effort, StateSpaceFit, fit_state_space, system_of
from estimation.identification.state_space.identify import _judged_output, identify_outputs, identify_state_space
from estimation.identification.state_space.joint import Joint, delayed_inputs, joined_outputs
from estimation.identification.state_space.kernel import run_states, state_responses
from estimation.identification.state_space.problem import Problem, Size
from estimation.identification.state_space.system import StateSpace
from plant.arrays import Array
from plant.errors import HydrostateError
from tests.kernels import loops_in_python
from tests.numbers import Found, Numbers, refused, some, warned

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(47)
A: Array = np.array([[1.4, -0.6], [1.0, 0.0]])
B: Array = np.array([[0.2, -0.1], [0.0, 0.3]])
C: Array = np.array([[1.0, 0.2], [-0.5, 1.0]])
U: Array = np.repeat(RNG.choice([-1.0, 1.0], (60, 2)), 4, axis=0) + 0.1 * RNG.standard_normal((240, 2))
NOISE: Array = RNG.standard_normal((240, 2)) @ np.array([[1.0, 0.5], [0.0, 0.8]])
LOST = (np.arange(240) % 17 == 3)[:, None] & np.array([True, False])
QUICK = Effort(2, 2, 8, 1e-4)


def outputs(noise: float = 0.1, late: int = 0) -> Array:
    x, y = np.zeros(2), np.zeros((240, 2))
    for t in range(240):
        y[t] = C @ x + 0.3 * U[max(t - late, 0)]
        x = A @ x + B @ U[max(t - late, 0)]
    return y + noise * NOISE + np.array([2.0, -1.0])


@cache
def channels(lost: bool = False, late: int = 0) -> list[Channels]:
    y = np.where(LOST, np.nan, outputs(late=late)) if lost else outputs(late=late)
    logs = (slice(0, 90), slice(90, 240))
    return [
        channels_from([U[one] for one in logs], [y[one, k] for one in logs], 0.1, ("a", "b"), f"y{k}") for k in (0, 1)
    ]


def joint(lost: bool = False) -> Joint:
    return joined_outputs([scaled(one)[0] for one in channels(lost)])


def theta_of(size: Size, logs: int = 2) -> Array:
    a = np.diag(np.linspace(0.8, 0.3, size.n)) + 0.1 * np.eye(size.n, k=1)
    rest = 0.3 * np.cos(np.arange(size.n_matrices - size.n**2 + size.n * logs))
    return np.concatenate([a.ravel(), rest])


@NUMBERS.case()
def loops() -> dict[str, Any]:
    states, out = np.empty((40, 2)), np.empty((40, 4))
    with loops_in_python():
        run_states(A, U[:40] @ B.T, np.array([0.3, -0.2]), states)
        state_responses(A, C, np.ascontiguousarray(U[:40, 0]), np.zeros((4, 2)), out)
    return {"states": [some(one, 7) for one in states.T], "answers": [some(one, 7) for one in out.T]}


@NUMBERS.case()
def outputs_and_slopes() -> dict[str, Any]:
    told: dict[str, Any] = {}
    with loops_in_python():
        for size in (Size(2, 2, 2, direct=True), Size(3, 2, 2, direct=False), Size(1, 2, 2, direct=False)):
            problem = Problem(size, joint())
            theta = theta_of(size)
            found, slopes = problem.jacobian(theta)
            turned = problem.balanced(theta)
            directions = problem.directions(theta)
            told[f"order {size.n}"] = {
                "count": size.n_matrices,
                "outputs": [some(one) for one in found],
                "alike": bool(np.allclose(problem.outputs(problem.unpacked(theta)).T, found, rtol=1e-12)),
                "slopes": [float(np.linalg.norm(slopes[o, :, k])) for o in (0, 1) for k in range(theta.size)],
                "late slopes": [slopes[o, -1] for o in (0, 1)],
                "linear": [some(one) for one in problem.linear_columns(np.eye(size.n) * 0.5, np.ones((2, size.n)))],
                "balanced": np.abs(turned),
                "directions": [list(directions.shape), float(np.abs(slopes @ directions).sum())],
            }
    return told


@NUMBERS.case()
def data_side_by_side() -> dict[str, Any]:
    one = joint(lost=True)
    masks = blocks(scaled(channels()[0])[0], 4)
    late = one.delayed((0, 3))
    first, second = channels()
    return {
        "slices": [[part.start, part.stop] for part in one.slices],
        "samples": one.n_samples,
        "delayed": [some(part, 9) for part in late.u],
        "later than the log": delayed_inputs(U[:3], (5, 1)),
        "held back": [int(np.isnan(part).sum()) for part in one.without(masks[1]).y],
        "refused": [
            refused(lambda: joined_outputs([first, replace(second, u=second.u[::-1])])),
            refused(lambda: joined_outputs([first, replace(second, inputs=("a", "c"))])),
            refused(lambda: joined_outputs([first, replace(second, u=second.u[:1], y=second.y[:1])])),
        ],
    }


@NUMBERS.case()
def starts_of_searches() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for order in (1, 2, 3, 30):
        found = starts.subspace_starts(joint(lost=True), order)
        told[f"order {order}"] = [[np.sort(np.abs(np.linalg.eigvals(a))), np.abs(c @ c.T)] for a, c in found]
    data = joint()
    for n in (59, 60, 61, 106, 107, 140):
        cut = Joint(0.1, (data.u[1][:n],), (data.y[1][:n],))
        told[f"of {n} samples"] = len(starts.subspace_starts(cut, 1))
    long = Joint(0.1, (np.tile(U, (3, 1)),), (np.tile(outputs(), (3, 1)) + np.resize(NOISE, (720, 2)),))
    for n in (430, 431, 600):
        found = starts.subspace_starts(Joint(0.1, (long.u[0][:n],), (long.y[0][:n],)), 2)
        told[f"of {n} samples"] = [np.sort(np.abs(np.linalg.eigvals(a))) for a, _ in found]
    told["Hankel"] = [starts._hankel(np.arange(12.0).reshape(6, 2), 1, 2), list(starts._hankel(U[:3], 0, 2).shape)]
    turn = np.array([[1.0, 0.4], [0.2, 1.0]])
    for name, poles in {"inside": (0.9, 0.5), "outside": (1.25, 0.5), "at the limit": (0.995, 1.001)}.items():
        told[f"poles {name}"] = starts._stable_transition(turn @ np.diag(poles) @ np.linalg.inv(turn), 100)
    told["a pair"] = starts._stable_transition(1.2 * np.array([[0.6, 0.8], [-0.8, 0.6]]), 100)
    return told


def told_of(found: StateSpaceFit) -> dict[str, Any]:
    return {
        "poles": [Found(float(one), 1e-3) for one in np.sort(np.abs(np.linalg.eigvals(found.a)))],
        "noise": found.noise,
        "deviance": found.deviance,
        "values": found.theta.size,
    }


@NUMBERS.case(relative=1e-5)
def fits() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, data, size in (
        ("first order", joint(), Size(1, 2, 2, direct=False)),
        ("second order", joint(), Size(2, 2, 2, direct=True)),
        ("with gaps", joint(lost=True), Size(2, 2, 2, direct=False)),
    ):
        found = fit_state_space(size, data, effort=QUICK)
        told[name] = told_of(found)
        system = system_of(found, data, (0, 0))
        told[f"{name}, deviations"] = [system.dc_gain, system.dc_gain_std, np.sort(np.abs(system.pole_std))]
    size = Size(2, 2, 2, direct=True)
    begun = theta_of(size)
    for effort in (Effort(1, 1, 1, 1e-4), Effort(1, 1, 3, 1e-4), Effort(1, 3, 3, 1e-9), Effort(2, 1, 3, 0.5)):
        told[f"by {effort.weighings}, {effort.charts}, {effort.steps}"] = told_of(
            fit_state_space(size, joint(), begun, effort)
        )
    problem = Problem(size, joint(lost=True))
    noise = fit._noise(problem, begun)
    told["noise"] = [noise, fit._whitener(problem, noise), fit._whitener(Problem(size, joint()), noise)]
    told["left"] = some(fit._residual(problem, begun))
    alike = joined_outputs([scaled(one)[0] for one in (channels()[0], replace(channels()[0], output="other"))])
    told["noise of one output twice"] = fit._noise(Problem(size, alike), np.zeros(begun.size))
    told["residuals that follow an order too low"] = told_of(
        fit_state_space(Size(1, 2, 2, direct=False), joint(), effort=Effort(3, 2, 10, 1e-6))
    )
    first = [np.sort(np.abs(np.linalg.eigvals(one[:4].reshape(2, 2)))) for one in fit._starts(Problem(size, joint()))]
    told["completed starts"] = first
    data = joint()
    told["refused"] = [
        refused(partial(fit_state_space, size, Joint(0.1, (U[:n],), (outputs()[:n],)), effort=QUICK))
        for n in (15, 16, 59, 60)
    ]
    return told | {"samples": data.n_samples}


@cache
def system() -> StateSpace:
    p = 2 * 2 + 2 * 2 + 2 * 2 + 2 * 2 + 2
    root = 0.01 * np.random.default_rng(5).standard_normal((p, p))
    return StateSpace(A, B, C, 0.3 * np.eye(2), np.array([0.5, -0.2]), (0, 2), True, 0.1, root @ root.T)


def without_path() -> StateSpace:
    one = system()
    kept = np.r_[0:12, 16:18]
    return replace(one, d=np.zeros((2, 2)), direct=False, covariance=one.covariance[np.ix_(kept, kept)])


@NUMBERS.case()
def systems() -> dict[str, Any]:
    told: dict[str, Any] = {}
    means = np.array([1.0, -2.0]), np.array([3.0, 0.5]), np.array([10.0, 20.0]), np.array([2.0, 4.0])
    for name, one in (
        ("direct", system()),
        ("without path", without_path()),
        ("in units", system().in_units(*means)),
        ("without path, in units", without_path().in_units(*means)),
    ):
        response, deviation = one.frequency_response([0.5, 3.0])
        told[name] = {
            "sizes": [one.order, one.n_values],
            "poles": [np.abs(one.poles), np.sort(one.pole_std.real), one.pole_std.imag],
            "gain": [one.dc_gain, one.dc_gain_std, one.offset],
            "deviations": np.sqrt(np.diag(one.covariance)),
            "response": [response, deviation],
            "delays as states": [*one.with_delays_as_states()],
            "saved": [StateSpace.from_dict(one.to_dict()).dc_gain_std[0, 0], one.to_dict()["delays"]],
        }
    late = replace(system(), delays=(3, 1)).with_delays_as_states()
    told["late"] = [*late]
    return told


@NUMBERS.case()
def bodies() -> dict[str, Any]:
    told: dict[str, Any] = {}
    y = outputs()[:, 0]
    for place in (0, 1):
        body = StateSpaceDynamics(system(), place)
        told[f"output {place}"] = {
            "run": some(body.run(U, y), 7),
            "run without outputs": some(body.run(U, np.full(240, np.nan)), 7),
            "one step": some(body.one_step(U, np.where(LOST[:, 0], np.nan, y)), 4),
            "transfer functions": [part for pair in body.transfer_functions() for part in pair],
            "level": [body.level, body.n_values],
        }
    seen = [np.where(np.arange(240) < n, y, np.nan) for n in (2, 3)]
    told["few outputs"] = [some(StateSpaceDynamics(system(), 0).run(U, one), 4) for one in seen]
    scalings = [scaled(one)[1] for one in channels()]
    told["in units"] = system_in_units([StateSpaceDynamics(system(), k) for k in (0, 1)], scalings).level
    return told


@NUMBERS.case(relative=1e-4)
def choices() -> dict[str, Any]:
    data = [scaled(one)[0] for one in channels()]
    found = choose.state_candidates(data, [1, 2], 1)
    told: dict[str, Any] = {"candidates": [one.row() for one in found], "held back": [one.held_back for one in found]}
    told["chosen"] = choose.chosen_state(found).fit.size.n
    base = found[0]

    def made(price: float, bic: float, doubt: str = "") -> choose.StateCandidate:
        return replace(base, held_back=(price,), bic=bic, doubt=doubt)

    told["choices"] = [
        choose.chosen_state(rows).bic
        for rows in (
            [made(1.0, 3.0), made(1.009, 2.0), made(1.011, 1.0)],
            [made(1.0, 3.0), made(0.5, 1.0, "time_constant")],
            [made(1.0, 3.0, "time_constant"), made(0.5, 1.0, "time_constant")],
        )
    ]
    told["forms"] = [choose._forms(data, given) for given in (None, 0, 1, 4)]
    told["forms behind a dead time"] = choose._forms([scaled(one)[0] for one in channels(late=4)], None)
    size = Size(1, 2, 2, direct=False)
    radii = (0.5, float(np.exp(-1.0 / 149.0)), float(np.exp(-1.0 / 151.0)), 1.0, 0.0)
    told["doubts"] = [
        choose._doubt(StateSpaceFit(size, np.array([one, *np.zeros(9)]), np.eye(2), 0.0), joint()) for one in radii
    ]
    return told


@NUMBERS.case(relative=1e-4)
def what_is_identified() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, given in {"given": {"order": 2, "delay": 1}, "first order": {"order": 1, "delay": 0}}.items():
        found = identify_state_space(channels(), **given)
        told[name] = [
            {
                "fit": [one.quality.fit_percent, one.quality.rmse, one.held_back_percent],
                "sound": [one.sound, len(one.notes), len(one.candidates)],
                "offset": [one.model.offset, one.model.level],
            }
            for one in found
        ]
    both = identify_outputs(channels(), structure="auto", order=2, delay=1)
    told["chosen by itself"] = [both[0].model.structure, len(both[0].candidates)]
    alone = identify_outputs(channels()[:1], structure="auto", order=1, delay=1)
    told["one output"] = [alone[0].model.structure, len(alone[0].candidates)]
    told["refused"] = [refused(lambda: identify_outputs(channels(), structure="state-space", n_numerator=2))]
    data = channels()[0]
    best = choose.state_candidates([scaled(one)[0] for one in channels()], [1], 1)[0]
    model = identify_state_space(channels(), order=1, delay=1)[0].model
    for name, doubt, radius, held in (
        ("none", "", 0.5, 0.5),
        ("held back is nothing", "", 0.5, 1.0),
        ("slow", "time_constant", 0.999, 0.5),
        ("endless", "time_constant", 1.0, 0.5),
    ):
        theta = np.concatenate([[radius], best.fit.theta[1:]])
        one = replace(best, doubt=doubt, fit=replace(best.fit, theta=theta))
        judged = _judged_output(model, data, one, held, ())
        told[f"judged, {name}"] = [judged.sound, judged.held_back_percent, [dict(note.data) for note in judged.notes]]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify, "state_candidates", _asked)
        told["orders tried"] = [refused(partial(identify_state_space, channels(), order=order)) for order in (None, 3)]
    told["warns"] = [one[:30] for one in warned(lambda: identify_state_space(_unrelated(), order=1, delay=1))]
    return told


def _asked(data: Any, orders: Any, delay: Any) -> Any:
    raise HydrostateError(f"{len(data)} outputs, orders {list(orders)}, delay {delay}")


def _unrelated() -> list[Channels]:
    return [channels_from([U], [NOISE[:, k]], 0.1, ("a", "b"), f"y{k}") for k in (0, 1)]


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
