"""Plays, pump ripple and late channels as residuals and sensors show them, kept in `numbers_shown.json`."""

from collections.abc import Iterator
from dataclasses import astuple, replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from estimation.fits.greybox import play, play_courses, pump_ripple
from estimation.fits.greybox.lateness import LATE_NUDGE, lateness, residuals_and_changes
from estimation.fits.greybox.pump_ripple import (
    TOOTH_COUNTS,
    Ripple,
    _candidates,
    _ripple_speed,
    _shaft_angle,
    shown_ripple,
    with_ripple,
)
from estimation.fits.hypotheses import LEAST_PLAY
from estimation.models.flow import HELD_FLOW_FORM
from plant.arrays import Array
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.fits.short_logs import POSITION, PRESSURE, log, noted, problem, usual
from tests.numbers import Numbers, some

NUMBERS = Numbers(__file__)

TIME = 1e-3
SAMPLES = np.arange(900)
COURSE = (
    (0, 0.0),
    (150, 3e-3),
    (250, 3e-3),
    (300, 4e-3),
    (316, 4e-3),
    (350, 5e-3),
    (450, 5e-3),
    (650, 1e-3),
    (750, 1e-3),
    (899, 1.005e-3),
)
"""Rows and positions [m] of an encoder: up, rest, up, short rest, up, rest, back, rest, creep."""

WHEN, WHERE = np.array(COURSE).T

READING = 1e-6 * np.rint(1e6 * np.interp(SAMPLES, WHEN, WHERE))
FORCE = 1e6 * np.sin(0.021 * SAMPLES + 0.4) + 3e5 * np.sin(0.11 * SAMPLES)


@NUMBERS.case()
def courses_of_a_play() -> dict[str, Any]:
    holey = np.where(SAMPLES % 90 < 7, np.nan, FORCE)
    stands = play_courses.standings(READING)
    told: dict[str, Any] = {
        "movements": len(set(stands.first.tolist())),
        "sides": [float(stands.side[i]) for i in (0, 3, 200, 400, 600, 700, 899)],
        "next sides": [float(stands.next_side[i]) for i in (0, 3, 200, 400, 600, 700, 899)],
        "away": [int(stands.away[i]) for i in (0, 200, 400, 500, 700, 899)],
        "share": [float(stands.share[i]) for i in (0, 200, 400, 500, 700, 899)],
        "cells [m]": [
            play_courses.cell_width(one)
            for one in (READING, np.zeros(99), 1e-11 * np.arange(99), 3e-6 * np.random.default_rng(1).normal(size=99))
        ],
        "smoothed": [play_courses.smoothed(FORCE[:60], count)[[0, 4, 30, 58, 59]] for count in (1, 2, 3, 4, 5, 20, 21)],
    }
    for name, pressure, step in (
        ("plain", FORCE, TIME),
        ("holey", holey, TIME),
        ("slow", FORCE, 4e-3),
        ("steady", np.full(900, 2e5), TIME),
        ("none", np.zeros(900), TIME),
        ("reversed", -FORCE, TIME),
    ):
        courses = play_courses.crossings(READING, pressure, step)
        told[name] = {
            kind: some(column, 40)
            for kind, column in zip(("late", "by pressure", "at once", "sprung"), courses.T, strict=True)
        }
    return told


def shown_as(shown: play.ShownPlay) -> dict[str, float]:
    """Return the numbers of a shown play by name."""
    return {name: value for name, value in shown._asdict().items() if name != "moved"}


def standing(
    stood: int, rows: int = 400, step: float = TIME, seen: float = 0.0, noise: float = 0.0, yields: float = 1e-10
) -> Record:
    """Return a log whose encoder rests for ``stood`` samples at a time, while the piston yields to pressure."""
    time = step * np.arange(rows)
    force = 1e6 * np.sin(40.0 * time)
    yielded = yields * force
    rng = np.random.default_rng(2)
    at = np.cumsum(np.where(np.arange(rows) % (stood + 10) >= stood, rng.uniform(2e-5, 4e-5, rows), 0.0))
    velocity = np.gradient(yielded) / step + noise * rng.standard_normal(rows)
    return Record(
        step, {POSITION: 1e-6 * np.rint(1e6 * (at + seen * yielded)), "velocity_m_s": velocity, PRESSURE: force}
    )


