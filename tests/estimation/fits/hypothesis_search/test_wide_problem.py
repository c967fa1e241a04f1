"""Where searches for other effects in a log begin."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.rig_draws import draw_bench
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.fits.flow.accumulator import presumed_stiffness
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox import nudges
from estimation.fits.greybox.deviations import prior_precision
from estimation.fits.greybox.log import greybox_log
from estimation.fits.hypotheses import (
    BEGUN_UNDER_LOAD,
    ENCODER_ZERO,
    HYPOTHESES,
    LIMITS,
    OFFSET_AT_REST,
    PRESSURE_DRIFT,
    VOLUME,
    Hypothesis,
)
from estimation.fits.hypothesis_search.wide_log import START_LEVEL, usual_values, widened_log
from estimation.fits.hypothesis_search.wide_problem import (
    LEAST_SETTING,
    MOST_WORN,
    POSITION_ZERO,
    flow_bounds,
    flow_speed,
    hypothesis_problem,
    misread_start,
    own_starts,
    worn_start,
)
from estimation.models.flow import FLOW_FORM, form_with_relief
from estimation.models.flow_parameters import flow_parameters
from estimation.models.wide_flow import grown_leakage
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import PAPER, PRESSURE, at_one_speed, log, lost_in_bias, seen, wide

RIG = EhaParameters()
VARIANCES = {"differential_pressure_pa": 1e6}


@pytest.mark.parametrize("one", HYPOTHESES, ids=[one.name for one in HYPOTHESES])
def test_every_search_of_a_log_with_a_dead_pressure_sensor_begins_at_finite_values(one: Hypothesis) -> None:
    still = dict.fromkeys((*FLOW_FORM.drives, *FLOW_FORM.outputs), np.zeros(20))
    seen_log = greybox_log(FLOW_FORM, Record(1e-3, still), flow_parameters(RIG), longest_step=1e-3, variances=VARIANCES)
    log = widened_log(replace(seen_log, presumed=presumed_stiffness(RIG, {})), RIG)
    model = hypothesis_problem(log, (one,)).model
    known = dict.fromkeys(model.unknowns, 1.0)
    for start in own_starts(log, one):
        assert np.all(np.isfinite(model.theta({**known, **start})))


@pytest.mark.parametrize("factor", [2.0, 10.0, 1e6])
def test_leakage_that_grows_with_time_squared_is_within_bounds(factor: float) -> None:
    """It begins flat. Growth was held to twice its value halfway, and logs with such a leak were refused."""
    halfway, elapsed = 1.0 + 0.25 * (factor - 1.0), np.linspace(0.0, 1.0, 5)
    of_halfway = (factor - 1.0) / halfway  # growth with time and with its square, both relative to halfway
    for name in ("leakage_growth", "leakage_bend"):
        least, most = LIMITS[name]
        assert least <= of_halfway <= most
    grown = halfway * grown_leakage(elapsed, of_halfway, of_halfway, 0.0)
    np.testing.assert_allclose(grown, 1.0 + (factor - 1.0) * elapsed**2, rtol=1e-9, atol=1e-9 * factor)


@pytest.mark.parametrize("share", [0.98, 1.1])
def test_the_bounds_of_the_relief_setting_follow_the_peak_pressure_of_the_log(share: float) -> None:
    """A search stepped to a setting that pressure never reached, from where no slope leads back."""
    peak, form = share * RIG.relief_pressure, form_with_relief(FLOW_FORM)
    reached = replace(seen(log(0.2)), measured=np.full((200, 1), -peak))
    place = form.unknowns.index("relief_pressure")
    least, most = (np.exp(end[place]) for end in flow_bounds(form, [form.theta(flow_starts(RIG, 2e8)[0])], reached))
    assert least == pytest.approx(LEAST_SETTING * peak)
    assert most == pytest.approx(max(peak, RIG.relief_pressure))


def test_the_last_start_of_an_encoder_zero_is_at_mid_travel() -> None:
    moved = wide()
    drives = moved.drives.copy()
    drives[:, 1] = np.linspace(0.1, 0.16, len(drives))
    last = own_starts(replace(moved, drives=drives), ENCODER_ZERO)[-1]
    assert last[POSITION_ZERO] == pytest.approx(0.13)


def test_the_start_of_an_offset_at_rest_is_the_pressure_that_is_read_there() -> None:
    log = wide()
    measured = np.full_like(log.measured, 1e5)
    measured[0] = np.nan
    assert list(own_starts(replace(log, measured=measured), OFFSET_AT_REST)) == [{"pressure_offset": 1e5}]


def test_the_start_of_a_worn_pump_attributes_excess_flow_bias_to_wear() -> None:
    log = widened_log(seen(at_one_speed()), PAPER)
    assert flow_speed(log) == pytest.approx(100.0, rel=3e-2)  # computed from means about each sample
    (start,) = worn_start(log, lost_in_bias())
    assert start["pump_displacement"] == pytest.approx(0.85 * PAPER.pump_displacement, rel=1e-2)
    assert start["flow_bias"] == pytest.approx(PAPER.flow_bias)
    (most,) = worn_start(log, lost_in_bias(0.5))
    assert most["pump_displacement"] == pytest.approx((1.0 - MOST_WORN) * PAPER.pump_displacement)
    assert most["flow_bias"] > PAPER.flow_bias
    assert worn_start(log, lost_in_bias(1.0)) == []
    still = replace(log, drives=np.zeros_like(log.drives))
    assert worn_start(still, lost_in_bias()) == []


@pytest.mark.parametrize("implicit", [False, True])
@pytest.mark.parametrize("opening", [1e2, 1e4])
@pytest.mark.parametrize("modulus", [5e7, 2e8, 1.5e9])
def test_slopes_of_the_widest_make_up_valve_do_not_chatter(
    modulus: float, opening: float, implicit: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = replace(wide(), stiff=implicit)
    problem = hypothesis_problem(log, (BEGUN_UNDER_LOAD,))
    values = {**usual_values(log), "bulk_modulus": modulus, "makeup_opening": opening, "case_leakage": 1e-13}
    theta = problem.model.theta({**values, "leakage_coefficient": 2e-11, "speed_lead": 1e-5})
    place = problem.model.unknowns.index("makeup_conductance")
    theta[place] = flow_bounds(problem.model, [theta], log)[1][place]

    def effects(nudge: float) -> np.ndarray:
        monkeypatch.setattr(nudges, "NUDGE", nudge)
        slopes = hypothesis_problem(log, (BEGUN_UNDER_LOAD,)).linearised(theta)[1]
        return np.sqrt(np.einsum("ij,ij->j", slopes, slopes))

    # a valve that opens within 100 Pa has a corner narrower than a nudge of 1e-3; chatter would grow tenfold here
    assert effects(1e-6) == pytest.approx(effects(1e-5), rel=0.1, abs=1.0)


def test_the_start_of_an_offset_at_rest_is_zero_without_pressure() -> None:
    log = wide()
    blind = replace(log, measured=np.full_like(log.measured, np.nan))
    assert list(own_starts(blind, OFFSET_AT_REST)) == [{"pressure_offset": 0.0}]


def test_the_prior_of_the_initial_pressure_level_reaches_up_to_half_of_the_peak_pressure() -> None:
    log = wide()
    problem, most = hypothesis_problem(log, (BEGUN_UNDER_LOAD,)), 0.5 * float(np.max(np.abs(log.measured)))
    place = problem.model.unknowns.index(START_LEVEL)
    known = dict.fromkeys(problem.model.unknowns, 1.0)
    unit = problem.model.values(problem.model.theta(known) + 1.0)[START_LEVEL] - 1.0
    levels = np.linspace(0.0, most, 1001)
    assert unit * prior_precision(problem)[place] ** -0.5 == pytest.approx(np.sqrt(np.mean(levels**2)), rel=1e-3)


def test_bulk_modulus_is_right_in_a_log_that_begins_with_both_chambers_shut_in() -> None:
    """Their pressures had met in a pause after a hard move. Too low a start cost 0.05 % and five times the search."""
    rng, p = np.random.default_rng(0), parameters_for(CONDITIONS["major_friction"])
    speed = np.repeat([120.0, 0.0, 0.0, 0.0, -110.0, 90.0, 0.0, -90.0, 80.0, -120.0, 0.0], 400)
    whole = simulate(CIRCUIT, speed, 1e-3, p, sensors=BENCH, rng=rng)
    found = estimate_bulk_modulus(whole.slice(1500, len(whole)), RIG)
    assert found.gate.passed
    assert found.value == pytest.approx(p.bulk_modulus, rel=3e-4)


@pytest.mark.slow
def test_an_uncertain_initial_pressure_level_is_in_the_deviation_of_bulk_modulus() -> None:
    bench = draw_bench(1004)  # the level absorbed half of the load's pressure: 0.45 % high, by 4.9 deviations
    found = estimate_bulk_modulus(bench.record, bench.healthy)
    assert found.gate.passed
    assert found.value is not None
    assert found.std is not None
    assert abs(found.value - bench.true.bulk_modulus) < 2.0 * found.std < 0.01 * bench.true.bulk_modulus


@pytest.mark.parametrize(("length", "starts"), [(1.4, (-0.06, 0.06)), (0.05, (-0.015, 0.015))])
def test_a_search_for_an_encoders_zero_begins_within_the_chambers(length: float, starts: tuple[float, float]) -> None:
    rig = replace(PAPER, chamber_volume=0.5 * length * PAPER.piston_area)
    begun = own_starts(widened_log(seen(log(0.5)), rig), ENCODER_ZERO)
    assert [one[POSITION_ZERO] for one in begun[:2]] == pytest.approx(starts)


def test_the_start_of_a_pressure_drift_explains_most_beside_the_first_guess() -> None:
    """A stepwise search reached a twentieth of 1.8 bar, and the log was refused at 17 times the noise."""
    record = log()
    drifts = record.replace(**{PRESSURE: record[PRESSURE] + np.linspace(0.0, 1.8e5, len(record))})
    wide_log = widened_log(seen(drifts), PAPER)
    problem = hypothesis_problem(wide_log, (PRESSURE_DRIFT,))
    rough = {**usual_values(wide_log), **flow_starts(PAPER, PAPER.bulk_modulus)[0]}
    guess = problem.model.theta(rough)
    (begun,) = misread_start(problem, guess, PRESSURE_DRIFT)
    moved = [name for name, one, other in zip(problem.model.unknowns, guess, begun, strict=True) if one != other]
    assert moved == ["pressure_drift"]
    assert problem.model.values(begun)["pressure_drift"] == pytest.approx(1.8e5, rel=0.2)
    assert problem.at(begun).cost < 0.5 * problem.at(guess).cost
    assert not misread_start(hypothesis_problem(wide_log, (VOLUME,)), guess, VOLUME)
