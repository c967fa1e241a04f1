"""A hypothesis that leads out of a wrong minimum of the plain form, and whose effect then vanishes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import hydrostate
from benchmarks.diagnosis.rig_draws import draw_bench
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import plain as plain_flow
from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.flow.log import STIFFEST_OIL, flow_log, without_strays
from estimation.fits.flow.other_minimum import lower_end, lower_minimum
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import PORTS_DRAIN
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import MASS_FLOW_FORM, STIFFNESS
from estimation.models.inner_circuit import BEND
from experiments.open_benchmark.kinds import make
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER, log

WRONG = 200.0
STARTS = flow_starts(PAPER, PAPER.bulk_modulus)


@cache
def seen() -> GreyBoxLog:
    record, variances = without_strays(log(1.0))
    return flow_log(record, PAPER, {}, variances)


@cache
def right() -> Sequence[GreyBoxFit]:
    return balance_fits(seen(), PAPER, STARTS)


def best() -> GreyBoxFit:
    return min(right(), key=lambda fit: fit.cost)


def found(shift: float = 1.0) -> dict[str, tuple[float, float]]:
    values = {name: (shift * value, 1.0) for name, value in best().values.items()}
    return {**{name: pair for name, pair in values.items() if name not in CRACKS}, "drain_share_a": (1.01, 0.02)}


@pytest.mark.parametrize(("wanted", "lower"), [(1.0, True), (-1.0, False)])
def test_a_start_from_a_hypothesis_is_returned_only_if_it_reaches_the_wanted_cost(
    wanted: float, *, lower: bool
) -> None:
    near = found(1.001)
    valley = lower_minimum(seen(), PAPER, best(), near, best().cost + wanted)
    absent = dict.fromkeys((*CRACKS, BEND), 0.0)
    assert valley is None or valley == {name: value for name, (value, _) in near.items()} | absent
    assert (valley is not None) == lower


def test_unknowns_absent_from_the_hypothesis_keep_their_plain_values() -> None:
    lacking = {name: pair for name, pair in found().items() if name != "speed_lead"}
    valley = lower_minimum(seen(), PAPER, best(), lacking, np.inf)
    assert valley is not None
    assert valley["speed_lead"] == best().values["speed_lead"]


@pytest.mark.parametrize(("behind", "bend", "led"), [(WRONG, None, True), (-WRONG, None, False), (WRONG, 3e-5, False)])
def test_an_incomplete_form_restarts_only_at_a_lower_cost_without_orifice_valves(
    behind: float, bend: float | None, *, led: bool
) -> None:
    """Otherwise make-up valves that act as orifices would be absorbed without being named."""
    form = replace(best().model, unknowns=tuple(name for name in best().model.unknowns if name not in CRACKS))
    bare = {name: value for name, value in best().values.items() if name not in CRACKS}
    far = replace(best(), model=form, values=bare, cost=best().cost + behind)
    told = found() if bend is None else found() | {BEND: (bend, 1e-6)}
    assert (lower_minimum(seen(), PAPER, far, told, np.inf) is not None) == led


def test_no_lower_minimum_is_sought_in_a_log_with_gaps() -> None:
    gapped = replace(seen(), gaps=np.zeros((1, 2)))
    assert lower_minimum(gapped, PAPER, best(), found(), np.inf) is None


def test_a_search_that_is_given_a_lower_minimum_ends_there(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = best()  # fitted before the search is patched, as other tests use it too
    monkeypatch.setattr("estimation.fits.flow.search._final_optimum", unmoved)
    lost = balance_fits(seen(), PAPER, STARTS)
    led = balance_fits(seen(), PAPER, STARTS, {**sound.values, "bulk_modulus": 1.001 * sound.values["bulk_modulus"]})
    assert min(fit.cost for fit in lost) > sound.cost + 1.0
    assert min(fit.cost for fit in led) == pytest.approx(sound.cost, abs=0.5)  # fitted without cracking pressures


def unmoved(one: Any, log: GreyBoxLog, wanted: float = np.inf, **_: Any) -> Any:  # noqa: ARG001 -- as it is called
    """Return a form with bulk modulus some percent off its optimum, as if it had a minimum there."""
    problem, theta = one.problem.on(log), one.point.theta.copy()
    theta[0] += 0.05
    return problem, problem.at(theta), one.bounds


@pytest.mark.parametrize("lost", [True, False])
def test_a_failed_search_restarts_from_one_that_lost_its_leakage_with_leakage_restored(*, lost: bool) -> None:
    """A search with the mass balance ended at 24 times the noise and no leakage, from where no search returns."""
    problem = FreedProblem.of(MASS_FLOW_FORM, seen())
    known = {STIFFNESS: first_stiffness(seen()), **best().values}
    ended = problem.at(MASS_FLOW_FORM.theta({**known, "leakage_coefficient": 1e-26}))
    far = (
        problem.at(MASS_FLOW_FORM.theta({**known, "bulk_modulus": 5e8}))
        if lost
        else problem.at(MASS_FLOW_FORM.theta(known))
    )
    bounds = flow_bounds(MASS_FLOW_FORM, [far.theta], seen())
    point = lower_end((problem, far, bounds), (problem, ended, bounds), STARTS[0])
    values = MASS_FLOW_FORM.values(point.theta)
    assert (point is not far) == lost
    assert values["leakage_coefficient"] > 1e-13
    assert values["bulk_modulus"] == pytest.approx(known["bulk_modulus"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1319, 1392])
def test_bulk_modulus_is_right_with_a_small_accumulator_or_a_search_that_lost_leakage(seed: int) -> None:
    bench = draw_bench(seed)
    answer = estimate_bulk_modulus(bench.record, bench.healthy)
    assert answer.gate.passed
    assert answer.explanation is None
    assert answer.value == pytest.approx(bench.true.bulk_modulus, abs=2.0 * (answer.std or 0.0))


@pytest.mark.parametrize(("cost", "believed"), [(0.0, "plain"), (-50.0, "hypothesis")])
def test_a_hypothesis_is_accepted_only_if_it_gains_over_the_plain_form_in_its_minimum(
    cost: float, believed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plain log was called unknown because of a drain of port A that had turned into that of port B."""
    told: list[Mapping[str, float] | None] = []

    def lost(
        _: GreyBoxLog,
        parameters: EhaParameters,
        starts: object,
        valley: Mapping[str, float] | None = None,
        stiffest: float = STIFFEST_OIL,
    ) -> Sequence[GreyBoxFit]:
        assert stiffest == STIFFEST_OIL  # noise of motor speed is that for the oil found, up to this
        assert parameters is PAPER
        assert starts
        told.append(valley)
        return right() if valley else [replace(fit, cost=fit.cost + WRONG) for fit in right()]

    def asked(*given: Any, **_: object) -> Any:
        return (PORTS_DRAIN[:1] if given[2].cost > best().cost + 1.0 or believed == "hypothesis" else (), ())

    fit = replace(best(), cost=best().cost + cost)
    explanation = Explanation(("port_a_drains",), found(), {}, (fit,), (), 1e6)
    monkeypatch.setattr(plain_flow, "balance_fits", lost)
    monkeypatch.setattr(flow_fit, "hypotheses_asked", asked)
    monkeypatch.setattr(flow_fit, "explain", lambda *_, **__: explanation)
    answer = flow_fit.fit_flow(log(1.0), PAPER, PAPER.bulk_modulus)
    assert (answer.explanation is None) == (believed == "plain")
    assert (told[-1] is not None) == (believed == "plain")


