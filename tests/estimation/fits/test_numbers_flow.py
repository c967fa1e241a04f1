"""Logs of the flow form and results of its fits to short logs, kept in `numbers_flow.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import _swept_share, leakage_guess, speed_gaps, without_strays
from estimation.fits.flow.search import balance_fits, flow_starts
from estimation.fits.greybox.chance import largest_chi_square
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import Asked, GreyBoxFit, Search, explains_log, fit_at_solution, fit_greybox
from estimation.fits.greybox.log import OutputNoise
from estimation.fits.greybox.problem import Problem, search_bounds
from estimation.fits.greybox.problem import quadratic as sums_of
from estimation.fits.hypotheses import HYPOTHESES, LIMITS
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.fits.hypothesis_search.wide_problem import flow_bounds, hypothesis_problem
from estimation.log_checks.bridging import within_gaps
from estimation.models.flow import FLOW_FORM, HELD_FLOW_FORM, MASS_FLOW_FORM
from tests.estimation.fits.short_logs import (
    PAPER,
    POSITION,
    PRESSURE,
    SINGLE,
    SPEED,
    log,
    noted,
    problem,
    seen,
    usual,
    wide,
)
from tests.numbers import Found, Numbers

NUMBERS = Numbers(__file__)


def noise_of(noise: OutputNoise) -> dict[str, Any]:
    """Return an output's noise, with the noise that remains after losses."""
    kept = None if noise.lost_from is None else [noise.lost_from.remaining_noise(lost) for lost in (0.1, 1.0)]
    return {**asdict(replace(noise, lost_from=None)), "lost_from": kept}


@NUMBERS.case()
def logs_of_the_flow_form() -> dict[str, Any]:
    record = log()
    speed = record[SPEED].copy()
    jumps = np.flatnonzero(np.abs(np.diff(speed)) > 30.0)
    for place, length in zip(jumps, (2, 4, 5, 7), strict=False):
        speed[place - 1 : place - 1 + length] = np.nan
    speed[400:409], speed[:2], speed[-3:] = np.nan, np.nan, np.nan
    position = record[POSITION].copy()
    position[[50, 51, 52, 300, 700, 701, 702, 703, 704, 705, 706, 707, 708, 709]] = np.nan
    holey = record.replace(motor_speed_rad_s=speed, position_m=position)
    told: dict[str, Any] = {
        "gaps of speed": speed_gaps(holey, PAPER, 3e3),
        "gaps that a quiet sensor feels": len(speed_gaps(holey, PAPER, 30.0)),
        "within gaps of position": int(np.count_nonzero(within_gaps(position))),
        "swept share": [_swept_share(one, p) for one in (position[:40], np.array([0.0, 0.9])) for p in (PAPER, SINGLE)],
        "usual leakage [m^3/(s Pa)]": [leakage_guess(one) for one in (PAPER, replace(PAPER, leakage_coefficient=0.0))],
        "starts": flow_starts(PAPER, 4e8)[::5],
        "starts without leakage": flow_starts(replace(PAPER, leakage_coefficient=0.0, flow_bias=0.0), 2e8)[0],
        "count of starts": len(flow_starts(PAPER, 4e8)),
    }
    for name, some in {
        "plain": record,
        "holey": holey,
        "fast": log(0.3, 1e-4),
        "noisy position": log(position_noise=3e-5),
        "noise that is all but felt": log(position_noise=1.4e-6),
    }.items():
        found = seen(some, chamber_volume=0.1)
        told[name] = {
            "length": len(found.drives),
            "time [s]": found.sample_time,
            "drives": found.drives[[5, 77, -1]],
            "measured [Pa]": found.measured[[5, 77, -1], 0],
            "lost": int(np.count_nonzero(np.isnan(found.measured))),
            "noise": [noise_of(one) for one in found.noise],
            "noise of drives": list(found.drive_std),
            "presumed": {one: list(pair) for one, pair in found.presumed.items()},
            "steps": int(np.max(found.steps)),
            "block [s]": found.block,
            "passes on": found.passes_on,
            "gaps": len(found.gaps),
        }
    stray = record.replace(**{PRESSURE: np.where(np.arange(len(record)) == 333, 9e6, record[PRESSURE])})
    clean, variances = without_strays(stray)
    told["without strays"] = {"at the stray": clean[PRESSURE][333], "variances": variances}
    return told


@NUMBERS.case()
def misfits_of_the_flow_form() -> dict[str, Any]:
    told: dict[str, Any] = {}
    kinds = {
        "flow": problem(),
        "by mass": problem(MASS_FLOW_FORM),
        "held": problem(HELD_FLOW_FORM),
        "noisy position": problem(FLOW_FORM, 3e-5),
    }
    for name, one in kinds.items():
        theta = usual(one)
        point = one.at(theta)
        errors, slopes = one.linearised(theta)
        told[name] = {
            "cost": point.cost,
            "gradient": point.gradient,
            "gram": point.gram[0],
            "its diagonal": np.diag(point.gram),
            "errors": errors[0, [5, 60, 90]],
            "slopes": slopes[[5, 60, 90], 0],
            "costs of two": one.costs([theta, theta + 0.02]),
            "blocks": one.blocks,
            "untilted": one.untilted(theta, errors),
            "by sensitivities": Problem(one.model, one.log).at(theta).cost,
        }
        if not one.log.passes_on:
            told[name]["two side by side"] = [found.cost for found in one.at_each([theta, theta + 0.02])]
    record = log(0.5)
    speed = record[SPEED].copy()
    for place in np.flatnonzero(np.abs(np.diff(speed)) > 30.0)[:3]:
        speed[place - 1 : place + 5] = np.nan
    gapped = Problem(FLOW_FORM, seen(record.replace(motor_speed_rad_s=speed)))
    point = gapped.at(usual(problem()))
    told["with gaps of speed"] = {"cost": point.cost, "gradient": point.gradient, "gaps": gapped.log.gaps}
    walking = problem().on(problem().log.with_larger_noise(2.0, 1.0))
    walking = walking.on(replace(walking.log, noise=(replace(walking.log.noise[0], walk=1e9),)))
    told["with a walk"] = {
        "cost": walking.at(usual(walking)).cost,
        "errors": walking.residuals(usual(walking))[0, [5, 60, 90]],
    }
    errors, columns = np.array([[0.5, -4.0, 9.0]]), np.array([[[1.0, 2.0], [3.0, -1.0], [0.5, 0.2]]])
    told["sums of residuals"] = list(sums_of(errors, columns))
    return told


