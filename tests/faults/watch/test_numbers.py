"""Statistics, scores and alarms of the watch over balances, kept in `numbers.json`."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from faults.watch import loss
from faults.watch.balances import FEATURES, GAINS, count_gains, learn, regress, shift, solve
from faults.watch.cusum import accumulate, threshold, white_threshold
from faults.watch.events import Alarm, Event, Ready, change_time
from faults.watch.excitation import LEAST_BLOCKS, OCTAVES, excitation_octave, speed_class, standardise
from faults.watch.growth import growth_time
from faults.watch.loss import (
    DELAYS,
    SEEN,
    WORK,
    count_lag,
    count_work,
    drive_is_alike,
    judge_loss,
    learn_loss_again,
    loss_threshold,
    measure_lag,
    measure_work,
)
from faults.watch.memory import empty_memory
from faults.watch.resolution import PLACE, find_step, least_deviation, unresolved
from faults.watch.samples import watched_samples
from faults.watch.watch import Watch, watch_record
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
P = EhaParameters()
KNOWN = ("BLOCKS", "SPANS", "WANTED", "SHARE", "RATIO", "RESISTANCE", "FAST", "LIVELY", "OTHERS")
LATER = ("SPREAD", "KNOWN", "LAST", "LAST_RESISTANCE", "RISEN", "LIMIT", "SEEN")


def motion(count: int = 60) -> Array:
    """Return scaled speed, velocity and pressure of an actuator with lag and leakage, with a little noise."""
    rng = np.random.default_rng(3)
    w = np.sign(np.sin(0.5 * np.arange(count))) * (0.6 + 0.3 * np.cos(0.21 * np.arange(count)))
    v = np.zeros(count)
    for k in range(1, count):
        v[k] = v[k - 1] + 0.4 * (0.9 * w[k] - v[k - 1])
    p = 0.3 * v + 0.1 * np.tanh(v / 0.02)
    return np.column_stack([w, v, p]) + 0.01 * rng.standard_normal((count, 3))


@NUMBERS.case()
def regressions_that_are_learnt() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, balances in (("flow and force", 2), ("motion", 1)):
        lags, features, target = np.zeros(8), np.zeros((2, FEATURES)), np.zeros(balances)
        information, moment = np.zeros((balances, FEATURES, FEATURES)), np.zeros((balances, FEATURES))
        found, factor, errors = np.zeros((balances, FEATURES)), np.zeros((FEATURES, FEATURES)), np.zeros((60, balances))
        for k, (w, v, p) in enumerate(motion()):
            regress(w, v, p, lags, features, target)
            for c in range(balances):
                errors[k, c] = learn(c, features, target, 0.99, information, moment, found)
                if k % 10 == 9:
                    solve(information[c], moment[c], found[c], factor)
            shift(w, v, p, lags)
        told[name] = {
            "features": features[:balances],
            "targets": target,
            "lags": lags,
            "moments": moment,
            "information": information[:, FEATURES - 1],
            "coefficients": found,
            "errors": errors[[5, 15, 34, 59]],
        }
    gains = np.zeros((2, GAINS))
    for k, (w, v, p) in enumerate(motion(20)):
        count_gains(w, v, p, k % 2, gains)
    told["gains"] = gains
    return told


@NUMBERS.case()
def sums_of_scores_and_their_thresholds() -> dict[str, Any]:
    rng = np.random.default_rng(6)
    score, peaks, along = np.zeros(4), np.zeros(401), []
    for u in rng.standard_normal(4000):
        accumulate(score, peaks, float(u), 1.0, 0.02)
        along.append(score[:2].copy())
    return {
        "sum and peak": [along[place] for place in (10, 250, 1999, 3999)],
        "peaks": peaks[:40],
        "largest of all peaks": int(np.flatnonzero(peaks)[-1]),
        "threshold by how many alarms are allowed": [
            threshold(peaks[:-1], 0.0, 0.02, expected) for expected in (0.01, 1.0, 50.0, 2000.0)
        ],
        "threshold after alarms": [threshold(peaks[:-1], alarms, 0.02, 1.0) for alarms in (1.0, 5.0, 40.0)],
        "threshold without peaks": threshold(np.zeros(40), 0.0, 0.02, 1.0),
        "threshold of white noise": [white_threshold(rate) for rate in (0.02, 1e-4, 7e-6, 1e-9)],
        "threshold of few peaks": threshold(np.where(np.arange(40) % 9 == 4, 1.0, 0.0), 2.0, 0.02, 0.5),
    }


@NUMBERS.case()
def excitation_and_standard_scores() -> dict[str, Any]:
    usual, scores = np.zeros(4), []
    for k, value in enumerate(0.5 + 0.3 * np.sin(1.7 * np.arange(60.0)) + 0.9 * (np.arange(60) == 50)):
        scores.append(standardise(float(value), 30.0, k > 10, 0.0, float(k), usual))
    return {
        "octaves": [excitation_octave(change) for change in (0.0, 5e-4, 1.1e-3, 0.02, 0.9, 3.0, 1e4)],
        "count of octaves": OCTAVES,
        "classes by speed": [speed_class(fast) for fast in (0.0, 0.05, 0.051, 0.1, 0.5, 1.0, 1.3, 9.0)],
        "blocks before a score": LEAST_BLOCKS,
        "scores": [scores[place] for place in (5, 19, 20, 21, 35, 50, 59)],
        "mean, variance, count": usual,
        "largest score": standardise(1e6, 30.0, True, 0.0, 60.0, usual),
        "score with a least deviation": standardise(1.5, 30.0, True, 0.9, 60.0, np.array([0.5, 0.04, 30.0, 59.0])),
    }


@NUMBERS.case()
def rounding_of_the_channels() -> dict[str, Any]:
    steps = np.array([[np.nan] * 3, [np.inf] * 3])
    for k, value in enumerate((0.0, 0.4, 0.4, np.nan, 0.1, 0.103, 0.103004, 0.2)):
        find_step(value, 10.0, k % 3, steps)
        find_step(value, 4.0, PLACE, steps)
    rounding = [unresolved(balance, balances, steps) for balance, balances in ((0, 1), (0, 2), (1, 2))]
    usual = [-30.0, -15.0, -12.0, -9.0, 0.0]
    return {
        "last samples and smallest steps [fraction]": steps,
        "squared residual of motion, flow, force": rounding,
        "least deviation by usual log NIS": [least_deviation(1e-5, one) for one in usual],
        "least deviation without rounding": least_deviation(0.0, -12.0),
    }


@NUMBERS.case()
def when_something_began() -> dict[str, Any]:
    rng = np.random.default_rng(9)
    noise, ends = 0.02 * rng.standard_normal(30), 100.0 + 5.0 * np.arange(30.0)
    rising = np.concatenate([rng.standard_normal(12) + 2.0, rng.standard_normal(40) - 0.3])
    k = np.arange(30)
    courses = {"stepped": 0.1 * (k >= 18), "growing": 0.01 * np.maximum(k - 12, 0), "still": 0.0 * k}
    return {
        "change of scores": [
            *_place(change_time(rising)),
            *_place(change_time(rising[:15])),
            *_place(change_time(-np.ones(5))),
        ],
        "growth of a loss [s]": {
            name: [*_place(growth_time(0.1 + course + noise, ends))] for name, course in courses.items()
        },
        "growth of little": [*_place(growth_time(np.array([0.1, 0.2, 0.3]), ends[:3]))],
        "growth of alike": [*_place(growth_time(0.1 + 0.03 * np.sin(0.5 * k) + courses["stepped"], ends))],
    }


def _place(found: tuple[float, tuple[float, float]]) -> list[float]:
    return [found[0], *found[1]]


@NUMBERS.case()
def losses_of_a_span() -> dict[str, Any]:
    work, told = np.zeros(WORK), np.zeros(6)
    for w, v, p in motion():
        count_work(w, v, p, work)
    measure_work(work, told)
    speeds, lag, lost = np.zeros((2, DELAYS + 2)), np.zeros((DELAYS + 2, DELAYS + 2)), np.zeros(DELAYS + 2)
    for k, (w, v, _) in enumerate(motion(400)):
        count_lag(w, v, k > DELAYS + 1, speeds, lag, lost)
    behind, nothing = np.zeros(6), np.zeros(6)
    measure_lag(lag, lost, behind)
    measure_work(np.zeros(WORK), nothing)
    unclear = np.zeros(6)
    measure_lag(lag * 0.02, lost * 0.02, unclear)
    return {
        "work": work,
        "told by work": told,
        "products of delayed speeds": lag[[0, 3, 17], :4],
        "lost flow": lost,
        "told by lag": behind,
        "told of nothing": nothing,
        "told of little": unclear,
        "thresholds of a loss": [loss_threshold(expected) for expected in (1e-4, 1e-2, 0.3)],
    }


@NUMBERS.case()
def losses_that_are_judged() -> dict[str, Any]:
    rng = np.random.default_rng(12)
    memory = empty_memory(2, 8.0)
    known, levels = memory.known, memory.levels
    known[loss.WANTED] = 12.0
    along: dict[str, Any] = {}
    for k in range(60):
        share = 0.1 + 0.004 * rng.standard_normal() + (0.006 * (k - 30) if k > 30 else 0.0)
        told = np.array([share, 1.3 * share, 0.8, 0.3, 1.0, 0.9]) * (1.3 if k in (20, 21) else 1.0)
        alike = drive_is_alike(told, known)
        raised = judge_loss(told, float(200 * k), known, levels) if alike else False
        if k in (3, 11, 19, 21, 40, 50, 59):
            along[f"after span {k}"] = {
                "alike": alike,
                "raised": raised,
                **{name.lower(): known[place] for place, name in enumerate((*KNOWN, *LATER))},
            }
    other = known.copy()
    other[loss.OTHERS] = 10.0
    far = np.array([0.1, 0.1, 0.8, 0.3, 2.0, 0.9])
    ways = [
        drive_is_alike(np.array([0.1, 0.1, 0.8, 0.3, fast, lively]), known.copy())
        for fast, lively in ((1.2, 0.9), (1.3, 0.9), (1.0, 0.75), (1.0, 0.7), (0.82, 1.1), (0.7, 1.1))
    ]
    changed = [
        drive_is_alike(far, other),
        float(other[loss.OTHERS]),
        drive_is_alike(far, other),
        float(other[loss.WANTED]),
        float(other[loss.SPANS]),
    ]
    learn_loss_again(known)
    return along | {
        "levels": levels[:6],
        "alike by how": ways,
        "another drive": changed,
        "begun again": known[[1, 2, 8, 13]],
        "kept": SEEN + 1,
    }


@NUMBERS.case()
def memory_at_its_start() -> dict[str, Any]:
    memory = empty_memory(1, 7.5)
    return {name: [list(one.shape), np.unique(one)] for name, one in memory._asdict().items()}


@cache
def watched_log(seconds: float = 150.0, sample_time: float = 2e-3) -> Array:
    """Return a first-order actuator under random reversals whose loss jumps at 90 s, and grows from 105 s on."""
    rng = np.random.default_rng(0)
    count = round(seconds / sample_time)
    time = sample_time * np.arange(count)
    speed = P.rated_speed * np.repeat(rng.choice((-1.0, 1.0), count // 25 + 1), 25)[:count]
    flow = P.pump_displacement * speed / P.piston_area
    share = np.where(time < 90.0, 0.9, 0.75) - np.maximum(time - 105.0, 0.0) * 0.006
    velocity = np.zeros(count)
    for k in range(1, count):
        velocity[k] = velocity[k - 1] + 0.2 * (share[k] * flow[k] - velocity[k - 1])
    pressure = (P.friction_linear * velocity + P.friction_coulomb * np.tanh(velocity / 1e-3)) / P.piston_area
    noise = rng.standard_normal((count, 3))
    rows = np.column_stack([speed, np.cumsum(velocity) * sample_time, pressure]) + noise * [0.05, 1e-6, 5e3]
    rows[20000:20007] = np.nan
    return rows


def said(events: list[Event]) -> list[dict[str, Any]]:
    told: list[dict[str, Any]] = []
    for event in events:
        match event:
            case Ready(time=time, thresholds=thresholds):
                told.append({"ready [s]": time, "thresholds": thresholds})
            case Alarm():
                names = ("time", "balance", "since", "interval", "score", "threshold")
                told.append({f"alarm: {name}": getattr(event, name) for name in names})
            case _:
                told.append({"change [s]": event.time, "lost before and after": event.lost, "pressure": event.pressure})
    return told


@NUMBERS.case(relative=1e-5)
def events_of_a_watched_log() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, pressure in (("with pressure", True), ("without", False)):
        watch = Watch(P, 2e-3, pressure=pressure, learning=60.0, start=10.0)
        events = watch.take(watched_log()[:40000])
        halfway = {
            "scores": watch.scores,
            "thresholds": watch.thresholds,
            "time [s]": watch.time,
            "last [s]": watch.last,
        }
        events += watch.take(watched_log()[40000:])
        ends = {"scores": watch.scores, "thresholds": watch.thresholds, "time [s]": watch.time}
        memory = watch.remembered()
        told[name] = {
            "after 80 s": halfway,
            "events": dict(enumerate(said(events))),
            "at the end": ends,
            "coefficients": memory["memory_5"],
            "gains": memory["memory_9"][100],
            "what is known of the loss": memory["memory_15"],
            "asked": memory["asked"],
        }
    return told


@NUMBERS.case(relative=1e-5)
def watches_that_are_interrupted_or_ask_otherwise() -> dict[str, Any]:
    rows = watched_log()
    watch = Watch(P, 2e-3, learning=60.0)
    watch.take(rows[:33333])
    watch.interrupt()
    watch.clock_reads(500.0)
    after = {"time [s]": watch.time, "scores": watch.scores}
    watch.take(rows[33333:40000])
    few = Watch(P, 0.01, learning=80.0, false_alarms=30.0)
    events = few.take(rows[::5])
    slow = Watch(P, 0.03, learning=100.0)
    record = Record(2e-3, {"motor_speed_rad_s": rows[:, 0], "position_m": rows[:, 1]}, start_time=4.0)
    return {
        "once interrupted": after,
        "later": {"time [s]": watch.time, "scores": watch.scores, "thresholds": watch.thresholds},
        "many false alarms": dict(enumerate(said(events))),
        "asked of a slow log": slow.remembered()["asked"],
        "a record without pressure": dict(enumerate(said(watch_record(record.slice(0, 50000), P, learning=60.0)))),
    }


@NUMBERS.case()
def samples_of_any_channels() -> dict[str, Any]:
    speed, position = np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.4])
    both = {
        "motor_speed_rad_s": speed,
        "position_m": position,
        "pressure_a_pa": 5e5 * speed,
        "pressure_b_pa": 1e5 * speed,
    }
    only = {"motor_speed_rad_s": speed, "velocity_m_s": np.array([0.1, np.nan, 0.3])}
    return {name: list(watched_samples(some, 0.1, 2.0)) for name, some in (("two chambers", both), ("velocity", only))}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
