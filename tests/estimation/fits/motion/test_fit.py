from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion import search as motion_search
from estimation.fits.motion.fit import fit_motion
from estimation.fits.motion.log import motion_log
from estimation.fits.motion.search import MotionSearch, SearchResult, SharedState, search_results
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.motion import MOTION_FORMS, UNKNOWNS
from estimation.notes import EstimateCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, simulate
from plant.errors import LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()


def short_log(seconds: float, seed: int = 1, sample_time: float = 1e-3) -> Record:
    """Return a log of the healthy actuator under steps, without pressure."""
    speed = make_drive("steps", seconds, sample_time, HEALTHY, np.random.default_rng(seed))
    rng = np.random.default_rng(seed + 100)
    run = simulate(PLANTS["lumped"], speed, sample_time, HEALTHY, sensors=BENCH, rng=rng)
    return run.replace(differential_pressure_pa=None)


def seen(record: Record, speed_variance: float = 1e-4) -> GreyBoxLog:
    return motion_log(record, HEALTHY, {}, speed_variance)


def heard(record: Record) -> GreyBoxLog:
    """Return a log with the noise of its motor speed."""
    return seen(record, measurement_variances(record, ("motor_speed_rad_s",))["motor_speed_rad_s"])


def searches_of(log: GreyBoxLog) -> list[MotionSearch]:
    starts = motion_fit._starts(HEALTHY, HEALTHY.bulk_modulus)
    return [MotionSearch.of(form, log, starts) for form in MOTION_FORMS]


def fine_searches(monkeypatch: pytest.MonkeyPatch, seconds: float = 2.0) -> list[MotionSearch]:
    """Return the searches of a log with steps short enough for a stiff bristle, and no shorter ones at their end."""
    monkeypatch.setattr(motion_fit, "without_chatter", lambda problem, _: problem)
    log = heard(short_log(seconds))
    return searches_of(replace(log, steps=np.where(log.steps == np.max(log.steps), 4 * log.steps, log.steps)))


@pytest.fixture(scope="module")
def healthy() -> FormFit:
    """Return the fit of two seconds of a healthy actuator, from a first guess of twice the value."""
    return fit_motion(short_log(2.0), HEALTHY, 2.0 * HEALTHY.bulk_modulus, {"piston_area": 0.01})


def test_two_seconds_without_pressure_give_the_bulk_modulus(healthy: FormFit) -> None:
    value, std = healthy.parameters["bulk_modulus"]
    assert value == pytest.approx(HEALTHY.bulk_modulus, abs=3.0 * std)
    assert 0.005 < std / value < 0.03
    assert healthy.reasons == ()
    assert healthy.chi_square < motion_fit.EXPLAINED


def test_the_deviation_includes_noise_and_the_error_of_the_friction_law(healthy: FormFit) -> None:
    value, std = healthy.parameters["bulk_modulus"]
    least = np.hypot(healthy.bound, motion_fit.STRUCTURE)
    assert least <= std / value <= np.hypot(least, motion_fit.LARGEST_UNSEEN_SHIFT)


def test_the_slope_of_bulk_modulus_by_an_uncertain_piston_area_is_returned(healthy: FormFit) -> None:
    assert set(healthy.rig_slopes) == {"piston_area"}
    assert abs(healthy.rig_slopes["piston_area"]["bulk_modulus"]) > 1e-3 * HEALTHY.bulk_modulus


def test_a_shaken_position_is_not_explained() -> None:
    record = short_log(0.5)
    shaken = record["position_m"] + 2e-5 * np.sin(0.2 * np.arange(len(record["position_m"])))
    fit = fit_motion(record.replace(position_m=shaken), HEALTHY, HEALTHY.bulk_modulus)
    (large,) = (note for note in fit.reasons if note.code == EstimateCode.POSITION_RESIDUALS_LARGE)
    assert large.data["ratio"] == pytest.approx(fit.chi_square**0.5)
    assert large.data["ratio"] > 10.0
    assert large.data["motion_percent"] > 10.0


