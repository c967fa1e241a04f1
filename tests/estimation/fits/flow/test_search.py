from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow import rough_search
from estimation.fits.flow import search as flow_search
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log
from estimation.fits.flow.other_minimum import Found
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.flow.wide_valves import outruns_pump
from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import Asked, GreyBoxFit, coarse_optimum, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.hypotheses import DELIVERY, ENCODER_ZERO
from estimation.fits.hypothesis_search.predicted_gains import predicted_gain, predicted_gains
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import MASS_FLOW_FORM
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import TICK, run
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
STARTS = flow_starts(HEALTHY, HEALTHY.bulk_modulus)


def recorded(condition: str, duration: float = 2.0, sample_time: float = 1e-3) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(21)
    drive = make_drive("steps", duration, sample_time, p, rng)
    return simulate(CIRCUIT, drive, sample_time, p, sensors=BENCH, rng=rng)


def seen(record: Record) -> GreyBoxLog:
    channels = "motor_speed_rad_s", "position_m", "differential_pressure_pa"
    return flow_log(record, HEALTHY, {}, measurement_variances(record, channels))


@pytest.fixture
def tried(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Record the number of starts of each search."""
    counts: list[int] = []

    def counted(problem: object, guesses: Sequence[object], *others: object, **more: object) -> object:
        counts.append(len(guesses))
        return coarse_optimum(problem, guesses, *others, **more)  # pyright: ignore[reportArgumentType] -- as it came

    monkeypatch.setattr(rough_search, "coarse_optimum", counted)
    return counts


@pytest.mark.parametrize("condition", ["normal", "major_leakage", "minor_leakage_major_friction"])
def test_a_search_from_the_likeliest_guess_alone_finds_the_fit_of_one_from_every_start(
    condition: str, tried: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    log = seen(recorded(condition))
    quick = balance_fits(log, HEALTHY, STARTS)
    assert max(tried) == 1
    monkeypatch.setattr(rough_search, "_explains", lambda _: False)
    whole = balance_fits(log, HEALTHY, STARTS)
    assert max(tried) > len(STARTS)
    assert len(quick) == len(whole)
    for one, other in zip(quick, whole, strict=True):
        assert one.cost == pytest.approx(other.cost, abs=2e-3)
        std = other.std["bulk_modulus"]
        assert one.values["bulk_modulus"] == pytest.approx(other.values["bulk_modulus"], abs=0.05 * std)
        assert one.std["bulk_modulus"] == pytest.approx(std, rel=0.01)


def test_valve_values_of_the_mass_balance_save_model_runs_of_the_volume_balance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, runs = seen(recorded("normal")), list[Array]()

    def counted(problem: Problem, theta: Array) -> Point:
        runs.append(theta)
        return evaluated(problem, theta)

    evaluated = Problem.at
    monkeypatch.setattr(Problem, "at", counted)
    led = balance_fits(log, HEALTHY, STARTS)
    spared = len(runs)
    monkeypatch.setattr(flow_search, "VALVES", ())
    alone = balance_fits(log, HEALTHY, STARTS)
    assert spared < len(runs) - spared
    for one, other in zip(led, alone, strict=True):
        assert one.cost < other.cost + 0.02
        std = other.std["bulk_modulus"]
        assert one.values["bulk_modulus"] == pytest.approx(other.values["bulk_modulus"], abs=0.05 * std)


def test_cracking_pressures_are_fitted_in_a_log_with_missing_speeds() -> None:
    """Otherwise their effect is attributed to a false cause: a drift of leakage, a blocked valve."""
    record = recorded("normal")
    speed = record["motor_speed_rad_s"].copy()
    speed[int(np.argmax(np.abs(np.diff(speed))))] = np.nan
    gapped = seen(record.replace(motor_speed_rad_s=speed))
    assert gapped.gaps.size
    likeliest = min(balance_fits(gapped, HEALTHY, STARTS), key=lambda fit: fit.cost)
    assert set(CRACKS) <= likeliest.values.keys()


def test_a_log_that_no_guess_explains_is_searched_from_every_start(tried: list[int]) -> None:
    record = recorded("normal")
    drift = np.linspace(0.0, 3e5, len(record))
    balance_fits(
        seen(record.replace(differential_pressure_pa=record["differential_pressure_pa"] + drift)), HEALTHY, STARTS
    )
    assert max(tried) > len(STARTS)


def test_a_guess_that_leads_into_a_wrong_valley_is_not_followed_over_the_whole_log(
    tried: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(1)
    drive = make_drive("multisine", 6.0, 1e-3, HEALTHY, rng)
    log = seen(simulate(LUMPED, drive, 1e-3, HEALTHY, sensors=BENCH, rng=rng))
    quick = balance_fits(log, HEALTHY, STARTS)
    assert tried == [len(STARTS), 1, 1]
    tried.clear()
    guess = rough_search._optimum_from_guess  # pyright: ignore[reportPrivateUsage]
    monkeypatch.setattr(rough_search, "_optimum_from_guess", lambda *given: (guess(*given)[0], True))
    followed = balance_fits(log, HEALTHY, STARTS)
    assert tried == [1, 1, 1, len(STARTS) + 1, 1, 1]
    for one, other in zip(quick, followed, strict=True):
        assert one.values == pytest.approx(other.values, rel=1e-6, abs=0.0)


def test_a_log_that_rests_for_long_before_it_moves_is_explained_by_the_plain_form() -> None:
    """Any guess leaves only noise on a beginning at rest, so one was followed to oil without stiffness."""
    rng, p = np.random.default_rng(0), parameters_for(CONDITIONS["minor_leakage"])
    strokes = [np.repeat([share, 0.0], 1000) for share in (0.5, -0.5, 0.9, -0.9)]
    drive = p.rated_speed * np.concatenate([np.zeros(6000), *strokes])
    fits = balance_fits(seen(simulate(CIRCUIT, drive, 1e-3, p, sensors=BENCH, rng=rng)), HEALTHY, STARTS)
    likeliest = min(fits, key=lambda fit: fit.cost)
    assert likeliest.chi_square[0] < 1.1
    assert likeliest.values["bulk_modulus"] == pytest.approx(p.bulk_modulus, rel=0.01)


@pytest.mark.parametrize(("behind", "forms"), [(flow_search.TOO_FAR - 5.0, 2), (flow_search.TOO_FAR + 5.0, 1)])
def test_a_balance_far_behind_one_that_leaves_noise_alone_is_given_up(
    monkeypatch: pytest.MonkeyPatch, behind: float, forms: int
) -> None:
    def left_behind(*given: Any) -> list[rough_search.RoughOptimum]:
        volume, mass, _ = rough_search.rough_optima(*given)
        return [volume, replace(mass, point=replace(mass.point, cost=volume.point.cost + behind))]

    monkeypatch.setattr(flow_search, "rough_optima", left_behind)
    fits = balance_fits(seen(recorded("normal")), HEALTHY, STARTS)
    assert len(fits) == forms


def test_reported_fits_use_short_steps_even_if_less_drain_was_found_with_long_ones(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, told = seen(recorded("normal")), list[int]()

    def drained_less(one: Found) -> list[Found]:
        problem, point, bounds = one
        long = problem.on(problem.log.coarsened())
        return [one, (long, replace(point, cost=point.cost - 1.0), bounds)]

    def recording(problem: Problem, point: Point, *, asked: Asked, **given: Any) -> GreyBoxFit:
        told.extend([int(problem.log.steps.sum())] * asked.beside)
        return fit_at_solution(problem, point, asked=asked, **given)

    for name, stand_in in (
        ("_one_sided", lambda _: True),
        ("_with_less_drain", drained_less),
        ("fit_at_solution", recording),
    ):
        monkeypatch.setattr(flow_search, name, stand_in)
    balance_fits(log, HEALTHY, STARTS)
    assert set(told) == {int(log.steps.sum())}


@pytest.mark.parametrize(("deviation", "asked"), [(0.4, True), (0.6, False)])
def test_less_drain_is_searched_for_only_if_the_log_determines_the_drain(
    monkeypatch: pytest.MonkeyPatch, deviation: float, asked: bool
) -> None:
    """A lumped plant has no make-up valve that a drain could open, yet half of its search was spent on less drain."""
    fit = by_mass(balance_fits(seen(recorded("normal")), HEALTHY, STARTS))
    problem, ways = FreedProblem.of(fit.model, seen(recorded("normal"))), list[Array]()
    point, along = problem.at(fit.theta), np.eye(len(fit.theta))[fit.model.unknowns.index("case_leakage")]
    spread = float(along @ np.linalg.inv(point.gram) @ along)
    point = replace(point, gram=point.gram + (deviation**-2 - 1.0 / spread) * np.outer(along, along))

    def went(_: object, start: Array, *__: object, **___: object) -> Point:
        ways.append(start)
        return point

    monkeypatch.setattr(flow_search, "descend", went)
    assert len(flow_search._with_less_drain((problem, point, flow_bounds(fit.model, [point.theta], problem.log)))) == 1
    assert bool(ways) is asked


def by_mass(fits: Sequence[GreyBoxFit]) -> GreyBoxFit:
    (one,) = (fit for fit in fits if fit.model.rates is MASS_FLOW_FORM.rates)
    return one


def test_the_predicted_gain_of_a_worn_pump_depends_on_the_balance_of_the_plain_fit() -> None:
    log = seen(recorded("minor_friction", 10.0, 2e-3))
    plain = by_mass(balance_fits(log, HEALTHY, STARTS)).values
    assert predicted_gain(log, HEALTHY, plain, DELIVERY, by_mass=True)[0] < 10.0
    assert predicted_gain(log, HEALTHY, plain, DELIVERY, by_mass=False)[0] > 100.0


def test_gains_predicted_together_equal_those_predicted_one_by_one() -> None:
    log = seen(recorded("minor_friction", 10.0, 2e-3))
    plain = balance_fits(log, HEALTHY, STARTS)[0].values
    together = predicted_gains(log, HEALTHY, plain, (DELIVERY, ENCODER_ZERO))
    for one, told in zip((DELIVERY, ENCODER_ZERO), together, strict=True):
        assert tuple(told) == pytest.approx(tuple(predicted_gain(log, HEALTHY, plain, one)), rel=1e-4)


def test_slopes_of_the_fit_predict_the_same_gains_as_slopes_computed_anew() -> None:
    log = seen(recorded("minor_friction"))
    fit = by_mass(balance_fits(log, HEALTHY, STARTS))
    slopes = dict(zip(fit.model.unknowns, fit.slopes.T, strict=True))
    anew, known = (
        predicted_gains(log, HEALTHY, fit.values, (DELIVERY, ENCODER_ZERO), by_mass=True, slopes=one)
        for one in ({}, slopes)
    )
    for one, other in zip(anew, known, strict=True):
        assert one.gain == pytest.approx(other.gain, rel=0.01, abs=1e-3)
        assert one.deviation == pytest.approx(other.deviation, rel=1e-3)


def test_make_up_valves_with_different_cracking_pressures_do_not_bias_bulk_modulus() -> None:
    machine = Machine(crack_a=3e3, crack_b=0.0, ripple=0.0)
    rng = np.random.default_rng(3)
    course = np.zeros((6000, 5))
    course[:, 0] = np.repeat(rng.choice((-1.0, 1.0), 60) * rng.uniform(60.0, 125.0, 60), 100)
    course[:, [1, 2, 4]] = 1.0
    log = Logger().log(run(machine, course), rng)
    record = Record(1e-3, {name: log[name].to_numpy() for name in PLAIN_CHANNELS})
    fit = by_mass(balance_fits(seen(record), HEALTHY, STARTS))
    assert fit.values["crack_a"] - fit.values["crack_b"] == pytest.approx(3e3, abs=1e3)
    assert abs(fit.values["bulk_modulus"] - machine.bulk_modulus) < 2.0 * fit.std["bulk_modulus"]
    assert fit.std["bulk_modulus"] < 2e-3 * machine.bulk_modulus


def pulled(load: float) -> Record:
    """Return a log of the open benchmark's actuator whose motor goes to full speed at once, under a load on its rod."""
    rng = np.random.default_rng(8)
    machine = Machine(load=load, loop_gain=0.0)
    course = np.zeros((round(3.0 / TICK), 5))
    course[:, 0] = HEALTHY.rated_speed
    course[len(course) // 2 :, 0] = -0.5 * HEALTHY.rated_speed
    course[:, [1, 2, 4]] = 1.0
    logged = Logger(channels=PLAIN_CHANNELS).log(run(machine, course), rng)
    return Record(1e-3, {name: logged[name].to_numpy() for name in PLAIN_CHANNELS})


def test_make_up_valves_act_as_orifices_if_a_load_pulls_the_piston_ahead_of_the_pump(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    free, loaded = seen(pulled(0.0)), seen(pulled(1.5e3))
    assert not outruns_pump(free, HEALTHY)
    assert outruns_pump(loaded, HEALTHY)
    assert all("makeup_bend" not in fit.values for fit in balance_fits(free, HEALTHY, STARTS))
    bent = min(balance_fits(loaded, HEALTHY, STARTS), key=lambda fit: fit.cost)
    assert bent.values["makeup_bend"] > 1e-5
    assert bent.values["bulk_modulus"] == pytest.approx(Machine().bulk_modulus, rel=0.004)
    monkeypatch.setattr(flow_search, "opens_wide", lambda *_: False)
    assert min(fit.cost for fit in balance_fits(loaded, HEALTHY, STARTS)) > bent.cost + 30.0


def test_make_up_valves_that_act_as_orifices_are_not_mistaken_for_a_sensor_fault() -> None:
    """A log of 3 s was refused, and some of 10 s passed with a speed 4 ms late and bulk modulus 2 % low."""
    fit = fit_flow(pulled(2.2e3), HEALTHY, HEALTHY.bulk_modulus)
    assert not fit.reasons
    assert fit.explanation is not None
    assert fit.explanation.names == ("makeup_bends",)
    assert fit.parameters["bulk_modulus"][0] == pytest.approx(Machine().bulk_modulus, rel=0.004)