@pytest.mark.slow
def test_a_plain_log_with_two_minima_of_the_plain_form_is_explained_by_the_lower_one() -> None:
    made = make("plain", "training", 667)
    answer = flow_fit.fit_flow(Record.from_frame(made.log), PAPER, PAPER.bulk_modulus)
    assert answer.explanation is None
    value, std = answer.parameters["bulk_modulus"]
    assert value == pytest.approx(made.bulk_modulus[0], abs=2.0 * std)
    assert answer.parameters["case_leakage"][0] == pytest.approx(made.setup.machine.drain, rel=0.3)


def test_the_drain_of_a_chamber_that_a_load_shuts_in_is_also_searched_from_below() -> None:
    """In the minimum with fourteen times the drain, leakage was twelve deviations off."""
    made = make("constant_load", "validation", 17804)
    answer = flow_fit.fit_flow(Record.from_frame(made.log), PAPER, PAPER.bulk_modulus)
    value, std = answer.parameters["leakage_coefficient"]
    assert value == pytest.approx(made.setup.machine.leakage, abs=2.0 * std)
    assert value == pytest.approx(made.setup.machine.leakage, rel=1.5e-3, abs=0.0)


@pytest.mark.slow
def test_no_air_is_reported_in_a_plain_log_whose_search_ended_far_off() -> None:
    """Air was found that enters after the end of the log, `0 ± inf %`, and bleeding was advised."""
    made = hydrostate.simulate("minor_leakage", drive="steps", duration=5.0, sample_time=1e-4, seed=2)
    answer = flow_fit.fit_flow(made.record, PAPER, PAPER.bulk_modulus)
    assert answer.explanation is None
    value, std = answer.parameters["bulk_modulus"]
    assert value == pytest.approx(PAPER.bulk_modulus, abs=2.0 * std)