@NUMBERS.case()
def plays_that_a_velocity_sensor_shows() -> dict[str, Any]:
    def shows(record: Record) -> bool:
        return play.sensed_play(record) != play.NO_PLAY

    record = log(2.0)
    held = record[POSITION].copy()
    for i in range(1, len(held)):
        held[i] = min(max(held[i - 1], record[POSITION][i] - 2.5e-5), record[POSITION][i] + 2.5e-5)
    missing = np.where(np.arange(len(record)) % 50 < 5, np.nan, record["velocity_m_s"])
    return {
        "an actuator's": [
            shown_as(play.sensed_play(record.replace(position_m=at, velocity_m_s=velocity)))
            for at in (record[POSITION], held)
            for velocity in (record["velocity_m_s"], missing)
        ],
        "standing": [
            shown_as(play.sensed_play(standing(40, seen=seen, noise=noise)))
            for seen, noise in ((0.0, 1e-5), (0.0, 1e-3), (0.3, 1e-5))
        ],
        "without noise of velocity": shown_as(play.sensed_play(standing(40))),
        "from samples of standing on": [stood for stood in range(10, 40) if shows(standing(stood, noise=1e-5))][:1],
        "from seconds of standing on": [
            stood for stood in range(2, 40) if shows(standing(stood, 1600, 2.5e-3, noise=1e-5))
        ][:1],
        "from samples on": [rows for rows in range(60, 260, 2) if shows(standing(60, rows, noise=1e-5))][:1],
        "seen by the encoder up to": edge(lambda seen: shows(standing(60, seen=seen, noise=1e-5)), 0.0, 1.5, 12),
        "from a yield on [m/Pa]": edge(lambda yields: shows(standing(60, noise=1e-5, yields=yields)), 0.0, 1e-10, 12),
        "structure": [
            play.play_structure(*one) for one in ((0.0, 0.0), (0.05, 0.0), (0.0, 0.05), (0.01, 0.02), (-0.05, 0.01))
        ],
        "left": [
            noted(play.omitted_play_note(*(play.ShownPlay(size, gain) for size, gain in shown)))
            for shown in (
                [(LEAST_PLAY, 9.0)],
                [(2.0 * LEAST_PLAY, play.PLAY_BELIEVED)],
                [(2.0 * LEAST_PLAY, 9.0), (3.0 * LEAST_PLAY, 9.0)],
                [(9.0 * LEAST_PLAY, 1.0), (3.0 * LEAST_PLAY, 9.0)],
            )
        ],
    }


def one_by_one(late: Iterator[tuple[str, tuple[float, float]]]) -> Iterator[tuple[str, dict[str, float]]]:
    for channel, (seconds, gain) in late:
        yield channel, {"late [s]": seconds, "gain": gain}


def left_of(free: Array) -> Array:
    """Return the part of a change that remains after an unknown has absorbed some of it."""
    return free - 0.3 * np.mean(free)


@NUMBERS.case()
def what_is_asked_of_residuals() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, one in {"flow": problem(), "held": problem(HELD_FLOW_FORM)}.items():
        theta = usual(one)
        known, changes = residuals_and_changes(one, theta, one.residuals(theta))
        assert known is not None
        errors = one.residuals(theta).ravel()
        told[name] = {
            "timed": list(one.log.timed),
            "known": some(known),
            "changes": [some(change) for change in changes],
            "drives": [some(drives - one.log.drives) for drives in play.crossed_drives(one)],
            "late": dict(one_by_one(lateness(one.log.timed, changes, errors, left_of))),
            "play": shown_as(play.shown_play(changes[-3:], errors, left_of)),
            "play, turned": shown_as(play.shown_play(changes[-3:], -errors, left_of)),
        }
    made = [np.array([[scale, 2.0 * scale, -scale]]) for scale in (1e-6, -2e-6, 0.0)]
    small = [0.01 * one for one in made]
    told["made up"] = {
        "late": [
            dict(one_by_one(lateness(["a", "b", "c"], made, np.array(one), left_of)))
            for one in ([1.0, 0.5, 0.2], [-3.0, 1.0, 2.0])
        ],
        "play": [
            shown_as(play.shown_play(made, np.array(one), left_of)) for one in ([1.0, 0.5, 0.2], [-3.0, 1.0, 2.0])
        ],
        "play, that is hardly felt": shown_as(play.shown_play(small, np.array([-3.0, 1.0, 2.0]), left_of)),
        "play, hardly along": shown_as(play.shown_play(made, 0.01 * np.array([-3.0, 1.0, 2.0]), left_of)),
        "nudges [s]": LATE_NUDGE,
        "of one that is not asked": _changes(replace_log(timed=())),
    }
    long = replace_log(block=12.0 * problem().log.sample_time)
    told["four samples on either side"] = [some(one) for one in _changes(long)]
    short = replace_log(sample_time=3.0 * problem().log.block)
    told["one sample a block"] = [some(one) for one in _changes(short)]
    return told


