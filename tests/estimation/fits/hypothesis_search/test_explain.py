"""Searches of a set of hypotheses, carried to their end."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import HYPOTHESES, Hypothesis
from estimation.fits.hypothesis_search import coarse_search, conclusion, explain, final_fits, ranking, screening
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import RIVAL_DISTANCE, ROUNDS, UNBELIEVABLE_COST
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN
from estimation.fits.hypothesis_search.pump_delivery import delivery_objection
from plant.eha.model import EhaParameters
from tests.estimation.fits.short_logs import made_fit

HEALTHY = EhaParameters()

FED = {"makeup_conductance": 1e-9}


class _Made(Trial):
    """A trial whose result means what its hypotheses say."""

    @property
    def meant(self) -> bool:
        return True


def ended(costs: Sequence[float], monkeypatch: pytest.MonkeyPatch) -> tuple[float, int]:
    """Return the cost at the end of searches that reach these costs in turn, and the number of searches."""
    made: list[float] = []

    def descended(*_: Any, **__: Any) -> Any:
        made.append(costs[len(made)])
        return SimpleNamespace(cost=made[-1], point=SimpleNamespace(theta=np.zeros(1)))

    monkeypatch.setattr(final_fits, "after_descent", descended)
    monkeypatch.setattr(final_fits, "cost_over_noise", lambda *_: 1.0)
    monkeypatch.setattr(final_fits, "with_steps_where_needed", lambda one, _: one)
    problem: Any = SimpleNamespace(log=SimpleNamespace(drives=(), steps=None))
    begun: Any = SimpleNamespace(cost=np.inf)
    return final_fits._search_with_short_steps(problem, begun, np.zeros(1)).cost, len(made)  # pyright: ignore[reportPrivateUsage]


def test_a_search_continues_while_it_gains_enough_to_distinguish_hypotheses(monkeypatch: pytest.MonkeyPatch) -> None:
    costs = [9.0 * RIVAL_DISTANCE, 6.0 * RIVAL_DISTANCE, 4.5 * RIVAL_DISTANCE, 4.0 * RIVAL_DISTANCE, 0.0]
    assert ended(costs, monkeypatch) == (4.0 * RIVAL_DISTANCE, 4)


def test_a_search_without_a_gain_keeps_its_result_and_its_rounds_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    assert ended([3.0 * RIVAL_DISTANCE, 3.5 * RIVAL_DISTANCE], monkeypatch) == (3.0 * RIVAL_DISTANCE, 2)
    assert ended([-2.0 * RIVAL_DISTANCE * i for i in range(ROUNDS + 3)], monkeypatch)[1] == ROUNDS


def test_the_most_promising_set_is_searched_even_if_all_of_its_starts_are_void(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def tried(cost: float) -> Any:
        return SimpleNamespace(cost=cost, point=Point(np.zeros(1), cost, np.zeros(1), np.eye(1)), delays={})

    settled: list[float] = []
    monkeypatch.setattr(ranking, "search_coarsely", lambda _, start, *__: settled.append(start.cost) or start)
    monkeypatch.setattr(ranking, "final_fit", lambda _, one, __: one)
    monkeypatch.setattr(ranking, "is_hopeless", lambda *_: False)
    nothing: Any = SimpleNamespace(drives=())
    found = ranking.likeliest_sets(nothing, [[tried(np.inf), tried(np.inf)], [tried(9.0), tried(10.0), tried(90.0)]])
    assert [one.cost for one in found] == [9.0]
    assert settled == [np.inf, 9.0, 10.0]
    alone = ranking.likeliest_sets(nothing, [[tried(np.inf)]])
    assert [one.cost for one in alone] == [np.inf]


def relieved(setting: float, **more: Any) -> Any:
    """Return a trial of a relief valve that opens at a setting; the rig file states 3 MPa."""
    (relief,) = (one for one in HYPOTHESES if one.name == "relief_low")
    values, point = {"relief_pressure": setting}, Point(np.zeros(1), 50.0, np.zeros(1), np.eye(1))
    return Trial((relief,), point, values, {}, {"relief_pressure": 3e6}, **more)


def test_a_relief_valve_set_above_the_rig_files_is_not_set_low() -> None:
    assert [relieved(setting).cost for setting in (2.9e6, 3e6, 4e6)] == [50.0, np.inf, np.inf]


@pytest.mark.parametrize(
    ("setting", "std", "left", "void"),
    [(2e6, 1e3, 1.0, False), (2e6, np.inf, 1.0, True), (4e6, 1e3, 1.0, True), (2e6, 1e3, 0.1, True)],
)
def test_a_low_relief_setting_is_void_if_too_high_undetermined_or_with_too_small_residuals(
    setting: float, std: float, left: float, void: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = SimpleNamespace(model=SimpleNamespace(theta=lambda _: np.zeros(1)))
    fit = replace(made_fit(50.0, 2e8, 1e5, chi=left), std={"bulk_modulus": 1e5, "relief_pressure": std})
    monkeypatch.setattr(final_fits, "without_delays", lambda log, _: log)
    monkeypatch.setattr(final_fits, "with_balance", lambda log, _: log)
    monkeypatch.setattr(final_fits, "hypothesis_problem", lambda *_: problem)
    monkeypatch.setattr(final_fits, "usual_values", lambda _: {})
    monkeypatch.setattr(final_fits, "_completed_search", lambda _, tried, *__, **___: tried)
    monkeypatch.setattr(final_fits, "flow_bounds", lambda *_: (np.zeros(1), np.ones(1)))
    monkeypatch.setattr(final_fits, "fit_at_solution", lambda *_, **__: fit)
    monkeypatch.setattr(final_fits, "coarse_log", lambda *_: None)
    monkeypatch.setattr(final_fits, "balances_mass", lambda _: False)
    noisy: Any = SimpleNamespace(passes_on=True)
    found = final_fits.final_fit(noisy, relieved(setting))
    assert found.cost == (np.inf if void else 50.0)
    assert found.fit.cost == (UNBELIEVABLE_COST if void else 50.0)
    assert found.void is void


def test_starts_from_which_no_promising_hypothesis_ended_near_its_best_are_dropped() -> None:
    def each(*costs: float) -> Any:
        return [SimpleNamespace(cost=cost) for cost in costs]

    starts: Any = ["near", "near for one", "far", "near for what is far itself"]
    found = [each(100.0, 400.0, 500.0, 900.0), each(250.0, 700.0, 900.0, 900.0), each(950.0, 950.0, 950.0, 950.0)]
    assert screening.promising_starts(starts, found) == ["near", "near for one"]
    vain = [each(np.inf, np.inf, np.inf, np.inf)]
    assert screening.promising_starts(starts, vain) == starts


@pytest.mark.parametrize(("explains", "asked"), [(True, "likely far"), (False, "likely far hidden")])
def test_all_other_pairs_are_tested_if_the_likely_ones_do_not_explain_the_log(
    explains: bool, asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hypothesis(name: str, **more: Any) -> Any:
        return SimpleNamespace(name=name, far=False, **more)

    likely, far, hidden = hypothesis("likely"), SimpleNamespace(name="far", far=True), hypothesis("hidden")
    begun: list[tuple[str, Any]] = []
    costs = {"likely": 80.0, "far": 90.0, "hidden": 70.0, "first": 100.0}

    def led(_: Any, together: Any, starts: Any, wanted: float = np.inf, *_more: Any, **__: Any) -> Any:
        begun.append((together[-1].name, list(starts)))
        return [SimpleNamespace(together=together, cost=costs[together[-1].name], wanted=wanted)]

    def finished(_: Any, one: Any, *__: Any) -> Any:
        point, void = Point(np.zeros(1), one.cost, np.zeros(1), np.eye(1)), False
        return _Made(one.together, point, {}, {"late": 1e-3}, {}, (made_fit(one.cost, 2e8, 1e5),), void)

    monkeypatch.setattr(explain, "without_delays", lambda log, _: log)
    monkeypatch.setattr(explain, "by_predicted_gain", lambda *_: ([likely], [far, hidden], {}))
    monkeypatch.setattr(explain, "own_starts", lambda *_: [{"offset": 1e5}])
    monkeypatch.setattr(
        coarse_search, "usual_values", lambda _: {"leakage_coefficient": 5e-12, "flow_bias": 2e-6} | FED
    )
    monkeypatch.setattr(explain, "screen", led)
    monkeypatch.setattr(explain, "decimation_for", lambda *_: 1)
    monkeypatch.setattr(explain, "cost_over_noise", lambda *_: 1.0)
    monkeypatch.setattr(ranking, "search_coarsely", lambda _, start, *__: start)
    monkeypatch.setattr(ranking, "final_fit", finished)
    monkeypatch.setattr(ranking, "is_hopeless", lambda *_: False)
    nothing: Any = SimpleNamespace(drives=())
    at_end = {"leakage_coefficient": 1e-12, "flow_bias": 1e-6, "offset": 3e4, **FED}
    coarse = {"leakage_coefficient": 1e-29, "flow_bias": 3e-6, "offset": 4e4, **FED}
    place = Point(np.zeros(1), 100.0, np.zeros(1), np.eye(1))
    first = _Made(
        (hypothesis("first"),), place, at_end, {"speed": 2e-3}, {}, (made_fit(100.0, 2e8, 1e5),), coarse=coarse
    )
    found = explain._hypothesis_pairs(nothing, first, {"leakage_coefficient": 2e-12}, lambda _: explains)  # pyright: ignore[reportPrivateUsage]
    assert [name for name, _ in begun] == asked.split()
    # starts: the end of its search with long steps, with leakage restored, and the start of that search
    revived = {"leakage_coefficient": 5e-12, "flow_bias": 3e-6, "offset": 4e4, **FED}
    assert all(starts == [revived, {"leakage_coefficient": 2e-12, "offset": 1e5}] for _, starts in begun)
    assert found[0].together[-1].name == asked.split()[-1 if not explains else 0]
    assert found[0].delays == {"speed": 2e-3, "late": 1e-3}


@pytest.mark.parametrize(
    ("second", "least", "chi", "hopeless", "beside", "names", "rivals"),
    [
        (105.0, 60.0, 5.0, 101.0, "worn relief", ("worn", "late"), 2),
        (120.0, 60.0, 2.0, 101.0, "relief", ("relief", "late"), 1),  # the second is clearly worse
        (105.0, 40.0, 5.0, 101.0, "relief", ("relief", "late"), 1),  # nothing explains the log
        (105.0, 40.0, 2.0, 101.0, "worn relief", ("worn", "late"), 2),  # nothing explains it either, but little is left
        (105.0, 60.0, 2.0, 100.0, "", ("relief",), 0),  # the best alone explains next to nothing
    ],
)
def test_pairs_are_also_tested_with_a_nearly_equally_good_hypothesis(
    second: float,
    least: float,
    chi: float,
    hopeless: float,
    beside: str,
    names: tuple[str, ...],
    rivals: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def tried(cost: float, *together: str) -> Any:
        point, fit = Point(np.zeros(1), cost, np.zeros(1), np.eye(1)), made_fit(cost, 2e8, 1e5, chi=chi)
        fit = replace(fit, std=dict.fromkeys(fit.values, 1.0))
        return _Made(tuple(Hypothesis(name, (name,)) for name in together), point, {}, {}, {}, (fit,))

    asked: list[str] = []

    def paired(_: Any, first: Any, *__: Any, **___: Any) -> Any:
        asked.append(first.together[0].name)
        own = [tried(50.0, "relief", "late")] if asked[-1] == "relief" else [tried(48.0, "worn", "late")]
        return [*own, tried(51.0, *(["relief", "worn"] if asked[-1] == "relief" else ["worn", "relief"]))]

    monkeypatch.setattr(explain, "widened_log", lambda *_: None)
    monkeypatch.setattr(explain, "with_balance", lambda *_: None)
    monkeypatch.setattr(explain, "by_predicted_gain", lambda *_: ([], [], {}))
    monkeypatch.setattr(explain, "_single_hypotheses", lambda *_, **__: [tried(100.0, "relief"), tried(second, "worn")])
    monkeypatch.setattr(explain, "_plain_point", lambda *_: Point(np.zeros(1), 1.0, np.zeros(1), np.eye(1)))
    monkeypatch.setattr(explain, "decimation_for", lambda *_: 1)
    monkeypatch.setattr(explain, "cost_over_noise", lambda *_: chi)
    monkeypatch.setattr(explain, "_hypothesis_pairs", paired)
    monkeypatch.setattr(explain, "with_delivery", lambda *_: [])
    monkeypatch.setattr(explain, "fit_of_delivery", lambda *_: [])
    monkeypatch.setattr(explain, "without_vanished_effect", lambda _, tried: tried)
    monkeypatch.setattr(conclusion, "likelihood_mean", lambda *_, **__: {})
    monkeypatch.setattr(conclusion, "usual_pressure", lambda *_: 0.0)
    monkeypatch.setattr(conclusion, "delivery_beside", lambda *_: NO_GAIN)
    monkeypatch.setattr(explain, "EQUAL_DISTANCE", 4.0)
    nothing: Any = None
    found = explain.explain(nothing, nothing, [{}], lambda fit: fit.cost < least, hopeless=hopeless)
    assert found is not None
    assert " ".join(sorted(asked, reverse=True)) == beside
    assert found.names == names
    # the pair of the two single hypotheses is found twice and counts once
    assert len(found.rivals) == rivals


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.5, True), (0.59, True), (0.61, False), (0.8, False), (1.0, False), (1.24, False), (1.26, True), (2.0, True)],
)
def test_a_delivery_beyond_wear_and_rounding_of_the_rig_file_is_objected_to(share: float, said: bool) -> None:
    displacement = share * HEALTHY.pump_displacement
    found: Any = SimpleNamespace(values={"pump_displacement": (displacement, 0.01 * displacement)})
    objections = delivery_objection(found, HEALTHY)
    assert [note.data["percent"] for note in objections] == pytest.approx([100.0 * share] * said)
    other: Any = SimpleNamespace(values={"pressure_offset": (1e5, 1e3)})
    assert delivery_objection(other, HEALTHY) == ()


def test_a_smaller_set_of_hypotheses_replaces_all_larger_sets_that_contain_it() -> None:
    """Another pair that contained it cost less, by less than a hypothesis must gain, and was reported instead."""

    def ended(cost: float, *together: Hypothesis) -> Trial:
        return Trial(
            together, Point(np.zeros(1), cost, np.zeros(1), np.eye(1)), {}, {}, {}, (made_fit(cost, 2e8, 1e5),)
        )

    air, leak, late = HYPOTHESES[:3]
    finished = [ended(100.0, air, leak), ended(101.0, air, late), ended(130.0, leak)]
    fewer = ended(105.0, air)
    leaner = explain._with_smaller_set  # pyright: ignore[reportPrivateUsage]
    assert leaner(fewer, finished, lambda _: True) == [fewer, finished[2]]
    assert leaner(fewer, finished, lambda _: False) == finished
    assert leaner(finished[0], finished, lambda _: True) == finished
