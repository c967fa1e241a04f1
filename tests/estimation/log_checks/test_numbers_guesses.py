"""Limits at which a column is taken for a channel, or a unit for another one, kept in `numbers_guesses.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.log_checks import channel_guess
from estimation.log_checks.channel_guess import guess_channels
from plant.arrays import Array
from plant.log.headings import Heading
from tests.edges import edge
from tests.estimation.log_checks.made_logs import (
    HEALTHY,
    POSITION,
    PRESSURE,
    SPEED,
    VELOCITY,
    N,
    made_log,
    noise,
)
from tests.numbers import Numbers, told

NUMBERS = Numbers(__file__)


def guesses(named: dict[str, Any], channels: tuple[str, ...] | None = None, stamped: tuple[str, ...] = ()) -> list[Any]:
    headings = [Heading(name, stamped=name in stamped) for name in named]
    columns = {place: values for place, values in enumerate(named.values()) if values is not None}
    found = guess_channels(headings, columns, HEALTHY, *(() if channels is None else (channels,)))
    return [
        {
            "channel": one.guess.channel,
            "place": one.guess.place,
            "unit": one.guess.unit,
            "points": one.guess.points,
            "sure": one.guess.sure,
            "why": told(one.why),
        }
        for one in found
    ]


@NUMBERS.case()
def columns_that_are_guessed() -> dict[str, Any]:
    record = made_log(N)
    a = 2e6 + 0.5 * record[PRESSURE] + noise(2e4, seed=8)
    strange = {
        "k": record.time,
        "c1": record[POSITION] * 1e3,
        "c2": record[VELOCITY],
        "c3": record[SPEED],
        "c4": a,
        "c5": a - record[PRESSURE],
        "c6": record[PRESSURE],
        "c7": np.full(N, 3.0),
    }
    named = {"time_ms": 1e3 * record.time, "Weg [mm]": 1e3 * record[POSITION], "n": record[SPEED], "note": None}
    dates: Any = np.datetime64("2026-03-01T00:00:00", "ns") + (1e9 * record.time).astype("timedelta64[ns]")
    return {
        "strange": guesses(strange),
        "named": guesses(named),
        "dated": guesses({"when": dates, "c1": record[POSITION], "c2": record[VELOCITY]}, None, ("when",)),
        "the other way": guesses({"t": record.time, "c1": record[POSITION], "c2": -record[SPEED]}),
        "hardly any": guesses({"x": np.cos(np.arange(N)), "y": np.sin(np.arange(N)), "n": np.cos(0.1 * np.arange(N))}),
        "of two": guesses({"c1": record[POSITION], "c2": record[SPEED]}, ("position_m", "motor_speed_rad_s")),
        "a step back": guesses({"k": np.where(np.arange(N) == 40, 0.0, record.time), "x": record[POSITION]}),
        "stamps thrice": guesses({"k": record.time[np.arange(N) // 3 * 3], "x": record[POSITION]}),
        "beyond numbers": guesses(
            {"t": record.time, "x": np.where(np.arange(N) == 5, 1e250, 0.0), "y": record[POSITION]}
        ),
    }


@NUMBERS.case()
def limits_of_guesses() -> dict[str, Any]:
    g = channel_guess
    t = np.arange(400.0)
    way, rate = np.sin(0.02 * t), np.cos(0.02 * t)
    other = np.cos(0.11 * t)

    def motion(share: float, second: float = 0.0) -> Any:
        def of(one: float) -> Array:
            return one * rate + (1.0 - one**2) ** 0.5 * other

        points = {POSITION: {0: 0.0}, VELOCITY: {1: 0.0, 2: 0.0}, SPEED: {1: 0.0, 2: 0.0}}
        means = {0: way, 1: of(share), **({2: of(second)} if second else {})}
        g._by_motion(points, means, {})  # pyright: ignore[reportPrivateUsage]
        return points

    def pressed(share: float, left: float = 0.0, scale: float = -1.0) -> Any:
        points: Any = {PRESSURE: {0: 0.0, 1: 0.0, 2: 0.0}, SPEED: {3: 1.0}}
        one, two = way, 0.3 * rate + 0.05 * way
        third = one + scale * two + left * np.where(t % 2 == 0, 1.0, -1.0)
        means = {0: one, 1: two, 2: third, 3: share * one + (1.0 - share**2) ** 0.5 * other}
        g._by_pressure(points, means, {})  # pyright: ignore[reportPrivateUsage]
        return points[PRESSURE]

    def clock(stamps: Array) -> Any:
        points = {"time_s": {0: 0.0}}
        g._by_clock(points, {0: stamps}, {})  # pyright: ignore[reportPrivateUsage]
        return points["time_s"][0]

    jitter = np.random.default_rng(2).uniform(-0.5, 0.5, 400) + 0.45 * np.where(t % 2 == 0, 1.0, -1.0) * (t > 0)
    alike_ports = [way, way + 0.5 * other, 0.1 * way - 0.5 * other]
    return {
        "motion": motion(0.99),
        "motion, two": motion(0.99, 0.9),
        "slope from": edge(motion, 0.8, 0.999),
        "follows from": edge(lambda one: motion(0.99, one), 0.3, 0.9),
        "pressure": pressed(0.5),
        "weakly from": edge(pressed, 0.05, 0.9),
        "difference, left at most": edge(lambda one: pressed(0.0, one), 0.0, 0.2),
        "difference, by a large share": pressed(0.0, 0.0, -7.0),
        "sum": pressed(0.0, 0.0, 1.0),
        "ports alike": edge(
            lambda one: (2, 0, 1) in g._differences(np.array([way, way + one * other, one * other])),  # pyright: ignore[reportPrivateUsage]
            1e-3,
            0.5,
        ),
        "ports of nine and ten": [
            (2, 0, 1) in g._differences(np.array(alike_ports)[:, :count])  # pyright: ignore[reportPrivateUsage]
            for count in (9, 10, 15, 200)
        ],
        "clock": clock(t),
        "clock, jitter to": edge(lambda one: clock(t + one * jitter), 0.05, 0.95, 12),
        "clock, repeats to": edge(lambda one: clock(np.floor(t * one)), 0.05, 0.5, 10),
        "clock, one back": clock(t - 5.0 * (t == 40.0)),
        "blocks": {
            str(count): [len(one) for one in g._means({0: np.arange(float(count))}).values()]  # pyright: ignore[reportPrivateUsage]
            for count in (19, 20, 299, 599, 600, 3000)
        },
        "values of blocks": g._means({0: np.where(t % 5 == 0, np.nan, t), 1: np.ones(400)})[0][[0, 7, -1]],  # pyright: ignore[reportPrivateUsage]
        "still to": edge(
            lambda one: len(g._means({0: 1.0 + one * way})),
            1e-11,
            1e-7,  # pyright: ignore[reportPrivateUsage]
        ),
        "largest": [len(g._means({0: size * way})) for size in (0.0, 0.9e200, 1.1e200)],  # pyright: ignore[reportPrivateUsage]
        "there": [
            len(g._means({0: np.where(t < count, way + 2.0, np.nan)}))
            for count in (19, 20)  # pyright: ignore[reportPrivateUsage]
        ],
    }


@NUMBERS.case()
def units_that_are_guessed() -> dict[str, Any]:
    def of(*asked: Any) -> str:
        return channel_guess._usual_units(*asked)[0]  # pyright: ignore[reportPrivateUsage]

    ramp = np.linspace(-1.0, 1.0, 50)
    ranges = {
        SPEED: (0.1, 1e4),
        POSITION: (1e-5, 1e3),
        VELOCITY: (1e-5, 1e3),
        PRESSURE: (1.0, 1e7),
        "pressure_a_pa": (1.0, 1e7),
        "motor_voltage_v": (1e-3, 1e4),
    }
    return {
        **{
            channel: [
                edge(lambda one, channel=channel: of(channel, one * ramp, HEALTHY), low, (low * high) ** 0.5),
                edge(lambda one, channel=channel: of(channel, one * ramp, HEALTHY), (low * high) ** 0.5, high),
                [of(channel, size * ramp, HEALTHY) for size in (1e-6, 1e-3, 0.1, 1.0, 30.0, 1e3, 1e5, 1e7, 1e9)],
            ]
            for channel, (low, high) in ranges.items()
        },
        "time": [
            of("time_s", step * np.arange(50.0), HEALTHY) for step in (1e-6, 1e-5, 0.05, 0.2, 1.0, 50.0, 200.0, 1e5)
        ],
        "time from": edge(lambda one: of("time_s", one * np.arange(50.0), HEALTHY), 0.02, 1.0),
        "time that stands": of("time_s", np.ones(50), HEALTHY),
        "nothing": of(SPEED, np.full(5, np.nan), HEALTHY),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
