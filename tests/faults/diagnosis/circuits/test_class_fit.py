"""A circuit is fitted to a log by steps along the gradient of its log-posterior."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits import class_fit
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import FARTHEST, LASTING, WEAK_PRIOR, _best_gain, fit_freely, misfit
from plant.arrays import Array
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
PULL = np.asarray(LASTING * np.linalg.inv(WEAK_PRIOR))
CENTRE = ACTUATOR.conditions[0]
APART = np.array([0.05, -0.05, 0.08, 0.04, 0.03, 0.05, 0.02])


@cache
def log() -> Blocks:
    """Return a log, without noise, of a circuit that differs from the healthy one."""
    speed = np.repeat([60.0, 120.0, -120.0, -70.0], 500)
    empty = np.zeros(len(speed) // 10)
    blank = Blocks(np.append(speed, speed[-1]), 1e-3, 10, empty, empty, np.array([1e-4, 2e3]))
    (found,) = predicted_outputs(blank, parameter_rows((CENTRE + APART)[None], ACTUATOR.circuit, ACTUATOR.rated))
    return replace(blank, velocity=found[:, 0], pressure=found[:, 1])


def cost(point: Array) -> float:
    return class_fit._fit_at(log(), ACTUATOR, CENTRE, point, PULL).cost


def test_a_step_follows_the_gradient_of_the_log_posterior() -> None:
    start = CENTRE + 0.4 * APART
    here = class_fit._fit_at(log(), ACTUATOR, CENTRE, start, PULL)
    step = class_fit._step(log(), here, CENTRE, PULL)
    sides = 1e-3 * np.eye(7)
    downward = np.array([cost(start - side) - cost(start + side) for side in sides]) / 2e-3
    assert (here.information + PULL) @ step == pytest.approx(downward, rel=0.0, abs=0.015 * np.abs(downward).max())


def test_only_a_step_longer_than_the_limit_is_shortened() -> None:
    here = class_fit._fit_at(log(), ACTUATOR, CENTRE, CENTRE, PULL)
    left = (log().outputs - here.fitted)[log().first :] / here.scales**2
    whole = np.linalg.solve(here.information + PULL, np.einsum("ink,nk->i", here.slopes[:, log().first :], left))
    far = replace(here, slopes=here.slopes / 100.0, information=here.information / 1e4)
    assert class_fit._step(log(), here, CENTRE, PULL) == pytest.approx(whole)
    assert np.abs(class_fit._step(log(), far, CENTRE, 1e-9 * PULL)).max() == pytest.approx(FARTHEST)


@pytest.mark.parametrize("bend", [0.5, 3.0, 40.0])
@pytest.mark.parametrize("reach", [1.0, 0.3, 0.09])
def test_the_best_gain_along_a_step_is_the_vertex_of_the_parabola_through_the_tried_step(
    bend: float, reach: float
) -> None:
    promised = 1.5

    def gained(share: float) -> float:
        return 2.0 * promised * share - bend * share**2  # its slope at the start of the step is twice the promised gain

    best = max(gained(share) for share in np.linspace(0.0, 4.0, 40_001))
    assert _best_gain(promised, reach, gained(reach)) == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize("pulled", [1.0, 1e3])
def test_a_whole_step_promises_half_the_gain_of_its_slope(pulled: float) -> None:
    pull = pulled * PULL
    here = class_fit._fit_at(log(), ACTUATOR, CENTRE, CENTRE + 0.4 * APART, pull)
    information = here.information + pull
    step = np.linalg.solve(information, class_fit._posterior_slope(log(), here, CENTRE, pull))
    promised = class_fit._promised_gain(log(), here, CENTRE, pull, step)
    assert promised == pytest.approx(0.5 * step @ information @ step)
    for share in (0.5, 1.5):  # a shorter or longer step gains less
        other = class_fit._promised_gain(log(), here, CENTRE, pull, share * step)
        assert other == pytest.approx((2.0 * share - share**2) * promised)


def test_the_circuit_that_made_a_log_is_recovered() -> None:
    found = fit_freely(log(), ACTUATOR, next(iter(CONDITIONS)), gained=1e-3)
    off = found.coordinates - CENTRE - APART
    # the weak prior shifts leakage and bias against each other
    assert found.cost <= cost(CENTRE + APART) < cost(CENTRE)
    assert float(off @ found.information @ off) < class_fit.LASTING  # within one deviation
    assert off[2:5] == pytest.approx(0.0, abs=0.02)


def test_misfit_is_the_log_of_residuals_and_infinite_for_a_diverged_model() -> None:
    off = log().outputs + np.array([1e-3, 1e5])
    assert misfit(log(), np.where(np.arange(len(off))[:, None] == 70, np.inf, off)) == np.inf
    count = len(off) - log().first
    twice = misfit(log(), log().outputs + np.array([2e-3, 3e5])) - misfit(log(), off)
    assert twice == pytest.approx(count * (np.log(2.0) + np.log(3.0)))


def test_the_search_stays_at_its_start_if_the_log_has_no_gradient() -> None:
    nothing = replace(log(), pressure=np.full(len(log().velocity), np.nan))
    with warnings.catch_warnings(action="ignore", category=RuntimeWarning):
        found = fit_freely(nothing, ACTUATOR, next(iter(CONDITIONS)))
    np.testing.assert_array_equal(found.coordinates, CENTRE)


@pytest.mark.parametrize(("below", "ends"), [(1e6, True), (-20.0 * LASTING, False)])
def test_a_search_ends_after_two_runs_if_it_cannot_reach_the_wanted_cost(below: float, ends: bool) -> None:
    at = list(CONDITIONS).index("minor_leakage")
    start = ACTUATOR.conditions[at] + 0.2
    whole = fit_freely(log(), ACTUATOR, "minor_leakage", start)
    runs: list[int] = []
    with pytest.MonkeyPatch.context() as patch:
        real = class_fit._fit_at
        patch.setattr(class_fit, "_fit_at", lambda *args: runs.append(1) or real(*args))
        there = fit_freely(log(), ACTUATOR, "minor_leakage", start, wanted=whole.cost - below)
    assert (len(runs) <= 2) == ends
    assert (there.cost == whole.cost) == (not ends)


def test_a_search_from_the_same_start_reuses_the_runs_of_an_earlier_one() -> None:
    blocks, name, runs = replace(log()), "minor_leakage", list[int]()
    with pytest.MonkeyPatch.context() as patch:
        real = class_fit.predicted_outputs
        patch.setattr(class_fit, "predicted_outputs", lambda *args: runs.append(1) or real(*args))
        roughly = fit_freely(blocks, ACTUATOR, name, gained=10.0)
        count = len(runs)
        thorough = fit_freely(blocks, ACTUATOR, name, ACTUATOR.conditions[list(CONDITIONS).index(name)], gained=10.0)
    assert count == len(runs) > 1
    np.testing.assert_array_equal(thorough.coordinates, roughly.coordinates)


def test_runs_of_nominal_circuits_are_cached_and_read_only() -> None:
    first = class_fit.nominal_runs(log(), ACTUATOR)
    assert class_fit.nominal_runs(log(), ACTUATOR) is first
    assert not first.flags.writeable
    others = replace(ACTUATOR, conditions=ACTUATOR.conditions + 0.1)
    assert not np.array_equal(class_fit.nominal_runs(log(), others), first)


def test_a_search_ends_if_a_step_promises_too_little() -> None:
    start = ACTUATOR.conditions[list(CONDITIONS).index("minor_leakage")] + 0.2
    first = class_fit._fit_at(
        log(), ACTUATOR, ACTUATOR.conditions[list(CONDITIONS).index("minor_leakage")], start, PULL
    )
    assert fit_freely(log(), ACTUATOR, "minor_leakage", start, promising=1e9).cost == pytest.approx(first.cost)
    assert fit_freely(log(), ACTUATOR, "minor_leakage", start, promising=1.0).cost < first.cost - 1.0