@NUMBERS.case()
def bounds_of_searches() -> dict[str, Any]:
    model = problem().model
    guesses = [usual(problem()), usual(problem()) + 0.4]
    limits = {"bulk_modulus": (0.0, 1e10), "leakage_coefficient": (1e-13, 1e-9), "speed_lead": (0.0, 1e-3)}
    noisy = problem(FLOW_FORM, 3e-5)
    mass = problem(MASS_FLOW_FORM)
    relieving = tuple(one for one in HYPOTHESES if one.name == "relief_low")
    return {
        "limits": {name: list(pair) for name, pair in LIMITS.items()},
        "without limits": list(search_bounds(model, guesses, {})),
        "with limits": list(search_bounds(model, guesses, limits)),
        "of the flow form": list(flow_bounds(model, guesses, problem().log)),
        "of a noisy log": list(flow_bounds(noisy.model, guesses, noisy.log)),
        "of the form by mass": list(flow_bounds(mass.model, [usual(mass)], mass.log)),
        "of a relieving form": list(flow_bounds(hypothesis_problem(wide(), relieving).model, [np.zeros(9)], wide())),
    }


def told_of(fit: GreyBoxFit) -> dict[str, Any]:
    return {
        "values": {name: Found(value, fit.std[name]) for name, value in fit.values.items()},
        "cost": fit.cost,
        "chi-square": list(fit.chi_square),
        "autocorrelation": fit.autocorrelation[0],
        "slopes of bulk modulus by the rig": {name: slope["bulk_modulus"] for name, slope in fit.rig_slopes.items()},
        "late [s]": {
            name: Found(late, abs(late) / max(2.0 * gain, 1e-9) ** 0.5) for name, (late, gain, _) in fit.late.items()
        },
    }


def told_of_form(fit: FormFit) -> dict[str, Any]:
    return {
        "values": {name: Found(*pair) for name, pair in fit.parameters.items()},
        "bound": fit.bound,
        "chi-square": fit.chi_square,
        "reasons": [note["code"] for note in noted(fit.reasons)],
        "remarks": [note["code"] for note in noted(fit.remarks)],
        "explained by": None if fit.explanation is None else list(fit.explanation.names),
    }


@NUMBERS.case(relative=0.01)
def fits_of_the_flow_form() -> dict[str, Any]:
    told: dict[str, Any] = {}
    record = log()
    whole = seen(record, chamber_volume=0.1, moving_mass=0.2, piston_area=0.02)
    for one in balance_fits(whole, PAPER, flow_starts(PAPER, 2e8)):
        told[f"balanced: {one.model.name}"] = told_of(one)
    told["log"] = told_of_form(fit_flow(record, PAPER, 2e8, {"chamber_volume": 0.1}))
    told["noisy log"] = told_of_form(fit_flow(log(position_noise=3e-5), PAPER, 2e8))
    return told


@NUMBERS.case(relative=0.01)
def grey_box_fits() -> dict[str, Any]:
    short = seen(log(0.5), chamber_volume=0.1)
    starts = flow_starts(PAPER, 2e8)
    told: dict[str, Any] = {
        "from few": told_of(fit_greybox(FLOW_FORM, short, starts=starts[:3], search=Search(screened=60, screening=5)))
    }
    one = problem()
    theta = descend(one.at, usual(one), 25, flow_bounds(one.model, [usual(one)], one.log)).theta
    plain = fit_at_solution(one, one.at(theta), asked=Asked(disturbed=False))
    told["not disturbed"] = told_of(plain)
    noisy = one.on(
        replace(
            one.log,
            drive_std=(0.5, 1e-6),
            uncertainties={"chamber_volume": 0.1, "bulk_modulus": 0.3, "moving_mass": 0.0},
        )
    )
    told["noisy drives"] = told_of(fit_at_solution(noisy, noisy.at(theta)))
    told["usual search"] = asdict(Search())
    most = 0.5 * largest_chi_square(one.blocks) * one.blocks
    told["explained"] = [explains_log(one, replace_cost(one.at(theta), share * most)) for share in (0.99, 1.01)]
    told["insensitive"] = [int(np.count_nonzero(np.isfinite(list(fit_at_solution(one, one.at(theta)).std.values()))))]
    return told


def replace_cost(point: Point, cost: float) -> Point:
    return Point(point.theta, cost, point.gradient, point.gram)


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
