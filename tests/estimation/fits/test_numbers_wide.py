"""Objections, hypotheses and the motion form on short logs, kept in `numbers_wide.json`."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from estimation.fits.flow import asked_hypotheses
from estimation.fits.flow.asked_hypotheses import hypotheses_asked, near_starts
from estimation.fits.flow.rough_search import _optimum_from_guess, _search
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.hypotheses import DELIVERY, HYPOTHESES, PRIOR_SPREADS
from estimation.fits.hypothesis_search.explain import explain
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.fit_objections import objections
from estimation.fits.hypothesis_search.form_fit import likelihood_mean, with_structure
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain, predicted_gain
from estimation.fits.hypothesis_search.wide_log import usual_values, without_delays
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem, own_starts
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion.fit import _starts
from estimation.fits.motion.force_scale import disagree
from estimation.fits.motion.log import _steps, motion_log
from estimation.fits.motion.search import MotionSearch
from estimation.models.flow import FLOW_FORM, STIFFNESS
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER, POSITION, PRESSURE, SPEED, WORN, log, made_fit, noted, seen, wide
from tests.numbers import Found, Numbers, Roughly

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def objections_on_either_side() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for noisy in (False, True):
        for chi in (1.19, 1.21, 1.43, 1.45):
            told[f"chi-square {chi}, noisy: {noisy}"] = noted(objections(made_fit(100.0, 2e8, 1e6, chi=chi), noisy))
        for correlated in (0.09, -0.11, 0.29, 0.31):
            told[f"correlation {correlated}, noisy: {noisy}"] = noted(
                objections(made_fit(100.0, 2e8, 1e6, correlated=correlated), noisy)
            )
    for name, late, gain, chi in (
        ("late", 1e-3, 21.0, 1.0),
        ("early", -1e-3, 21.0, 1.0),
        ("hardly worth it", 1e-3, 19.0, 1.0),
        ("hardly late", 1.9e-4, 30.0, 1.0),
        ("just late", 2.1e-4, 30.0, 1.0),
        ("too late", 0.021, 30.0, 1.0),
        ("not too late", 0.019, 30.0, 1.0),
        ("a fifth of the misfit", 1e-3, 100.0, 2.0),
        ("a third of it", 1e-3, 150.0, 2.0),
    ):
        told[name] = noted(objections(made_fit(1000.0, 2e8, 1e6, chi=chi, late=late, gain=gain), False))
    told["weighed"] = {
        name: list(pair)
        for name, pair in likelihood_mean(
            [made_fit(3.0, 2e8, 1e6), made_fit(6.0, 2.2e8, 2e6), made_fit(3e3, 9e8, np.inf)]
        ).items()
    }
    told["with structure"] = list(with_structure({"bulk_modulus": (2e8, 1e5)}, 1e-3)["bulk_modulus"])
    told["disagree"] = [disagree([1.0, share]) for share in (1.049, 1.051, 0.953, 0.951)]
    return told


@contextmanager
def all_promise(one: PredictedGain) -> Iterator[None]:
    """Let every hypothesis have the same predicted gain."""
    each = [one] * len(asked_hypotheses.ALWAYS_ASKED)
    with patch.multiple(asked_hypotheses, predicted_gain=lambda *_, **__: one, predicted_gains=lambda *_, **__: each):
        yield


@NUMBERS.case()
def what_is_asked_of_a_log() -> dict[str, Any]:
    """Return the hypotheses tested with gains of delivery on either side of each limit, and by length of the log."""
    told: dict[str, Any] = {}
    sound, base = made_fit(100.0, 2e8, 1e6), wide()
    for gain, size, deviation in (
        (9.0, 0.02, 0.05),
        (11.0, 0.02, 0.05),
        (11.0, 0.009, 0.05),
        (11.0, 0.011, 0.05),
        (9.0, 0.02, 0.059),
        (9.0, 0.02, 0.061),
        (29.0, 0.51, 0.05),
        (31.0, 0.51, 0.05),
        (31.0, 0.49, 0.05),
    ):
        with all_promise(PredictedGain(gain, size, deviation)):
            asked, remarks = hypotheses_asked(base, PAPER, sound, sound, loaded=False, moving=False)
        told[f"gain {gain:g}, size {size:g}, deviation {deviation:g}"] = [[one.name for one in asked], noted(remarks)]
    poor = made_fit(1.0, 2e8, 1e6, chi=2.0)
    told["of a poor fit"] = [
        one.name for one in hypotheses_asked(base, PAPER, poor, poor, loaded=False, moving=False)[0]
    ]
    for gain, fed, chi, likeliest in (
        (9.0, 1.0, 1.15, True),
        (11.0, 1.0, 1.0, True),
        (9.0, 0.009, 1.15, True),
        (9.0, 0.009, 1.15, False),
        (9.0, 0.009, 1.09, True),
        (9.0, 0.011, 1.15, True),
        (9.0, 1.0, 2.0, True),
    ):
        plain = made_fit(100.0, 2e8, 1e6, chi=chi)
        fit = replace(plain, values={**plain.values, "makeup_conductance": fed * PAPER.makeup_conductance})
        with all_promise(PredictedGain(gain, 0.0, 0.05)):
            asked, _ = hypotheses_asked(base, PAPER, fit, fit if likeliest else sound, loaded=False, moving=True)
        told[f"in motion: {gain:g}, {fed:g}, {chi:g}, {likeliest}"] = [one.name for one in asked]
    lengths = (np.zeros((count, 2)) for count in (70000, 70001))
    told["of long logs under load"] = [
        [
            one.name
            for one in hypotheses_asked(replace(base, drives=drives), PAPER, sound, sound, loaded=True, moving=False)[0]
        ]
        for drives in lengths
    ]
    starts = flow_starts(PAPER, 3e8)
    sound = replace(sound, values={**sound.values, "makeup_conductance": PAPER.makeup_conductance})
    told["near a fit"] = [dict(one) for one in near_starts(sound, starts, lambda _: True, in_motion=False)]
    told["near none"] = [dict(one) for one in near_starts(sound, starts, lambda _: False, in_motion=False)[:2]]
    told["near a fit that begins otherwise"] = [
        dict(one) for one in near_starts(sound, starts, lambda _: True, in_motion=True)[:2]
    ]
    return told


@NUMBERS.case(relative=1e-4)
def first_guesses_of_the_flow_form() -> dict[str, Any]:
    log_of = seen(log(0.5))
    costs = FreedProblem.costs
    begun = FreedProblem.of(FLOW_FORM, log_of.beginning(_search(log_of).screened).coarsened())
    with patch.object(FreedProblem, "costs", autospec=True, side_effect=costs) as asked:
        found, near = _optimum_from_guess(begun, log_of, PAPER, flow_starts(PAPER, 2e8))
    guesses = np.array(asked.call_args.args[1])
    return {
        "count": len(guesses),
        "guessed of modulus, leakage, bias": [
            sorted({round(float(one), 4) for one in guesses[:, i]}) for i in range(3)
        ],
        "found": {name: Roughly(value, 0.05) for name, value in found.items() if name != "speed_lead"},
        "near": near,
        "samples": [_search(replace(log_of, sample_time=time)).screened for time in (1e-3, 3e-3)],
    }


@NUMBERS.case()
def the_wide_form() -> dict[str, Any]:
    base = wide()
    told: dict[str, Any] = {
        "hypotheses": {one.name: asdict(one) for one in HYPOTHESES},
        "presumed of rigs": PRIOR_SPREADS,
        "row": dict(zip(usual_values(base), base.parameters, strict=True)),
        "drives": base.drives[[0, 77, -1]],
        "presumed": {name: list(pair) for name, pair in base.presumed.items()},
        "starts of its own": {one.name: list(own_starts(base, one)) for one in HYPOTHESES if one.shares_of_peak},
    }
    loud = replace(base, measured=base.measured * 3.3e6 / float(np.nanmax(np.abs(base.measured))))
    louder = replace(base, measured=base.measured * 3.36e6 / float(np.nanmax(np.abs(base.measured))))
    told["unknowns near the relief"] = [
        list(hypothesis_problem(one, (DELIVERY,)).model.unknowns) for one in (loud, louder)
    ]
    for channel, delay in ((PRESSURE, 4e-3), (SPEED, 3e-3), (POSITION, 2e-3), (PRESSURE, 2e-4)):
        late = without_delays(base, {channel: delay})
        told[f"{channel} {1e3 * delay:g} ms late"] = {
            "drives": late.drives[[40, -1]],
            "measured [Pa]": late.measured[[40, -6], 0],
            "lost": int(np.count_nonzero(np.isnan(late.measured))) - int(np.count_nonzero(np.isnan(base.measured))),
        }
    for one in HYPOTHESES:
        tried = hypothesis_problem(base, (one,))
        start = {**usual_values(base), "case_leakage": 4e-13, "speed_lead": 1e-5, **own_starts(base, one)[0]}
        point = tried.at(tried.model.theta(start))
        told[f"{one.name}: cost and slope"] = [point.cost, float(point.gradient[-1])]
    return told


@NUMBERS.case(relative=0.01)
def promises_of_hypotheses() -> dict[str, Any]:
    record = log(0.5)
    off = record.replace(**{PRESSURE: record[PRESSURE] + 2e5})
    plain = {
        **flow_starts(PAPER, PAPER.bulk_modulus)[2],
        "leakage_coefficient": 2e-11,
        "flow_bias": 5e-6,
        STIFFNESS: 2e7,
    }
    told: dict[str, Any] = {}
    for one in HYPOTHESES:
        gain, size, deviation = predicted_gain(seen(off), PAPER, plain, one)
        told[one.name] = {"gain": round(gain, 3), "size": Found(size, deviation)}
    told["delivery by mass"] = list(predicted_gain(seen(record), PAPER, plain, DELIVERY, by_mass=True))
    return told


@NUMBERS.case(relative=0.01)
def explanations() -> dict[str, Any]:
    record = log(0.5)
    off = seen(record.replace(**{PRESSURE: record[PRESSURE] + 2e5}))
    asked = [one for one in HYPOTHESES if one.name in ("pressure_offset", "speed_late", "volume", "leakage_rise")]
    found: Explanation = explain(
        off, PAPER, flow_starts(PAPER, PAPER.bulk_modulus)[:1], lambda fit: fit.chi_square[0] < 1.3, asked=asked
    )
    return {
        "names": list(found.names),
        "rivals": len(found.rivals),
        "delays": dict(found.delays),
        "stated pressure [Pa]": found.stated_pressure,
        "values": {name: Found(*pair) for name, pair in found.values.items()},
        "cost": found.fit.cost,
    }


@NUMBERS.case()
def the_motion_form() -> dict[str, Any]:
    record = log(0.5)
    speed = record[SPEED].copy()
    speed[100:104] = np.nan
    found = motion_log(record.replace(motor_speed_rad_s=speed), WORN, {"chamber_volume": 0.1}, 1e-4)
    fast = motion_log(log(0.3, 1e-4), PAPER, {}, 1e-4)
    told: dict[str, Any] = {
        "drives": found.drives[[3, 101, -1]],
        "measured [m]": found.measured[[3, 101, -1], 0],
        "steps": np.bincount(found.steps),
        "steps of a step": np.bincount(_steps(found.drives, 5e-3)),
        "noise": asdict(found.noise[0]),
        "fast": {"length": len(fast.drives), "time [s]": fast.sample_time, "noise": asdict(fast.noise[0])},
        "starts": _starts(PAPER, 4e8)[::4],
        "starts of a frictionless rig": _starts(
            replace(
                PAPER,
                friction_quadratic=0.0,
                friction_coulomb=0.0,
                leakage_coefficient=0.0,
                flow_bias=0.0,
                makeup_conductance=0.0,
            ),
            2e8,
        )[4],
    }
    long = {name: np.zeros(31000) for name in (SPEED, "position_m")}
    long[SPEED][::2] = 1.0
    long["position_m"][::3] = 1e-6
    told["samples of a long log"] = len(motion_log(Record(1e-3, long), PAPER, {}, 1e-4).drives)
    for form in MOTION_FORMS:
        one = FreedProblem(form, found, UNKNOWNS, LINEAR)
        point = one.at(one.model.theta(_starts(WORN, 2e8)[0]))
        told[form.name] = {"cost": point.cost, "gradient": point.gradient, "diagonal": np.diag(point.gram)}
    search = MotionSearch.of(MOTION_FORMS[-1], found, _starts(PAPER, 2e8)[:2])
    told["bounds"] = list(search.bounds)
    told["first guess"] = search.guesses[0]
    return told


@NUMBERS.case()
def objections_to_a_motion_fit() -> dict[str, Any]:
    def fits(chi: float, other: float, cost: float) -> list[GreyBoxFit]:
        return [made_fit(10.0, 2e8, 1e6, chi=chi), made_fit(cost, other, 1e6)]

    told: dict[str, Any] = {}
    for name, made, others in (
        ("fine", fits(1.09, 2.08e8, 14.9), [2.09e8]),
        ("poor", fits(1.11, 2e8, 14.9), []),
        ("laws disagree", fits(1.0, 2.11e8, 14.9), []),
        ("laws disagree, but one is worse", fits(1.0, 2.11e8, 15.1), []),
        ("any scale", fits(1.0, 2e8, 11.0), [1.88e8]),
    ):
        told[name] = noted(motion_fit._objections(made, made[0], others, 0.0125))
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
