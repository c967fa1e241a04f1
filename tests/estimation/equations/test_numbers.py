"""A user's equations on small logs: predictions, slopes, searches and conclusions, kept in `numbers.json`."""

# ruff: noqa: ARG001 - every function is given the same three things

from dataclasses import replace
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

from estimation.equations import conclude, search
from estimation.equations.definition import Equations, Parameter
from estimation.equations.fit import EquationsFit, _with_fitted_starts, fit_equations, simulated_outputs
from estimation.equations.problem import Part, Problem, known_noise, part_of, spread, start_of
from estimation.equations.search import Solution
from estimation.equations.stops import SHORTEST_STAY, standing_ends
from estimation.stretches import in_long_stretches
from plant.arrays import Array
from plant.log.record import Record
from tests.numbers import Found, Numbers, Roughly, refused, some

NUMBERS = Numbers(__file__)
N, T = 240, 0.05
TIME: Array = T * np.arange(N)
RNG = np.random.default_rng(53)
TORQUE: Array = 0.6 * np.sign(np.sin(2.0 * TIME)) * np.cos(0.7 * TIME)
NOISE: Array = RNG.standard_normal(N)


def pendulum(state: Any, inputs: Any, p: Any) -> Any:
    angle, speed = state
    return speed, (inputs.torque - p.damping * speed - p.weight * np.sin(angle)) / p.inertia


def both(state: Any, inputs: Any, p: Any) -> Any:
    return state.angle, 2.0 * state.speed + 0.1 * inputs.torque


def model(derivative: Any = pendulum, **changes: Any) -> Equations:
    parameters = {
        "inertia": Parameter(0.1, (0.01, 1.0), "kg m^2"),
        "weight": Parameter(1.0, (0.1, 10.0)),
        "damping": Parameter(0.1, (0.0, 1.0)),
    }
    names = {"states": {"angle": "rad", "speed": "rad/s"}, "inputs": {"torque": "N m"}, "outputs": {"angle": "rad"}}
    return Equations(derivative, **{**names, "parameters": parameters, **changes})


@cache
def angle() -> Array:
    truth = {"inertia": 0.2, "weight": 2.0, "damping": 0.05}
    record = Record(T, {"torque": TORQUE, "angle": np.zeros(N)})
    return np.asarray(simulated_outputs(model(), record, truth, {"angle": 0.3, "speed": 0.1})["angle"])


def logged(noise: float = 0.02, last: int = N) -> Record:
    return Record(T, {"torque": TORQUE[:last], "angle": (angle() + noise * NOISE)[:last]})


def parts(lost: bool = False) -> tuple[Part, ...]:
    """Return two logs of different lengths."""
    one = part_of(model(), logged())
    measured = one.measured.copy()
    if lost:
        measured[0, ::9] = np.nan
    return (one, Part(one.inputs[40:160], measured[:, 40:160], T))


def problem(lost: bool = True, **changes: Any) -> Problem:
    return replace(Problem(model(), parts(lost), "rk4", 1, np.array([0.02])), **changes)


THETA: Array = np.array([np.log(0.2), np.log(2.0), 0.5, 1.0, 0.1, 0.8, -0.2])