def _changes(one: Any) -> Any:
    return residuals_and_changes(one, usual(one), one.residuals(usual(one)))[1]


def replace_log(**changed: Any) -> Any:
    one = problem()
    return one.on(replace(one.log, **changed))


def sought(one: Any, theta: Any, errors: Any, counts: tuple[int, ...]) -> list[list[float]]:
    return [[each.count, each.offset, each.price] for each in _candidates(one, theta, errors, counts)]


@NUMBERS.case()
def teeth_in_residuals() -> dict[str, Any]:
    one = problem()
    theta = usual(one)
    errors, slopes = one.linearised(theta)
    columns = slopes.reshape(-1, slopes.shape[-1])
    bread = np.linalg.inv(columns.T @ columns + 1e-3 * np.eye(columns.shape[1])).astype(np.float64)
    told: dict[str, Any] = {}
    for name, counts in {"few": (7, 12), "many": TOOTH_COUNTS}.items():
        shown, offset = shown_ripple(one, theta, errors.ravel(), bread, columns, counts)
        told[name] = {
            str(count): [*astuple(each.teeth), each.teeth.amplitude, each.gain, each.std, *some(each.opened)]
            for count, each in shown.items()
        }
        told[f"{name}, offsets"] = [[each.offset, each.offset_std] for each in shown.values()]
        told[f"{name}, offset of speed"] = [offset.value, offset.gain, offset.std, *some(offset.opened)]
    fast = one.on(replace(one.log, drives=one.log.drives * np.array([4.0, 1.0])[: one.log.drives.shape[1]]))
    told["felt of a fast pump"] = list(shown_ripple(fast, theta, errors.ravel(), bread, columns, (5, 60))[0])
    leaks = one.model.unknowns.index("leakage_coefficient")
    rng = np.random.default_rng(6)
    made = [rng.normal(size=errors.size) for _ in range(6)]
    told["likeliest"] = [sought(one, theta, each, TOOTH_COUNTS) for each in made]
    with patch.object(pump_ripple, "LIKELIEST", len(TOOTH_COUNTS)):
        told["ranks"] = [sought(one, theta, each, TOOTH_COUNTS) for each in made]
        told["ranks of a fast pump"] = [sought(fast, theta, each, TOOTH_COUNTS) for each in made]
        told["ranks of a leaky pump"] = [
            sought(one, theta + leaky * (np.arange(len(theta)) == leaks), made[0], TOOTH_COUNTS) for leaky in (3.0, 5.0)
        ]
    told["likeliest of some"] = [sought(one, theta, each, (5, 9, 14, 17)) for each in made[:3]]
    speed = one.log.drives[:, 0]
    told["likeliest of a fast pump"] = [sought(fast, theta, each, TOOTH_COUNTS) for each in made]
    between, steps = _shaft_angle(one.log.drives[:, 0], one.log.sample_time)
    told["turned"] = [between[:3], some(between, 9), steps[:3], some(steps, 9)]
    told["delivered"] = [
        some(_ripple_speed(Ripple(count, *parts), (between, steps), one.log.sample_time), 9)
        for count in (7, 19)
        for parts in ((0.1, 0.0), (0.0, 0.1), (-0.03, 0.2))
    ]
    told["followed up to [rad/s]"] = edge(
        lambda rate: bool(np.any(with_ripple(steady(rate), [Ripple(12, 0.1, 0.0)]).drives[:, 0] != rate)), 100.0, 400.0
    )
    told["speed"] = some(speed)
    return told


def steady(rate: float) -> Any:
    log_of = problem().log
    return replace(log_of, drives=np.full((30, 1), rate), sample_time=TIME)


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
