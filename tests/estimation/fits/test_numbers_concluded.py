"""Conclusions from made-up fits, and bounds of searches, kept in `numbers_concluded.json`."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from estimation.fits.flow import asked_hypotheses
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import plain as plain_flow
from estimation.fits.flow.belief import wanted_cost
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import homed_at_stop
from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.play import ShownPlay
from estimation.fits.hypotheses import BEGUN_UNDER_LOAD, HYPOTHESES, MAY_HIDE
from estimation.fits.hypothesis_search.explanation import Explanation, Trial
from estimation.fits.hypothesis_search.fit_objections import fit_explains_all
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain, shared_slopes
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.fits.hypothesis_search.wide_problem import flow_bounds, hypothesis_problem, own_starts
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion.fit import _starts
from estimation.fits.motion.log import _steps, motion_log
from estimation.fits.motion.search import MOST_WORK, MotionSearch, SharedState, explained_cost, rough_problem
from estimation.fits.motion.weakly_held import unseen_shift
from estimation.models.flow import FLOW_FORM, HELD_FLOW_FORM, MASS_FLOW_FORM, STIFFNESS
from estimation.models.motion import MOTION_FORMS
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.fits.short_logs import PAPER, POSITION, SPEED, log, made_fit, noted, problem, seen, usual, wide
from tests.numbers import Numbers, some

NUMBERS = Numbers(__file__)


def plain(cost: float, form: Any = FLOW_FORM, modulus: float = 2e8, **how: Any) -> GreyBoxFit:
    made = made_fit(cost, modulus, 1e6, **how)
    fed = "makeup_conductance"
    return replace(made, model=form, values={**made.values, fed: 1e-9}, std={**made.std, fed: 1e-10})


def concluded(
    fits: list[GreyBoxFit],
    strange: GreyBoxFit,
    *names: str,
    sensed: Any = None,
    open_by: PredictedGain = NO_GAIN,
    **how: Any,
) -> Any:
    """Return the result for a log, from its plain fits and one fit under hypotheses."""
    values = {name: (value, strange.std[name]) for name, value in strange.values.items() if name in strange.std}
    explanation = Explanation(names, values, {}, (strange,), (), 1e6, lambda: open_by)
    asked: list[Any] = []

    def explained(*_: Any, asked: Any, paired: bool, by_mass: bool, **__: Any) -> Any:
        calls.append([[one.name for one in asked], paired, by_mass])
        return explanation

    calls = asked
    promises = [*(2 * [PredictedGain(40.0, 0.2, 0.05)]), *(len(MAY_HIDE) * [PredictedGain(0.0, 0.0, 0.05)])]
    with (
        patch.multiple(
            asked_hypotheses,
            predicted_gains=lambda *_, **__: promises,
            predicted_gain=lambda *_, **__: PredictedGain(0.0, 0.0, 0.05),
        ),
        patch.object(plain_flow, "balance_fits", lambda *_, **__: fits),
        patch.multiple(
            flow_fit,
            explain=explained,
            varying_loss=lambda *_: None,
            lower_minimum=lambda *_: None,
            with_implicit_steps=lambda _: None,
            delivery_objection=lambda *_: (),
            sensed_play=lambda _: sensed or ShownPlay(0.0, 0.0),
        ),
    ):
        found = fit_flow(log(0.2), PAPER, 2e8, traits=LogTraits(**how))
    return {
        "asked": calls,
        "believed [Pa]": list(found.parameters["bulk_modulus"]),
        "bound": found.bound,
        "chi-square": found.chi_square,
        "reasons": noted(found.reasons),
        "remarks": noted(found.remarks),
        "explained by": None if found.explanation is None else list(found.explanation.names),
    }


@NUMBERS.case()
def conclusions_of_the_flow_form() -> dict[str, Any]:
    strange = plain(100.0, modulus=2.1e8)
    sensed = ShownPlay(3e-5, 9.0, 2e-10)
    told: dict[str, Any] = {
        f"delivery, {gain:g} better": concluded([plain(100.0 + gain)], strange, "delivery") for gain in (9.0, 11.0)
    }
    told |= {
        "poorly explained": concluded([plain(500.0)], plain(100.0, chi=1.5), "delivery"),
        "filtered": concluded([plain(105.0)], strange, "pressure_late", filtered=True),
        "filtered, and more": concluded([plain(105.0)], strange, "pressure_late", "delivery", filtered=True),
        "filtered, but": concluded([plain(89.0)], strange, "pressure_late", filtered=True),
        "played": concluded([plain(200.0)], strange, "position_play", sensed=sensed),
        "played less": concluded([plain(200.0)], strange, "position_play", sensed=ShownPlay(3e-5, 9.0, 1e-13)),
        "played, poorly": concluded([plain(200.0)], plain(100.0, chi=1.15), "position_play", sensed=sensed),
        "played, and more": concluded([plain(200.0)], strange, "position_play", "volume", sensed=sensed),
        "played, sensed by chance once in sixty logs": concluded(
            [plain(200.0)], strange, "position_play", sensed=ShownPlay(3e-5, 2.3, 2e-11)
        ),
        "played, sensed by chance once in 160 logs": concluded(
            [plain(200.0)], strange, "position_play", sensed=ShownPlay(3e-5, 3.1, 2e-11)
        ),
        "played, shown": concluded(
            [replace(plain(200.0), play=ShownPlay(3e-5, 9.0))], strange, "position_play", sensed=ShownPlay(3e-5, 2.3)
        ),
        "wear is left open": concluded([plain(200.0)], strange, "volume", open_by=PredictedGain(0.0, 0.0, 0.12)),
        "a play is left": concluded([plain(200.0)], strange, "delivery", sensed=sensed),
        "held volumes": concluded(
            [plain(100.0, HELD_FLOW_FORM), plain(130.0), plain(128.0, MASS_FLOW_FORM)], strange, "delivery"
        ),
        "mass": concluded([plain(104.0), plain(100.0, MASS_FLOW_FORM, 2.02e8)], strange, "delivery"),
        "nothing explains it": concluded([plain(900.0, chi=2.0)], plain(899.0, chi=2.0), "volume"),
        "under load": concluded([plain(105.0, chi=1.15)], plain(90.0, chi=1.12), "start_load", loaded=True),
        "under load, explained": concluded([plain(105.0, chi=1.15)], plain(90.0, chi=1.05), "start_load", loaded=True),
    }
    names = {"zero": ("encoder_zero",), "lag": ("pressure_late",), "play": ("position_play",), "two": ("volume", "air")}
    best, swinging = plain(100.0, HELD_FLOW_FORM), plain(105.0)
    told["wanted"] = {
        f"{name}, homed: {homed}, late: {late}": wanted_cost(each, best, swinging, homed=homed, late=late)
        for name, each in names.items()
        for homed in (False, True)
        for late in (False, True)
    }
    told["all explained up to"] = [
        edge(lambda chi, noisy=noisy: fit_explains_all(plain(1.0, chi=chi), noisy), 0.5, 2.0, 20)
        for noisy in (False, True)
    ]
    return told


@NUMBERS.case()
def encoders_that_were_homed() -> dict[str, Any]:
    def homed(*read: float) -> bool:
        drives = np.zeros((len(read), 2))
        drives[:, FLOW_FORM.drives.index("position_m")] = read
        one: Any = SimpleNamespace(drives=drives)
        return homed_at_stop(one)

    return {
        "beyond the stop": edge(lambda over: homed(0.1, 0.3, -over), 0.0, 0.05),
        "beyond the other": edge(lambda over: homed(-0.1, -0.3, over), 0.0, 0.05),
        "at first": edge(lambda begun: homed(begun, 0.3, 0.0), 0.0, 0.05),
        "on both sides": homed(0.1, 0.2, -0.2),
    }


MOVED_BOUNDS = {"chamber_volume", "relief_conductance", "start_level", "position_zero"}
"""Unknowns whose bounds or starts depend on the log."""


@NUMBERS.case()
def bounds_and_starts_of_hypotheses() -> dict[str, Any]:
    told: dict[str, Any] = {}
    slow, noisy = wide(), widened_log(seen(log(0.5, position_noise=3e-5)), PAPER, {STIFFNESS: 3e7})
    fast = replace(slow, drives=slow.drives * np.where(np.arange(slow.drives.shape[1]) == 0, 40.0, 1.0))
    asked = [one for one in (BEGUN_UNDER_LOAD, *HYPOTHESES) if {*one.free} & MOVED_BOUNDS]
    for name, base in {"slow": slow, "fast": fast, "noisy": noisy}.items():
        for one in asked:
            model = hypothesis_problem(base, (one,), STIFFNESS).model
            usual_size = model.values(np.zeros(len(model.unknowns)))
            guesses = [model.theta({**usual_size, "bulk_modulus": size}) for size in (1e8, 4e8)]
            bounds = zip(model.unknowns, *(each.tolist() for each in flow_bounds(model, guesses, base)), strict=True)
            told[f"{one.name}{', begun' if one is BEGUN_UNDER_LOAD else ''}, {name}"] = {
                "starts": [dict(start) for start in own_starts(base, one)],
                "bounds": {unknown: pair for unknown, *pair in bounds},
            }
    dead = replace(slow, measured=0.0 * slow.measured)
    told["of a dead sensor"] = [dict(start) for one in asked for start in own_starts(dead, one)]
    told["presumed"] = {name: list(pair) for name, pair in slow.presumed.items()}
    values = {"meant": [], "cost": []}
    for one in HYPOTHESES:
        if one.least:
            tried = [
                Trial((one,), SimpleNamespace(cost=3.0), {one.free[0]: share * one.least}, {}, {})  # pyright: ignore[reportArgumentType]
                for share in (0.99, -0.99, 1.0, -1.01)
            ]
            values["meant"].append([one.name, *(each.meant for each in tried)])
            values["cost"].append([one.name, *(each.cost for each in tried)])
    told |= values
    return told


@NUMBERS.case()
def steps_of_the_form_of_motion() -> dict[str, Any]:
    found = problem()
    rng = np.random.default_rng(8)
    path = np.cumsum(rng.normal(0.0, 1e-4, 600)) + 0.3
    speed = 100.0 * np.sign(np.sin(0.02 * np.arange(600)))
    told: dict[str, Any] = {
        f"{step:g} s": np.flatnonzero(np.diff(_steps(np.column_stack([speed, path]), step)))
        for step in (1e-3, 2e-3, 7e-3)
    }
    told["counts"] = [np.unique(_steps(np.column_stack([speed, path]), step)) for step in (1e-3, 2e-3, 7e-3)]
    told["set off from [rad/s]"] = edge(
        lambda jump: int(np.sum(_steps(np.column_stack([jump * (np.arange(80) > 40.0), np.arange(80.0)]), 1e-3))),
        0.0,
        99.0,
    )
    told["unseen"] = [unseen_shift(chi, samples) for chi in (0.9, 1.0, 1.05, 1.1, 1.3) for samples in (100, 20_000)]
    theta = usual(found)
    fit = replace(plain(1.0), slopes=found.slopes(theta))
    gapped = replace(found.log, gaps=np.array([[1.0, 2.0, 3.0]]))
    told["slopes that are known"] = {
        "plain": {name: some(slope) for name, slope in shared_slopes(fit, found.log).items()},
        "noisy": dict(shared_slopes(fit, seen(log(0.5, position_noise=3e-5)))),
        "with gaps": dict(shared_slopes(fit, gapped)),
    }
    told["channels"] = [SPEED in found.log.timed]
    return told


@NUMBERS.case()
def searches_of_the_form_of_motion() -> dict[str, Any]:
    rng = np.random.default_rng(5)
    speed = 100.0 * np.sign(np.sin(0.02 * np.arange(400)))
    path = np.cumsum(3e-7 * speed) + 1e-6 * rng.standard_normal(400)
    search = MotionSearch.of(
        MOTION_FORMS[0],
        motion_log(Record(1e-3, {SPEED: speed, POSITION: path}), PAPER, {}, 1e-4),
        _starts(PAPER, 2e8)[:3],
    )
    begun, theta = SharedState(), search.guesses[0]
    place = search.whole.model.unknowns.index("bulk_modulus")
    counted: Any = SimpleNamespace(
        log=SimpleNamespace(steps=np.array([3, 4])), at=lambda theta: theta, at_each=lambda thetas: thetas
    )
    work = list[int]()
    for runs in (1, 5, 20):
        begun.at_each(counted)(runs * [np.zeros(3)])
        work.append(begun.work)
    begun.at(counted)(np.zeros(7))
    begun.at(counted)(np.zeros(8))

    def point(cost: float, moved: float = 0.0) -> Point:
        shifted = theta + moved * (np.arange(len(theta)) == place)
        return Point(shifted, cost, np.zeros(len(theta)), np.eye(len(theta)))

    return {
        "work": [*work, begun.work],
        "bounds": dict(zip(search.whole.model.unknowns, np.column_stack(search.bounds).tolist(), strict=True)),
        "samples": [len(one.log.measured) for one in (search.whole, search.part, search.short)],
        "one pit up to a cost of": edge(lambda cost: search.is_same_basin(point(cost), point(100.0)), 100.0, 200.0),
        "from a cost of": edge(lambda cost: search.is_same_basin(point(cost), point(100.0)), 1.0, 100.0),
        "up to a modulus of [log]": [
            edge(lambda moved, way=way: search.is_same_basin(point(100.0, way * moved), point(100.0)), 0.0, 9.0)
            for way in (1.0, -1.0)
        ],
        "rough": [
            [one.log.noise[0].variance, one.log.noise[0].walk, int(np.sum(one.log.steps))]
            for one in (rough_problem(search.short, factors) for factors in ((1.0, 1.0), (4.0, 9.0)))
        ],
        "explained": explained_cost(search.short),
        "most work": MOST_WORK,
    }


@NUMBERS.case()
def conclusions_of_the_form_of_motion() -> dict[str, Any]:
    def told(fits: list[GreyBoxFit], *others: float, size: float = 2e8) -> dict[str, Any]:
        asked: list[Any] = []
        with patch.multiple(
            motion_fit,
            _fitted=lambda _, **__: (fits, others, False),
            search_results=lambda searches: searches,
            MotionSearch=SimpleNamespace(of=lambda _, log, starts: asked.append((log, starts))),
        ):
            found = motion_fit.fit_motion(log(0.2), PAPER, size)
        (seen_log, starts), *_ = asked
        return {
            "moduli of the starts [Pa]": sorted({float(one["bulk_modulus"]) for one in starts}),
            "position [m]": some(seen_log.measured, 3),
            "believed [Pa]": list(found.parameters["bulk_modulus"]),
            "bound": found.bound,
            "reasons": noted(found.reasons),
        }

    return {
        "sure": told([plain(50.0)]),
        "of an absurd guess": told([plain(50.0)], size=1.0),
        "others lie elsewhere": told([plain(50.0)], 2.01e8, 1.97e8),
        "two": told([plain(50.0), plain(51.0, modulus=2.02e8)]),
        "poor": told([plain(500.0, chi=1.3)]),
        "weakly held from [Pa]": edge(
            lambda std: bool(told([replace(plain(50.0), std={**plain(50.0).std, "bulk_modulus": std})])["reasons"]),
            1e5,
            1e8,
            12,
        ),
        "weakly held": told([replace(plain(50.0), std={**plain(50.0).std, "bulk_modulus": 5e6})]),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