@NUMBERS.case()
def problems() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = problem()
    given = model(initial={"angle": 0.3, "speed": Parameter(0.2, (-1.0, 1.0))})
    for name, this, theta in (
        ("explicit", one, THETA),
        ("two steps a sample", replace(one, substeps=2), THETA),
        ("implicit", replace(one, scheme="ros2"), THETA),
        ("robust", replace(one, robust=True), THETA + 0.1),
        ("held", replace(one, equations=replace(model(), held=("torque",))), THETA),
        ("an initial state is given", replace(one, equations=given), np.delete(THETA, [3, 5])),
    ):
        point = this.at(theta)
        told[name] = {
            "names": list(this.names),
            "predicted": [some(run, 6) for run in this.predicted(theta)],
            "residuals": [some(run, 4) for run in this.residuals(theta)],
            "slopes": [some(column, 4) for column in this.slopes(theta).T],
            "point": [point.cost, point.gradient, np.diag(point.gram)],
            "bounds": [*this.bounds],
            "values": this.values(theta),
            "coordinates": this.coordinates(this.values(theta)) - theta < 1e-12,
        }
    told["seen"] = problem(equations=model(both, outputs={"a": "1", "b": "1"}, observe=both), noise=np.ones(2)).names
    far = problem().at(np.array([-300.0, 300.0, 0.5, 1.0, 0.1, 0.8, -0.2]))
    told["runs away"] = [far.cost, np.diag(far.gram)]
    told["starts"] = [start_of(model(), name, parts()[0]) for name in ("angle", "speed")]
    told["start of a lost sample"] = start_of(
        model(), "angle", replace(parts(True)[1], measured=parts(True)[1].measured)
    )
    told["spread"] = spread(parts(True))
    told["noise"] = [known_noise(model(), {}), known_noise(model(), {"angle": 0.1})]
    record = logged()
    told["refused"] = [
        refused(partial(part_of, model(), record.replace(torque=np.where(TIME[5] == TIME, np.nan, TORQUE)))),
        refused(partial(part_of, model(), record.replace(angle=np.where(TIME[5] == TIME, np.inf, TORQUE)))),
        refused(partial(part_of, model(), record.replace(angle=np.where(np.arange(N) == 5, TORQUE, np.nan)))),
        refused(partial(part_of, model(), record.replace(angle=np.where(np.arange(N) < 2, TORQUE, np.nan)))),
        refused(partial(part_of, model(), Record(T, {"angle": angle()}))),
        *(refused(partial(known_noise, model(), {"angle": one})) for one in (0.0, -1.0, np.inf)),
        refused(partial(known_noise, model(), {"speed": 1.0})),
    ]
    return told


@NUMBERS.case()
def parameters() -> dict[str, Any]:
    rows = {
        "free": Parameter(0.0),
        "of its start": Parameter(-3.0),
        "within bounds": Parameter(0.0, (-2.0, 6.0)),
        "positive": Parameter(2.0, (1e-3, 5.0)),
        "from zero": Parameter(2.0, (0.0, 5.0)),
    }
    told: dict[str, Any] = {name: [one.size, one.logarithmic] for name, one in rows.items()}
    told["refused"] = [
        refused(partial(Parameter, start, bounds))
        for start, bounds in (
            (np.nan, (0.0, 1.0)),
            (True, (0.0, 1.0)),
            (0.5, (1.0, 0.0)),
            (0.5, (0.5, 0.5)),
            (0.5, (0.6, 1.0)),
            (0.5, (0.0, 0.4)),
            (0.5, (0.5, 1.0)),
            (1.0, (0.5, 1.0)),
            (0.5, (0.0,)),
        )
    ]
    return told