def test_residuals_are_compared_with_the_motion_over_the_memory_of_speed_noise() -> None:
    still = seen(Record(1e-3, {"motor_speed_rad_s": np.ones(1000), "position_m": np.zeros(1000)}))
    moving = replace(still, measured=4e-5 * np.arange(1000.0)[:, None], noise=(OutputNoise(2.56e-12, 1e-11),))
    moving.measured[500] = np.nan
    assert motion_fit.share_of_motion(100.0, moving) == pytest.approx(1.6e-5 / (16.0 * 4e-5))
    # without drift all motion counts, here that of half the log
    surer = replace(moving, noise=(OutputNoise(2.56e-12, 0.0),))
    assert motion_fit.share_of_motion(100.0, surer) == pytest.approx(1.6e-5 / (500.0 * 4e-5))
    assert motion_fit.share_of_motion(100.0, still) == np.inf
    gone = replace(moving, measured=np.where(np.arange(1000)[:, None] % 16 == 0, moving.measured, np.nan))
    gone.measured[::16][1:] = np.nan
    assert motion_fit.share_of_motion(100.0, gone) == np.inf


def test_a_long_log_is_searched_on_its_beginning_and_fitted_as_a_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log = heard(short_log(2.0))
    monkeypatch.setattr(motion_fit, "without_chatter", lambda problem, _: problem)
    monkeypatch.setattr(motion_search, "SCREENED", 0.5)
    monkeypatch.setattr(motion_search, "SEARCHED", 1.0)
    searches = searches_of(log)
    ended = search_results(searches)
    first = next(one for one in ended if one.explains)
    assert first.point.cost == first.search.part.at(first.point.theta).cost
    assert len(first.search.part.log.measured) == 1000
    fits, _, _ = motion_fit._fitted(ended)
    assert fits[0].cost == first.search.whole.at(fits[0].theta).cost
    assert fits[0].cost < first.search.whole.at(first.point.theta).cost - 20.0  # far likelier


@pytest.mark.parametrize(("wanted", "alike", "brought"), [(np.inf, 0.0, 3), (np.inf, np.inf, 2), (0.0, 0.0, 1)])
def test_starts_that_fail_under_larger_noise_or_reach_the_same_point_are_left_out(
    wanted: float, alike: float, brought: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motion_search, "explained_cost", lambda _: wanted)
    monkeypatch.setattr(motion_search, "SAME_COST", alike)
    monkeypatch.setattr(motion_search, "SAME_MODULUS", alike)
    search, begun = searches_of(seen(short_log(0.2)))[0], SharedState()
    lower, upper = search.bounds
    for rank in range(2):
        near = list(search.ends_of_approach(rank, begun, lambda: True))
        assert len(near) == brought
        assert all(np.all((lower <= theta) & (theta <= upper)) for theta in near)
        best = min(search.short.at(theta).cost for theta in near)
        assert best < min(search.short.at(guess).cost for guess in search.guesses)
    assert all(len(points) == len(search.guesses) for points in begun.screened.values())
    assert begun.work > 0


@pytest.mark.slow
@pytest.mark.parametrize("condition", ["major_leakage_minor_friction", "minor_leakage_major_friction"])
def test_a_log_that_does_not_determine_the_force_scale_is_refused_or_its_value_right(condition: str) -> None:
    parameters = parameters_for(CONDITIONS[condition])
    speed = make_drive("steps", 10.0, 1e-3, parameters, np.random.default_rng(1))
    run = simulate(PLANTS["lumped"], speed, 1e-3, parameters, sensors=BENCH, rng=np.random.default_rng(2))
    fit = fit_motion(run.replace(differential_pressure_pa=None), HEALTHY, HEALTHY.bulk_modulus)
    value, std = fit.parameters["bulk_modulus"]
    assert fit.reasons or abs(value - HEALTHY.bulk_modulus) < 3.0 * std


def test_a_log_without_position_is_refused_and_the_missing_channel_named() -> None:
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(50), "velocity_m_s": np.zeros(50)})
    with pytest.raises(LogError, match="needs position_m"):
        fit_motion(record, HEALTHY, 2e8)


