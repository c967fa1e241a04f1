"""Reasons for and against conditions on both sides of the limits, kept in `numbers_verdict.json`."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimation.eha.result import BulkModulusEstimate
from faults.conditions import severity
from faults.diagnosis.advice import advice_for, held_speed_count
from faults.diagnosis.beyond_nine.force_balance import force_balance
from faults.diagnosis.beyond_nine.load import first_guesses, with_rod_load
from faults.diagnosis.calibration import shipped_calibration
from faults.diagnosis.changes.end_stop import _rests_at_end, with_end_stop
from faults.diagnosis.changes.onset import find_onset, part_of, two_parts
from faults.diagnosis.changes.split import likeliest_split
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.circuits.class_regions import fit_classes, nearest_score
from faults.diagnosis.circuits.out_of_model import reasons_against
from faults.diagnosis.circuits.two_sensors import sensor_disagreements
from faults.diagnosis.evidence import Scoreboard, bounded_log_odds, friction_left_open, weigh_evidence
from faults.diagnosis.innovation_bank import innovation_scores
from faults.diagnosis.models_verdict import error_margin, models_verdict
from faults.diagnosis.rmse import Scores, measured_velocity, score_mathematical
from faults.eha.bank import mathematical_bank
from faults.notes import AgainstCode, ClassCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.notes import Note
from plant.sensors.sensors import RIG
from tests.faults.diagnosis.short_logs import (
    ACTUATOR,
    OFF,
    PAPER,
    PRESSURE,
    SHORT,
    blocks,
    classes,
    log,
    made_classes,
    noted,
)
from tests.numbers import Found, Numbers

NUMBERS = Numbers(__file__)


@NUMBERS.case(relative=0.01)
def reasons_against_a_class() -> dict[str, Any]:
    one, told = blocks(), dict[str, Any]()
    base = classes()
    sizes = np.sqrt(np.nanmean(one.outputs[one.first :] ** 2, axis=0))
    for name, shares, lasts in (
        ("velocity 11 %", (0.11, 0.01), 20),
        ("velocity 13 %", (0.13, 0.01), 20),
        ("velocity 13 %, to and fro", (0.13, 0.01), 1),
        ("pressure 7 %", (0.01, 0.07), 20),
        ("pressure 9 %", (0.01, 0.09), 20),
    ):
        apart = np.where(np.arange(len(one.velocity)) % (2 * lasts) < lasts, 1.0, -1.0) * shares[0] * sizes[0]
        fitted = np.column_stack([one.velocity + apart, base.best.fitted[:, 1]])
        worse = replace(base, best=replace(base.best, scales=np.array(shares) * sizes, fitted=fitted))
        told[name] = [note["code"] for note in noted(reasons_against(one, worse, -1.0, ACTUATOR))]
    point = base.best.coordinates
    for name, stiffer in (("oil 0.50", 0.50), ("oil 0.60", 0.60), ("oil 1.7", 1.7), ("oil 2.1", 2.1)):
        moved = point.copy()
        moved[5] = np.log(stiffer * PAPER.bulk_modulus)
        notes = reasons_against(one, replace(base, best=replace(base.best, coordinates=moved)), -1.0, ACTUATOR)
        told[name] = [note["code"] for note in noted(notes)]
    for name, region in (("inside", -6.9), ("outside", -7.1)):
        told[name] = [note["code"] for note in noted(reasons_against(one, base, region, ACTUATOR))]
    far = replace(
        base,
        best=replace(base.best, coordinates=ACTUATOR.conditions[0] + np.array([3.0, -3.0, 1.0, 2.0, 0.5, 0.0, 0.0])),
    )
    told["outside all"] = [note["code"] for note in noted(reasons_against(one, far, -50.0, ACTUATOR))]
    middle = coordinates_of(severity(1.25, 0.5, ACTUATOR.circuit), ACTUATOR.rated)
    between = replace(base, best=replace(base.best, coordinates=middle))
    told["between"] = noted(reasons_against(one, between, -8.0, ACTUATOR))
    return told


def shifted(**channels: float) -> Record:
    record = log()
    return record.replace(**{name: record[name] + by for name, by in channels.items()})


@NUMBERS.case(relative=0.02)
def biases_of_sensors_and_pump() -> dict[str, Any]:
    size = float(np.sqrt(np.mean(log()[PRESSURE] ** 2)))
    fast = float(np.sqrt(np.mean(log()["motor_speed_rad_s"] ** 2)))
    worn = circuit_of(replace(PAPER, pump_displacement=0.8 * PAPER.pump_displacement))
    speed = make_drive("prbs", 3.0, 2e-3, PAPER, np.random.default_rng(11))
    logs = {
        "pressure 4 % off": shifted(**{PRESSURE: 0.04 * size}),
        "pressure 8 % off": shifted(**{PRESSURE: 0.08 * size}),
        "speed 2.4 % off": shifted(motor_speed_rad_s=0.024 * fast),
        "speed 5 % off": shifted(motor_speed_rad_s=-0.05 * fast),
        "pump 20 % worn": simulate(CIRCUIT, speed, 2e-3, worn, sensors=RIG, rng=np.random.default_rng(3)),
    }
    told: dict[str, Any] = {}
    for name, record in logs.items():
        one = blocks_of(record)
        fits = fit_classes(one, ACTUATOR)
        told[name] = noted(reasons_against(one, fits, nearest_score(fits, one, ACTUATOR), ACTUATOR))
    return told


@NUMBERS.case()
def sensors_that_disagree() -> dict[str, Any]:
    record = log()
    told: dict[str, Any] = {}
    for share in (1.0, 1.04, 1.06, 0.5):
        wrong = record.replace(velocity_m_s=share * record["velocity_m_s"])
        told[f"velocity times {share:g}"] = noted(sensor_disagreements(wrong, blocks_of(wrong)))
    return told


@NUMBERS.case(relative=0.01)
def onsets_within_a_log() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, (condition, after, pressure) in {
        "leakage comes": ("normal", "major_leakage", True),
        "friction comes": ("normal", "major_friction", True),
        "leakage comes, without pressure": ("normal", "major_leakage", False),
        "nothing comes": ("minor_leakage", "", True),
    }.items():
        one = blocks(condition, after, pressure=pressure, seconds=4.0)
        fits = fit_classes(one, ACTUATOR)
        found = None if (two := two_parts(one, fits, ACTUATOR)) is None else find_onset(one, two, ACTUATOR)
        told[name] = {"likeliest split, block": getattr(likeliest_split(one, fits.best), "place", None)}
        if found is not None:
            change, rest, later = found
            told[name] |= {
                "since [s]": change.since,
                "interval [s]": change.ci95,
                "before": change.before,
                "blocks of the rest": int(np.count_nonzero(np.isfinite(rest.velocity))),
                "leakage then": Found(float(later.best.coordinates[0]), float(later.spread[0, 0] ** 0.5)),
                "friction then": Found(float(later.best.coordinates[4]), float(later.spread[4, 4] ** 0.5)),
            }
    part = part_of(blocks(), 20, 60)
    told["part of a log"] = [int(np.count_nonzero(np.isfinite(part.velocity))), float(np.nansum(part.velocity))]
    return told


@NUMBERS.case(relative=0.01)
def evidence_for_conditions() -> dict[str, Any]:
    board = weigh_evidence(log(), ACTUATOR)
    calibration = shipped_calibration()
    stuck = replace(blocks(), velocity=1e-4 * blocks().velocity)
    reached = {
        share: replace(stuck, pressure=share * np.ones(len(stuck.velocity)) * 436.0 / PAPER.piston_area)
        for share in (0.5, 1.1, 1.3)
    }
    made = Scoreboard(
        {"models": np.linspace(0.0, -6.0, 9), "parameters": np.linspace(-3.0, 0.0, 9)},
        blocks(),
        made_classes(OFF, blocks()),
        log(),
        None,
    )
    return {
        "log-odds": {name: [float(one) for one in np.maximum(odds, -25.0)] for name, odds in board.log_odds.items()},
        "choices": {name: board.choice(name) for name in board.log_odds},
        "probable": {name: share for name, share in board.probabilities(calibration).items() if share > 1e-3},
        "probabilities of made-up odds": {
            f"pressure: {pressure}": list(
                replace(made, blocks=blocks(pressure=pressure)).probabilities(calibration).values()
            )
            for pressure in (True, False)
        },
        "friction left open": {
            f"{share:g} of its force": friction_left_open(np.linspace(0.0, -8.0, 9), one, ACTUATOR)
            for share, one in reached.items()
        },
        "friction left open without pressure": friction_left_open(
            np.linspace(-8.0, 0.0, 9), replace(stuck, pressure=None), ACTUATOR
        ),
        "bounded": bounded_log_odds(np.array([-3.0, 0.0, -40.0, -1e9, np.nan])),
        "bounded, none finite": bounded_log_odds(np.full(3, np.nan)),
    }


@NUMBERS.case(relative=1e-7)
def innovations_of_the_bank() -> dict[str, Any]:
    fast = Record(1e-3, {name: np.repeat(log(seconds=1.5)[name], 2) for name in log(seconds=1.5)})
    return {
        "log-likelihoods": innovation_scores(log(seconds=1.5), ACTUATOR.circuit),
        "of a fast log": innovation_scores(fast, PAPER),
    }


STANDING = (*((reach, 0.3) for reach in (0.3, 0.5, 0.7)), *((5.0, rest) for rest in (0.03, 0.05, 0.07, 0.09, 0.12)))
"""Reaches [mm] and rests [s] on both sides of the limits from which a piston rests at an end."""


def resting(reach: float, rest: float) -> Blocks:
    """Return a piston that moves out, rests for a time, and comes back."""
    time = 0.01 * np.arange(201)
    gone = np.interp(time, [0.0, 0.05, 0.05 + rest, 0.1 + rest], [0.0, reach, reach, 0.0])
    return replace(blocks(), velocity=np.diff(gone) / 0.01)


@NUMBERS.case(relative=0.01)
def pistons_at_their_ends() -> dict[str, Any]:
    rng = np.random.default_rng(2)
    speed = np.concatenate([np.full(300, 100.0), np.full(300, -100.0), np.full(400, 120.0)])
    ended = simulate(CIRCUIT, speed, 2e-3, replace(circuit_of(PAPER), stroke=0.03), sensors=RIG, rng=rng)
    one = blocks_of(ended)
    fits = fit_classes(one, ACTUATOR)
    with_stop, again = with_end_stop(one, fits, ACTUATOR)
    free, same = with_end_stop(blocks(), classes(), ACTUATOR)
    return {
        "reach and stop [m]": [one.reach, with_stop.stop],
        "scales before and after": [fits.best.scales, again.best.scales],
        "free": [free.stop, same is classes()],
        "stands": {
            f"{reach:g} mm away for {rest:g} s": _rests_at_end(resting(1e-3 * reach, rest)) for reach, rest in STANDING
        },
    }


def verdict_of(asked: EhaParameters, calls: list[float], blocks: Blocks) -> Any:
    """Return a diagnosis with an objection unless the load is within 40 N of 300 N."""
    calls.append(asked.load_force)
    off = 300.0 - asked.load_force
    notes: tuple[Note, ...] = (
        (AgainstCode.PRESSURE_BIAS.note(bias_pa=0.8 * off / asked.piston_area),) if abs(off) > 40.0 else ()
    )
    return SimpleNamespace(against=notes, scoreboard=SimpleNamespace(blocks=blocks))


@NUMBERS.case()
def loads_that_are_tried() -> dict[str, Any]:
    explained = SimpleNamespace(values={"start_pressure": (1.5e5, 1.0)})
    estimate = cast("BulkModulusEstimate", SimpleNamespace(explanation=explained))
    none = cast("BulkModulusEstimate", SimpleNamespace(explanation=None))
    short = replace(blocks(), pressure=np.array([1e5, np.nan, 3e5]))
    standing = replace(blocks(), velocity=np.zeros_like(blocks().velocity))
    calls: list[float] = []
    found = with_rod_load(lambda asked, _: verdict_of(asked, calls, standing), PAPER, none)
    endless: list[float] = []
    first = with_rod_load(lambda asked, _: verdict_of(replace(asked, piston_area=1e9), endless, standing), PAPER, none)
    shown = force_balance(blocks(), PAPER)
    assert shown is not None
    return {
        "first guesses [N]": [one.load_force for one in first_guesses(short, PAPER, estimate, shown)],
        "without an explanation [N]": [one.load_force for one in first_guesses(short, PAPER, none, None)],
        "of a loaded rig [N]": [one.load_force for one in first_guesses(short, SHORT.circuit, estimate, None)],
        "tried [N]": [*calls, found.parameters.load_force],
        "named": [dict(note.data) for note in found.notes],
        "tried in vain [N]": [*endless, first.parameters.load_force],
        "force balance": [shown.values, shown.std, shown.shares],
    }


@NUMBERS.case()
def errors_of_the_models() -> dict[str, Any]:
    record = log(drive="steps", seconds=1.0)
    bank = {
        name: p for name, p in mathematical_bank(PAPER).items() if name in ("normal", "minor_leakage", "major_friction")
    }
    both, one = score_mathematical(record, bank), score_mathematical(record, bank, pressure=False)
    told: dict[str, Any] = {
        "scores": dict(both.by_condition),
        "errors": {channel: dict(errors) for channel, errors in both.rmse.items()},
        "without pressure": dict(one.by_condition),
        "margin": [error_margin(both), error_margin(one)],
        "velocity [m/s]": measured_velocity(record)[[3, 100, 400]],
        "velocity from position [m/s]": measured_velocity(record.replace(velocity_m_s=None))[[0, 3, 100, 400]],
    }
    for name, least, following in (
        ("alike", 0.3, 0.30029),
        ("apart", 0.3, 0.30031),
        ("poor", 0.51, 0.9),
        ("fair", 0.49, 0.9),
        ("exact", 0.0, 0.1),
        ("lost", np.inf, np.inf),
    ):
        scores = Scores({"normal": following, "minor_leakage": least}, {"velocity_m_s": {}, PRESSURE: {}})
        verdict = models_verdict(scores, record)
        told[name] = {"outcome": str(verdict.outcome), "notes": noted(verdict.notes), "against": noted(verdict.against)}
    size = float(np.sqrt(np.mean(record["velocity_m_s"] ** 2)))
    for share in (0.49, 0.51):
        scores = Scores({"normal": 2.0 * size, "minor_leakage": share * size}, {"velocity_m_s": {}})
        told[f"velocity alone, {share:g}"] = noted(models_verdict(scores, record).against)
    return told


def held(*levels: float, wobble: float = 0.0, drift: float = 0.0, each: int = 500) -> Record:
    ramp = np.linspace(-0.5, 0.5, each)
    wave = np.where(np.arange(each) % 2 == 0, 1.0, -1.0)
    speed = np.concatenate([level * (1.0 + drift * ramp * each / 50.0 + wobble * wave) for level in levels])
    return Record(1e-3, {"motor_speed_rad_s": speed, "position_m": np.zeros(len(speed))})


@NUMBERS.case()
def advice() -> dict[str, Any]:
    speeds = {
        "two": held(100.0, 60.0),
        "one": held(100.0, 97.0),
        "close ones": held(100.0, 96.0, 92.0, 88.0, 84.0),
        "closer ones": held(100.0, 96.0, 92.0, 88.0),
        "wobbling a little": held(100.0, 50.0, wobble=0.04),
        "wobbling": held(100.0, 50.0, wobble=0.06),
        "drifting a little": held(100.0, 50.0, drift=0.008),
        "drifting": held(100.0, 50.0, drift=0.012),
        "slow ones": held(100.0, 6.0, 4.0),
        "still": held(0.0),
        "one briefly": Record(
            1e-3,
            {
                "motor_speed_rad_s": np.concatenate([np.full(5000, 100.0), np.full(50, 40.0)]),
                "position_m": np.zeros(5050),
            },
        ),
        "one less briefly": Record(
            1e-3,
            {
                "motor_speed_rad_s": np.concatenate([np.full(5000, 100.0), np.full(200, 40.0)]),
                "position_m": np.zeros(5200),
            },
        ),
        "of a slow log": Record(0.04, {"motor_speed_rad_s": np.repeat([100.0, 60.0], 30), "position_m": np.zeros(60)}),
    }
    sure, unsure = {"normal": 0.91, "minor_leakage": 0.09}, {"normal": 0.89, "minor_leakage": 0.11}
    short, long = held(100.0, 60.0), held(100.0, 60.0, each=5001)
    alike = [ClassCode.LEAKAGE_AND_BIAS_ALIKE.note(), ClassCode.FRICTION_NOT_VISIBLE.note()]
    both = ("velocity_m_s", PRESSURE)
    return {
        "speeds held": {name: held_speed_count(record) for name, record in speeds.items()},
        "sure": noted(advice_for(short, sure, [], [], both)),
        "unsure of a short log": noted(advice_for(short, unsure, [], [], both)),
        "unsure of a long log": noted(advice_for(long, unsure, [], [], both)),
        "alike at two speeds": noted(advice_for(short, sure, [], alike, both)),
        "alike at one": noted(advice_for(held(100.0), sure, [], alike, ("velocity_m_s",))),
        "nothing told": noted(advice_for(short, {}, [], [], both)),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