@NUMBERS.case()
def parts_of_searches() -> dict[str, Any]:
    told: dict[str, Any] = {}
    one = problem(lost=False)
    told["noise of measurements"] = [search.noise_of(parts()), search.noise_of(parts(True))]
    short = Part(np.zeros((2, 1)), np.array([[1.0, 2.0]]), T)
    told["noise of two samples"] = search.noise_of([short])
    told["guesses"] = [np.round(guess, 9) for guess in search._guesses(one, 3, 7)]
    for name, scale in (("slow", 1.0), ("quick", 4.0), ("quicker", 30.0), ("stiff", 1000.0)):
        theta = THETA + np.array([-np.log(scale), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        found = search.with_enough_steps(one, theta)
        told[f"steps, {name}"] = [found.scheme, found.substeps]
    told["steps of little noise"] = [
        (found.scheme, found.substeps)
        for size in (1e-4, 1e-6)
        if (found := search.with_enough_steps(one.with_noise(np.array([size])), THETA))
    ]
    told["explained"] = [
        search._is_explained(one, THETA, np.array([size])) for size in (0.02, 0.025, 0.0265, 0.0275, 0.029, 0.05, 0.3)
    ]
    for robust in (False, True):
        this = replace(problem(), robust=robust)
        told[f"shown, robust {robust}"] = search._residual_deviations(this, THETA, spread(this.parts))
    told["shown at least"] = search._residual_deviations(problem(), THETA, np.array([1e9]))
    told["moved"] = [search._step_length_shift(replace(one, substeps=count), one.at(THETA)) for count in (1, 2)]
    ended = search._optimum_by_lengthening(
        problem(noise=np.array([0.05])), one.coordinates(np.array([p.start for p in one.unknowns]))
    )
    told["lengthened"] = Roughly(ended.cost, 1e-3)
    return told


@cache
def found(kind: str) -> EquationsFit:
    lost = np.where(np.arange(N) % 13 == 5, np.nan, logged()["angle"])
    spoilt = logged()["angle"] + np.where(np.arange(N) % 37 == 9, 0.5, 0.0)
    stopped = np.minimum(angle(), 0.45) + 0.001 * NOISE
    match kind:
        case "plain":
            return fit_equations(model(), [logged()])
        case "gaps, two logs":
            return fit_equations(model(), [logged().replace(angle=lost), logged(0.03, 130)])
        case "robust":
            return fit_equations(model(), [logged().replace(angle=spoilt)], robust=True)
        case "noise is given":
            return fit_equations(model(), [logged()], noise={"angle": 0.01})
        case "several starts":
            return fit_equations(model(), [logged()], starts=3, seed=2)
        case "no damping":
            known = {"damping": 0.0}
            fewer = {key: one for key, one in model().parameters.items() if key != "damping"}
            return fit_equations(model(parameters=fewer, known=known), [logged()])
        case "at a stop":
            return fit_equations(model(), [logged().replace(angle=stopped)])
        case "at a bound":
            tight = {**model().parameters, "weight": Parameter(1.0, (0.1, 1.5))}
            return fit_equations(model(parameters=tight), [logged()])
        case "not told apart":
            return fit_equations(model(_scaled, parameters=_twice()), [logged()])
        case "an output that stands":
            return fit_equations(model(), [logged().replace(angle=np.full(N, 0.4))])
        case _:
            return fit_equations(model(), [logged().replace(angle=NOISE)])


def _scaled(state: Any, inputs: Any, p: Any) -> Any:
    angle, speed = state
    size = p.inertia * p.scale
    return speed, (inputs.torque - p.damping * speed - p.weight * np.sin(angle)) / size + 0.0 * p.nothing


def _twice() -> dict[str, Parameter]:
    further = {"scale": Parameter(1.0, (0.1, 10.0)), "nothing": Parameter(1.0, (0.0, 2.0))}
    return {**model().parameters, **further}


KINDS = (
    *("plain", "gaps, two logs", "robust", "noise is given", "several starts", "no damping", "at a stop", "at a bound"),
    *("not told apart", "an output that stands", "noise alone"),
)


@NUMBERS.case(relative=1e-3)
def fits_and_what_they_say() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for kind in KINDS:
        one = found(kind)
        solved = one.solution
        told[kind] = {
            "outcome": str(one.finding.outcome),
            "values": {
                name: None if row.value is None else [row.value, row.std, list(row.ci95 or ()), row.unit]
                for name, row in one.finding.quantities.items()
            },
            "gate": [one.finding.gate.passed, [str(reason.code) for reason in one.finding.gate.reasons]],
            "notes": [str(note.code) for note in (*one.finding.notes, *one.finding.not_told)],
            "data": [_numbers(note.data) for note in (*one.finding.gate.reasons, *one.finding.notes)],
            "groups": [list(group) for group in one.covariance.groups],
            "condition": Roughly(one.covariance.condition, 0.01) if np.isfinite(one.covariance.condition) else None,
            "fit": dict(one.fit_percent),
            "noise": dict(one.noise),
            "steps": [solved.problem.scheme, solved.problem.substeps, len(solved.others), solved.evaluations],
        }
    other = found("plain").predicted(logged(0.0, 120).replace(angle=angle()[60:180], torque=TORQUE[60:180]))
    told["elsewhere"] = some(other["angle"], 4)
    told["from a state that is said"] = some(found("plain").predicted(logged(), {"angle": 0.5})["angle"], 4)
    told["samples"] = [refused(partial(fit_equations, model(), [logged(last=n)])) for n in (5, 6)]
    told["samples of two logs"] = refused(partial(fit_equations, model(), [logged(last=3), logged(last=4)]))
    this = Problem(model(), parts()[:1], "rk4", 1, np.ones(1))
    told["states begun"] = _with_fitted_starts(this, THETA[:5] + 0.2, [3, 4])
    return told


def _numbers(data: Any) -> dict[str, Any]:
    return {key: Found(value, abs(value)) if isinstance(value, float) else value for key, value in data.items()}


@NUMBERS.case(relative=1e-4)
def conclusions() -> dict[str, Any]:
    told: dict[str, Any] = {}
    base = found("plain").solution
    this, theta = base.problem, base.point.theta
    told["doubts"] = [
        [str(note.code) for note in conclude._convergence_notes(replace(base, moved=moved, evaluations=count))]
        for moved, count in ((0.04, 0), (0.06, 0), (0.0, 100))
    ]
    told["fit"] = conclude.fits_of(this, theta)
    for name, shift in (("as it is", 0.0), ("off", 0.2)):
        residuals = this.residuals(theta + shift)
        for given in (np.nan, 0.02, 0.0001):
            notes = conclude._misfits(this, theta, residuals, np.array([given]))
            told[f"misfits, {name}, {given:g}"] = [[str(note.code), _numbers(note.data)] for note in notes]
    rows = [[np.cos(np.arccos(size) * np.arange(N))[None, :]] for size in (0.19, 0.24, 0.27, -0.27)]
    told["correlated"] = [
        any(note.code == "misfit_correlated" for note in conclude._misfits(this, theta, row, np.array([np.nan])))
        for row in rows
    ]
    rng = np.random.default_rng(3)
    told["followed"] = [
        conclude._explained_share(rng.standard_normal(N) + share * TORQUE, TORQUE, np.ones((N, 1)))
        for share in (0.0, 0.3, 2.0)
    ]
    told["followed by nothing"] = conclude._explained_share(NOISE, np.ones(N), np.ones((N, 1)))
    told["followed by few"] = conclude._explained_share(NOISE[:5], TORQUE[:5], np.ones((5, 1)))
    low, _ = this.bounds
    told["at bounds"] = [
        [
            dict(note.data)
            for note in conclude._at_bounds(this, np.array([low[0] + step, *theta[1:2], 0.0 + step, *theta[3:]]))
        ]
        for step in (0.0, 1e-10, 1e-8)
    ]
    poor = replace(found("plain").covariance, std=np.array([0.49, 0.51, 5.1, 0.1, 0.1]))
    vague = conclude._undetermined_notes(this, theta, poor)
    told["poorly told"] = [[str(note.code), _numbers(note.data)] for note in vague]
    found_std = found("plain").covariance
    for name, shift in (("near", 2.0), ("apart", 4.0)):
        other = theta + shift * np.where(np.arange(theta.size) == 1, found_std.std, 0.0)
        one = Solution(this, base.point, (other,))
        told[f"other starts, {name}"] = [dict(note.data) for note in conclude._other_solution_notes(one, found_std)]
    worse = replace(base.point, cost=this.at(other).cost - 1.9)
    one = Solution(this, worse, (other,))
    told["other starts, as well"] = [dict(note.data) for note in conclude._other_solution_notes(one, found_std)]
    return told


@NUMBERS.case()
def channels_that_stand() -> dict[str, Any]:
    t = np.arange(2000.0)
    sine = np.sin(t / 50.0)
    noise = np.random.default_rng(8).standard_normal(2000)
    rows: dict[str, tuple[list[Array], float]] = {
        "free": ([sine], 0.0),
        "clipped above": ([np.minimum(sine, 0.8)], 0.0),
        "clipped below": ([np.maximum(sine, -0.9)], 0.0),
        "both, in two logs": ([np.clip(sine[:900], -0.9, 0.8), np.clip(sine[900:], -0.9, 0.8)], 0.0),
        "with noise": ([np.clip(sine, -0.9, 0.8) + 0.01 * noise], 0.01),
        "with too much": ([np.clip(sine, -0.9, 0.8) + 0.07 * noise], 0.07),
        "hardly clipped": ([np.minimum(sine, 0.99)], 0.0),
        "once": ([np.minimum(np.linspace(-1.0, 1.0, 2000), 0.95)], 0.0),
        "once, for long": ([np.minimum(np.linspace(-1.0, 1.0, 2000), 0.5)], 0.0),
        "once, for just long": ([np.minimum(np.linspace(-1.0, 1.0, 2000), 0.79)], 0.0),
        "few levels": ([np.round(sine * 9.0) / 9.0], 0.0),
        "more levels": ([np.round(sine * 9.6) / 9.6], 0.0),
        "gaps": ([np.where(t % 7 == 3, np.nan, np.minimum(sine, 0.8))], 0.0),
        "seldom": ([np.where(t < 16.0, 1.2, sine)], 0.0),
        "often enough": ([np.where((t < 12.0) | ((t > 1500.0) & (t < 1512.0)), 1.2, sine)], 0.0),
    }
    told: dict[str, Any] = {
        name: [
            [one.end, one.value, one.share, int(sum(np.count_nonzero(w) for w in one.where))]
            for one in standing_ends(*given)
        ]
        for name, given in rows.items()
    }
    return told | {"runs": in_long_stretches(np.array([1, 1, 0, 1, 1, 1, 0, 0, 1, 1, 1, 1], dtype=bool), SHORTEST_STAY)}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