def test_speed_noise_is_estimated_from_the_log_if_no_variance_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    record, walks, guesses = short_log(0.3), list[float](), list[float]()

    def ended(searches: list[MotionSearch]) -> list[SearchResult]:
        whole = searches[0].whole
        walks.append(whole.log.noise[0].walk)
        guesses.append(whole.model.values(searches[0].guesses[0])["bulk_modulus"])
        return []

    monkeypatch.setattr(motion_fit, "search_results", ended)
    monkeypatch.setattr(motion_fit, "_fitted", lambda *_, **__: ([found(2e8), found(2e8)], [], False))
    read = measurement_variances(record, ("motor_speed_rad_s",))
    for variances in (None, read, {"motor_speed_rad_s": 4.0 * read["motor_speed_rad_s"]}):
        fit_motion(record, HEALTHY, 0.0, variances=variances)
    assert np.array(walks) / walks[0] == pytest.approx([1.0, 1.0, 4.0])
    assert guesses == pytest.approx([1e-2 * HEALTHY.bulk_modulus] * 3)  # no search starts from a first guess of zero


def test_first_guesses_spread_over_the_faults_and_none_is_zero() -> None:
    bare = replace(
        HEALTHY,
        leakage_coefficient=0.0,
        flow_bias=0.0,
        friction_quadratic=0.0,
        friction_coulomb=0.0,
        makeup_conductance=0.0,
    )
    starts = motion_fit._starts(bare, 1e8)
    positive = [start[name] for start in starts for name in UNKNOWNS if name != "friction_linear"]
    assert min(positive) > 0.0
    assert starts[0]["friction_coulomb"] == HEALTHY.friction_coulomb
    assert starts[0]["makeup_conductance"] == HEALTHY.makeup_conductance
    usual = motion_fit._starts(HEALTHY, 1e8)
    leaks = sorted({start["leakage_coefficient"] / HEALTHY.leakage_coefficient for start in usual})
    assert leaks == pytest.approx([1.0, 5.0, 12.5])
    own = motion_fit._starts(replace(HEALTHY, leakage_coefficient=3e-11), 1e8)
    assert own[0]["leakage_coefficient"] == 3e-11
    linear = sorted({start["friction_linear"] / HEALTHY.friction_linear for start in usual})
    assert linear == pytest.approx([-3.5, 1.0, 8.7])


def found(bulk_modulus: float, cost: float = 50.0, chi_square: float = 1.0) -> GreyBoxFit:
    values = {"bulk_modulus": bulk_modulus}
    return GreyBoxFit(MOTION_FORMS[0], np.zeros(1), values, {"bulk_modulus": 1e6}, cost, (chi_square,), (0.0,))


def test_equally_good_friction_laws_that_disagree_are_objected_to() -> None:
    fits = [found(2.0e8), found(2.3e8, 50.0 + 0.9 * motion_fit.EQUAL_DIFFERENCE)]
    (note,) = motion_fit._objections(fits, fits[0], [], 0.01)
    assert note.code == EstimateCode.FRICTION_LAWS_DISAGREE
    assert note.data == {"least_pa": 2.0e8, "most_pa": 2.3e8}
    worse = found(2.3e8, 50.0 + 1.1 * motion_fit.EQUAL_DIFFERENCE)
    assert motion_fit._objections([fits[0], worse], fits[0], [], 0.01) == ()


def test_another_optimum_far_from_the_best_is_objected_to() -> None:
    best = found(2.0e8)
    (note,) = motion_fit._objections([best], best, [1.8e8, 2.01e8], 0.01)
    assert note.code == EstimateCode.FORCES_ON_ANY_SCALE
    assert note.data == {"least_pa": 1.8e8, "most_pa": 2.01e8}
    assert motion_fit._objections([best], best, [1.98e8, 2.01e8], 0.01) == ()


