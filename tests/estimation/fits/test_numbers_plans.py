"""Plans of searches: their order, number of steps and part of the log, kept in `numbers_plans.json`.

Descents are replaced by ones that stay where they begin, so that only the plan is computed.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from estimation.fits.flow import rough_search
from estimation.fits.flow import search as flow_search
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox import fit as greybox_fit
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import ASKED, Asked
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.parallel_descents import Way
from estimation.fits.greybox.spared_steps import LAST_EVALUATIONS
from estimation.fits.hypotheses import HYPOTHESES
from estimation.fits.hypothesis_search import coarse_search, explain, final_fits, predicted_gains, screening
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion import force_scale
from estimation.fits.motion import search as motion_search
from estimation.fits.motion.fit import _fitted, _starts
from estimation.fits.motion.log import motion_log
from estimation.fits.motion.search import MotionSearch, search_results
from estimation.models.motion import MOTION_FORMS
from plant.arrays import Array
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
Cost = Callable[[int], float]


def still(theta: Array, cost: float) -> Point:
    """Return a point of a misfit whose slopes are zero."""
    return Point(theta, cost, np.zeros(len(theta)), np.eye(len(theta)))


@contextmanager
def planned(cost: Cost, *modules: Any) -> Iterator[list[list[float]]]:
    """Record evaluations, samples, steps, noise and radius of each descent, which stays where it begins.

    The cost of a descent depends on its number in the order of descents. A descent that finishes another one with all
    short steps keeps the cost of that one.
    """
    plan: list[list[float]] = []
    led: list[tuple[Array, float, bool]] = []
    endings: list[int] = []

    def descended(at: Any, start: Array, evaluations: int, *others: Any, **named: Any) -> Point:
        if not plan:
            endings.clear()
        one = (at.args[0] if isinstance(at, partial) else at.__self__).log
        noise = [one.noise[0].variance, one.noise[0].walk]
        rest = [other for other in others[1:] if isinstance(other, float)]
        plan.append([evaluations, len(one.measured), int(np.max(one.steps)), *noise, *rest, *named.values()])
        few, short = bool(np.min(one.steps[1:]) == 1), np.max(one.steps) > 1
        ended = [
            cost for theta, cost, sparing in led if theta is start and (sparing or evaluations == LAST_EVALUATIONS)
        ]
        if ended and not few:
            endings.append(len(plan))
            return still(start, min(ended[-2:]))
        point = still(start, cost(len(plan) - len(endings)))
        if short:
            led.append((start, point.cost, few))
        return point

    def together(at: Any, starts: Sequence[Array], evaluations: int, *others: Any, **named: Any) -> list[Point]:
        return [descended(at, start, evaluations, *others, **named) for start in starts]

    def in_turn(
        ways: Sequence[Way], evaluations: int, wanted: float, after: Callable[[int, Point], float], **named: float
    ) -> list[Point]:
        found: list[Point] = []
        for i, way in enumerate(ways):
            rest = {"radius": named["radius"], "wanted": wanted, "least_share": named["least_share"]}
            found.append(descended(way.at_each, way.start, evaluations, way.bounds, **rest))
            wanted = min(wanted, after(i, found[-1]))
        return found

    fakes = {"descend": descended, "descend_together": together, "descend_in_turn": in_turn}
    with ExitStack() as stack:
        for module in modules:
            for name, fake in fakes.items():
                if hasattr(module, name):
                    stack.enter_context(patch.object(module, name, fake))
        stack.enter_context(patch.object(FreedProblem, "at", lambda _, theta: still(theta, 1e9)))
        yield plan


def grouped(plan: list[list[float]]) -> list[list[Any]]:
    """Return consecutive equal descents as one, with their count."""
    told: list[list[Any]] = []
    for one in plan:
        if told and told[-1][1] == one:
            told[-1][0] += 1
        else:
            told.append([1, one])
    return told


@NUMBERS.case()
def plan_of_the_form_of_motion() -> dict[str, Any]:
    rng = np.random.default_rng(5)
    samples = 12000
    speed = 100.0 * np.sign(np.sin(0.003 * np.arange(samples)))
    long = Record(
        1e-3, {"motor_speed_rad_s": speed, "position_m": np.cumsum(3e-7 * speed) + 1e-6 * rng.standard_normal(samples)}
    )
    whole = motion_log(long, PAPER, {}, 1e-4)
    told: dict[str, Any] = {}
    for name, cost in (
        ("nothing comes close", lambda k: 1e7 + k),
        ("nothing explains the first seconds", lambda k: 3000.0 + k),
        ("the first explains it", lambda k: 100.0 + k),
        ("the second explains it", lambda k: 3000.0 + k if k < 20 else 100.0 + k),
        ("the first seconds alone are explained at first", lambda k: 6000.0 if k % 6 == 1 else 100.0),
    ):
        with planned(cost, motion_fit, motion_search, force_scale) as plan:
            ended = search_results([MotionSearch.of(form, whole, _starts(PAPER, 2e8)[:4]) for form in MOTION_FORMS])
            told[name] = {"descents": grouped(plan), "explains": [one.explains for one in ended]}
            plan.clear()
            with patch.object(motion_fit, "fit_at_solution", lambda _, point: point):
                found, others, _ = _fitted(ended)
            told[name] |= {
                "descents of the fit": grouped(plan),
                "costs": [float(one.cost) for one in found],
                "others": len(others),
            }
    return told


@NUMBERS.case()
def plan_of_explanations() -> dict[str, Any]:
    told: dict[str, Any] = {}
    short = seen(log(0.5))
    asked = [one for one in HYPOTHESES if one.name in ("pressure_late", "pressure_offset", "relief_low", "volume")]
    promises = [predicted_gains.PredictedGain(float(gain), 1.0, 1.0) for gain in range(len(HYPOTHESES))]
    costs = {
        "all alike": lambda _: 1000.0,
        "one is better": lambda k: 1000.0 - 10.0 * (k % 7 == 0),
        "one is far better": lambda k: 1000.0 - 900.0 * (k % 7 == 0),
    }

    def promised(_: Any, __: Any, ___: Any, given: Sequence[Any], **_more: object) -> list[Any]:
        return promises[: len(given)]

    def concluded(_: Any, point: Point, **_told: object) -> Any:
        fit = made_fit(point.cost, 2e8, 1e6)
        return replace(fit, std={**fit.std, "relief_pressure": 1e3})

    for name, cost in costs.items():
        with (
            planned(cost, explain, screening, coarse_search, final_fits) as plan,
            patch.object(predicted_gains, "_predicted_gains_beside", promised),
            patch.object(final_fits, "fit_at_solution", concluded),
        ):
            for paired in (False, True):
                plan.clear()
                found = explain.explain(
                    short, PAPER, flow_starts(PAPER, 2e8)[:3], lambda _: False, asked=asked, paired=paired
                )
                assert found is not None
                told[f"{name}, paired: {paired}"] = {
                    "descents": grouped(plan),
                    "names": list(found.names),
                    "rivals": len(found.rivals),
                    "delays": dict(found.delays),
                }
    return told


@NUMBERS.case()
def plan_of_the_flow_form() -> dict[str, Any]:
    told: dict[str, Any] = {}

    def concluded(_: Any, point: Point, asked: Asked = ASKED, **_beside: Any) -> Any:
        return [point.cost, asked.disturbed]

    for name, one in {"plain": seen(log(0.5)), "noisy position": seen(log(0.5, position_noise=3e-5))}.items():
        for kind, cost in (
            ("explained at once", lambda k: 10.0 + k),
            ("never explained", lambda k: 1e5 + k),
            ("others are rivals", lambda k: 1e5 + 65.0 * (k % 3)),
            ("others are unlikely", lambda k: 1e5 + 80.0 * (k % 3)),
            ("some are disturbed", lambda k: 1e5 + 30.0 * (k % 3)),
        ):
            with (
                planned(cost, flow_search, rough_search, greybox_fit) as plan,
                patch.object(flow_search, "fit_at_solution", concluded),
                patch.object(FreedProblem, "costs", lambda _, thetas, _lanes: np.arange(len(thetas))),
                patch.object(flow_search, "map_cases", lambda work, items: [work(item) for item in items]),
                patch.object(rough_search, "map_cases", lambda work, items: [work(item) for item in items]),
                patch.object(greybox_fit, "map_cases", lambda work, items: [work(item) for item in items]),
            ):
                found = flow_search.balance_fits(one, PAPER, flow_starts(PAPER, 2e8)[:3])
            told[f"{name}, {kind}"] = {"descents": grouped(plan), "costs and whether disturbed": found}
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
