"""Limits at which a sensor is no longer trusted, kept in `numbers_sensors.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.log_checks import frozen_encoder, sensor_check
from plant.arrays import Array
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.log_checks.made_logs import (
    HEALTHY,
    LOG,
    POSITION,
    PRESSURE,
    ROWS,
    SPEED,
    VELOCITY,
    N,
    T,
    accused,
    first_with,
    gone,
    names,
    noise,
    stands,
)
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def sensors_that_froze() -> dict[str, Any]:
    return {
        "sound": accused(),
        **{
            f"{channel} from {begin} on": accused(**{channel: stands(LOG[channel], begin, 400)})
            for channel in (POSITION, VELOCITY, PRESSURE)
            for begin in (200, 700)
        },
        **{
            f"{channel}, samples": first_with(
                lambda count, channel=channel: names(**{channel: stands(LOG[channel], 640, count)}), 10, 90
            )
            for channel in (VELOCITY, PRESSURE)
        },
        "velocity, without an encoder": accused(**{VELOCITY: stands(LOG[VELOCITY], 200, 400), POSITION: None}),
        "velocity that goes on as the encoder": accused(
            **{
                VELOCITY: stands(LOG[VELOCITY], 200, 400),
                POSITION: np.where(
                    ROWS < 200, LOG[POSITION], LOG[POSITION][200] + LOG[VELOCITY][200] * T * (ROWS - 200)
                ),
            }
        ),
        "velocity, how far the encoder strays [m]": edge(
            lambda one: names(
                **{
                    VELOCITY: np.where((ROWS >= 200) & (ROWS < 600), 0.0, noise(1e-4)),
                    POSITION: one * np.sin(0.05 * ROWS),
                }
            ),
            1e-7,
            1e-2,
            16,
        ),
        "velocity, how far a coarse encoder strays [m]": edge(
            lambda one: names(
                **{
                    VELOCITY: stands(noise(1e-4), 200, 400),
                    POSITION: 1e-4 * np.rint(1e4 * one * np.sin(0.05 * ROWS)),
                }
            ),
            2e-4,
            1e-2,
            16,
        ),
        "velocity, of an encoder that is hardly there": [
            names(
                **{
                    VELOCITY: stands(LOG[VELOCITY], 200, 400),
                    POSITION: np.where(
                        (ROWS < 200) | (ROWS % 20 == 0) & (200 + 20 * count > ROWS), LOG[POSITION], np.nan
                    ),
                }
            )
            for count in (18, 19, 20)
        ],
        "pressure, pump at rest": accused(
            **{PRESSURE: stands(LOG[PRESSURE], 200, 400), SPEED: np.where((ROWS > 190) & (ROWS < 620), 0.0, LOG[SPEED])}
        ),
        "pressure, pump within its dead zone, turns at [rad/s]": edge(
            lambda one: names(
                **{
                    PRESSURE: stands(LOG[PRESSURE], 200, 400),
                    SPEED: np.where((ROWS > 190) & (ROWS < 620), one * np.sin(0.1 * ROWS), LOG[SPEED]),
                }
            ),
            1.0,
            20.0,
            16,
        ),
        "pressure, share of its largest": edge(
            lambda one: names(
                **{
                    PRESSURE: np.where(
                        (ROWS >= 200) & (ROWS < 600),
                        one * np.abs(LOG[PRESSURE]).max(),
                        np.clip(LOG[PRESSURE], -9e9, 9e9),
                    )
                }
            ),
            0.5,
            1.0,
            16,
        ),
        "constant": accused(**{PRESSURE: np.where(ROWS % 7 == 0, np.nan, 3e5)}),
        "constant, without a pump": accused(**{PRESSURE: np.full(N, 3e5), SPEED: None}),
        "a hold with gaps": accused(**{PRESSURE: gone(stands(LOG[PRESSURE], 200, 400), *range(300, 400, 2))}),
    }


@NUMBERS.case()
def holds_that_mean_something() -> dict[str, Any]:
    longest = sensor_check._longest_hold  # pyright: ignore[reportPrivateUsage]
    wave = np.sin(0.3 * np.arange(200.0))

    def found(values: Array, sample_time: float) -> Any:
        hold = longest(values, sample_time)
        return None if hold is None else [hold.start, hold.stop]

    def hold_of(repeats: float) -> Any:
        rough = np.floor(np.arange(N) * (1.0 - repeats)) % 50
        hold = sensor_check._hold_of(Record(T, {"x": stands(rough, 300, 500)}), "x")  # pyright: ignore[reportPrivateUsage]
        return hold is None

    return {
        "samples at 10 kHz": [found(stands(wave, 30, count), 1e-4) for count in (20, 21, 22, 150)],
        "samples at 1 kHz": [found(stands(wave, 30, count), 1e-3) for count in (20, 21, 50, 51, 52)],
        "samples at 100 Hz": [found(stands(wave, 30, count), 1e-2) for count in (6, 19, 20, 21, 22)],
        "with gaps": found(gone(stands(wave, 30, 60), 40, 41, 42, 89), 1e-3),
        "nothing": found(np.full(30, np.nan), 1e-3),
        "repeats of a coarse channel": edge(hold_of, 0.1, 0.9, 12),
        "all": str(sensor_check._hold_of(Record(T, {"x": np.ones(200)}), "x")),  # pyright: ignore[reportPrivateUsage]
        "quanta": [
            sensor_check._quantum(one)  # pyright: ignore[reportPrivateUsage]
            for one in (np.array([1.0, 1.0, 3.0, 2.5]), np.ones(4), np.array([1.0, np.nan, 1.5]))
        ],
        "pumped [m^3/s]": sensor_check._pumped_flow(np.array([-9.0, -3.0, 0.0, 4.0, 5.0, 50.0]), HEALTHY),  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case()
def pistons_that_slid() -> dict[str, Any]:
    slid = sensor_check.shows_motion

    def by(speed: float, size: float = 1e-4, quantum: float = 1e-6, count: int = 400) -> list[bool]:
        position = quantum * (np.arange(600) % 3)
        return list(
            slid(Record(1e-3, {POSITION: position, VELOCITY: speed + noise(size, 600)}), slice(100, 100 + count))
        )

    return {
        "fast": by(0.01),
        "slow": by(1e-7),
        "still": by(0.0, 0.0),
        "against noise, from [m/s]": edge(lambda one: by(one)[0], 1e-7, 0.01),
        "against a coarse encoder, from [m/s]": edge(lambda one: by(one, 1e-7, 1e-4)[0], 1e-5, 0.1),
        "by the length": [by(2e-5, 1e-4, 1e-7, count)[0] for count in (36, 40, 100, 200, 300, 400, 450)],
        "without velocity": list(slid(Record(1e-3, {POSITION: np.ones(60)}), slice(10, 50))),
    }


@NUMBERS.case()
def encoders_that_jump() -> dict[str, Any]:
    def jumps(size: float, speed: float, hold: int = 100, begin: int = 100, late: int = 0) -> bool:
        rows = np.arange(300)
        position = np.where(rows < begin, 1e-5 * rows, 1e-5 * begin)
        position = np.where(rows >= begin + hold, 1e-5 * begin + size + 1e-5 * (rows - begin - hold), position)
        position[begin + hold : begin + hold + late] = np.nan
        record = Record(1e-3, {POSITION: position, SPEED: np.where(rows == 50, -speed, 0.0)})
        return frozen_encoder.ends_with_jump(record, slice(begin, begin + hold), HEALTHY)

    return {
        "jump from [m], beside the others": edge(lambda one: jumps(one, 1.0), 1e-6, 1e-2),
        "jump from [m], beside the pump": edge(lambda one: jumps(one, 150.0), 1e-5, 1e-2),
        "jump from [m], late": edge(lambda one: jumps(one, 150.0, late=4), 1e-5, 1e-2),
        "at the end": jumps(1.0, 1.0, 200),
        "from the first": jumps(1e-3, 1.0, 100, 0),
        "without a pump": frozen_encoder.ends_with_jump(
            Record(1e-3, {POSITION: np.where(np.arange(99) < 50, 0.0, 1.0)}), slice(0, 50), HEALTHY
        ),
    }


@NUMBERS.case()
def motions_that_an_encoder_missed() -> dict[str, Any]:
    hold = slice(500, 900)
    still = stands(LOG[POSITION], 500, 400)

    def missed(hold: slice = hold, **change: Any) -> bool:
        return frozen_encoder.misses_motion(LOG.replace(**{POSITION: still, **change}), hold, HEALTHY)

    inside = (ROWS >= 500) & (ROWS < 900)

    def within(channel: str, value: Array | float) -> dict[str, Array]:
        return {channel: np.where(inside, value, LOG[channel])}

    quiet = within(PRESSURE, LOG[PRESSURE][500])
    return {
        "as the log": missed(),
        "pump at rest": missed(**within(SPEED, 0.0)),
        "a pump that turns, from [rad/s]": edge(lambda one: missed(**within(SPEED, one), **quiet), 0.0, 200.0, 14),
        "a pump that turns for a while, from [s]": edge(
            lambda one: missed(
                **{SPEED: np.where(inside & (one / T < ROWS - 600), 0.0, np.where(inside, 60.0, LOG[SPEED]))}, **quiet
            ),
            -0.2,
            0.5,
            10,
        ),
        "under pressure, leaks from [Pa]": edge(
            lambda one: missed(**within(SPEED, 15.0), **within(PRESSURE, one)), 1e5, 3e6, 14
        ),
        "at relief, from [Pa]": edge(
            lambda one: missed(**within(SPEED, 150.0), **within(PRESSURE, one)), 2e6, 3.4e6, 14
        ),
        "blocks outside of it": [
            frozen_encoder.misses_motion(
                LOG.replace(
                    **{POSITION: stands(LOG[POSITION], 10 * count, N)},
                    **{SPEED: np.where(10 * count <= ROWS, 100.0, LOG[SPEED])},
                ).slice(0, 800),
                slice(10 * count, 800),
                HEALTHY,
            )
            for count in (20, 24, 25, 26, 27, 30)
        ],
        "share of pressure that is there": edge(
            lambda one: missed(
                **{PRESSURE: np.where(inside & (one > ROWS % 100), np.nan, LOG[PRESSURE])}, **within(SPEED, 60.0)
            ),
            0.0,
            100.0,
            10,
        ),
        "nothing known": [
            missed(**{PRESSURE: None}),
            missed(**{SPEED: None}),
            missed(**{PRESSURE: np.full(N, np.nan)}),
            missed(slice(500, 508)),
        ],
        "a fit that is not negative": [
            list(one)
            for one in frozen_encoder._non_negative_fit(  # pyright: ignore[reportPrivateUsage]
                np.column_stack([np.arange(9.0), np.cos(np.arange(9.0)), np.zeros(9)]),
                2.0 * np.arange(9.0) + noise(0.1, 9),
            )
        ],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