@pytest.mark.parametrize("near", [True, False])
def test_the_other_friction_law_is_fitted_to_the_whole_log_from_the_better_point(
    near: bool, healthy: FormFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = fine_searches(monkeypatch, 1.0)
    there = first.whole.model.theta({name: healthy.parameters[name][0] for name in UNKNOWNS})
    worst = max(second.guesses, key=lambda theta: second.whole.at(theta).cost)
    own = descend(second.whole.at, there, 40, second.bounds).theta if near else worst
    begun: list[Array] = []

    def noted(at: Any, start: Array, *others: Any, **named: Any) -> Point:
        if at.__self__ is second.whole:
            begun.append(start)
        return descend(at, start, *others, **named)

    monkeypatch.setattr(motion_fit, "descend", noted)
    ended = [
        SearchResult(second, second.part.at(own), explains=False),
        SearchResult(first, first.part.at(there), explains=True),
    ]
    fits, _, _ = motion_fit._fitted(ended)
    assert [fit.model for fit in fits] == [first.whole.model, second.whole.model]
    (start,) = begun
    stands = own, fits[0].theta
    assert np.array_equal(start, min(stands, key=lambda theta: second.whole.at(theta).cost))
    assert near or np.array_equal(start, fits[0].theta)
    assert fits[1].cost == second.whole.at(fits[1].theta).cost <= second.whole.at(start).cost


@pytest.mark.parametrize("late", [True, False])
def test_an_unexplained_log_is_fitted_further_and_tried_on_other_scales_if_that_explains_it(
    late: bool, healthy: FormFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = fine_searches(monkeypatch)
    there = first.whole.model.theta({name: healthy.parameters[name][0] for name in UNKNOWNS})
    there[UNKNOWNS.index("bulk_modulus")] += 0.01
    ended = [
        SearchResult(first, first.part.at(first.guesses[-1]), explains=False),
        SearchResult(second, second.part.at(there), explains=False),
    ]
    monkeypatch.setattr(motion_fit, "optimum_on_other_scales", lambda _, best, __: (best, [9e7]))
    if not late:
        monkeypatch.setattr(motion_fit, "explained_cost", lambda _: 0.0)
    fits, others, _ = motion_fit._fitted(ended)
    assert others == ([9e7] if late else [])
    assert fits[0].cost < second.whole.at(there).cost
    assert fits[0].cost == second.whole.at(fits[0].theta).cost


def test_a_fit_that_explains_only_the_whole_log_is_tried_on_other_scales_too(
    healthy: FormFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = fine_searches(monkeypatch)
    there = first.whole.model.theta({name: healthy.parameters[name][0] for name in UNKNOWNS})
    ended = [SearchResult(one, one.part.at(there), explains=False) for one in (first, second)]
    asked: list[object] = []

    def rescaled(problem: object, best: Point, _: object) -> tuple[Point, list[float]]:
        asked.append(problem)
        return best, [9e7]

    monkeypatch.setattr(motion_fit, "optimum_on_other_scales", rescaled)
    monkeypatch.setattr(motion_fit, "explained_cost", lambda problem: np.inf if problem in wholes else 0.0)
    wholes = (first.whole, second.whole)
    assert motion_fit._fitted(ended)[1] == [9e7]
    assert len(asked) == 1
    assert asked[0] in wholes


@pytest.mark.parametrize("disagreeing", [True, False])
def test_the_other_friction_law_is_not_fitted_if_force_scales_disagree(
    disagreeing: bool, healthy: FormFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = fine_searches(monkeypatch)
    there = first.whole.model.theta({name: healthy.parameters[name][0] for name in UNKNOWNS})
    ended = [SearchResult(one, one.part.at(there), explains=one is first) for one in (first, second)]
    monkeypatch.setattr(motion_fit, "optimum_on_other_scales", lambda _, best, __: (best, [9e7] if disagreeing else []))
    fits, others, _ = motion_fit._fitted(ended)
    assert len(fits) == (1 if disagreeing else 2)
    assert others == ([9e7] if disagreeing else [])
    assert bool(motion_fit._objections(fits, fits[0], others, 0.01)) == disagreeing


def test_an_unexplained_log_is_fitted_by_one_friction_law_and_only_roughly(
    healthy: FormFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = fine_searches(monkeypatch)
    there = first.whole.model.theta({name: 1.01 * healthy.parameters[name][0] for name in UNKNOWNS})
    ended = [SearchResult(one, one.part.at(there), explains=False) for one in (first, second)]
    shares: list[float] = []

    def noted(at: Any, start: Array, *others: Any, least_share: float = 0.0, **named: Any) -> Point:
        shares.append(least_share)
        return descend(at, start, *others, least_share=least_share, **named)

    monkeypatch.setattr(motion_fit, "descend", noted)
    monkeypatch.setattr(motion_fit, "explained_cost", lambda _: 0.0)
    fits, others, _ = motion_fit._fitted(ended)
    assert len(fits) == 1
    assert others == []
    assert min(shares) > 0.0
