"""What is removed from a log as hum, as repeated or as an outlier, kept in `numbers_taken_out.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.log_checks import held, hum, outliers
from estimation.log_checks.clean import clean_log
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
    gone,
    noise,
    stands,
)
from tests.numbers import Numbers, told

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def channels_that_are_held() -> dict[str, Any]:
    wave = np.round(0.1 * np.sin(0.05 * ROWS), 5)

    def rows_of(count: float, late: float = -9.0, quantum: float = 1e-5, size: float = 0.1) -> int:
        begins = (ROWS // count * count).astype(int)
        begins = np.where((noise(1.0, N, 9) < late) & (begins == ROWS), np.maximum(begins - 1, 0), begins)
        return held.held_rows(quantum * np.rint(size * np.sin(0.05 * begins) / quantum))

    found, notes = held.without_held_values(
        Record(T, {POSITION: wave[ROWS // 4 * 4], PRESSURE: wave[ROWS // 3 * 3], SPEED: wave[ROWS // 4 * 4]})
    )
    return {
        "every so many rows": [rows_of(count) for count in (1, 2, 3, 4, 7, 14, 15, 16)],
        "resolution, over its size": edge(lambda one: rows_of(4.0, -9.0, one), 1e-5, 0.1, 12),
        "late in a share of": edge(lambda one: rows_of(4.0, one), -3.0, 2.0, 10),
        "with a gap": held.held_rows(gone(wave[ROWS // 4 * 4], 7)),
        "runs on in a share of": edge(
            lambda one: held.held_rows(np.where(one > ROWS, wave, wave[ROWS // 4 * 4])), 0.0, 900.0, 10
        ),
        "of a log": [told(notes), {name: int(np.isnan(found[name]).sum()) for name in found}],
        "not in time": held.held_rows(wave[np.where(ROWS % 9 < 5, ROWS // 9 * 9, ROWS // 9 * 9 + 5)]),
        "hardly in time": edge(
            lambda one: held.held_rows(
                np.where(one > ROWS, wave[ROWS // 9 * 9 + np.where(ROWS % 9 < 6, 0, 6)], wave[ROWS // 4 * 4])
            ),
            0.0,
            900.0,
            10,
        ),
    }


def hummed(size: float, frequency: float = 50.3, motion: float = 0.0, **change: Any) -> Any:
    wave = np.sin(2.0 * np.pi * frequency * T * ROWS)
    record = LOG.replace(**{PRESSURE: LOG[PRESSURE] + size * wave, SPEED: LOG[SPEED] + motion * wave}).replace(**change)
    found, notes = hum.without_hum(record)
    return [told(notes), float(np.nanstd(found[PRESSURE]))] if PRESSURE in found else [told(notes)]


@NUMBERS.case()
def hums() -> dict[str, Any]:
    def count(*given: float, **change: Any) -> int:
        return len(hummed(*given, **change)[0])

    rows = {
        k: sum((np.sin(2.0 * np.pi * (47.0 + 4.0 * i) * T * ROWS) for i in range(k)), 0.0 * ROWS) for k in (1, 2, 12)
    }
    driven = np.sin(2.0 * np.pi * 12.5 * T * ROWS)
    return {
        "sound": hummed(0.0),
        "of 50.3 Hz": hummed(1.5e5),
        "of 100 Hz beside 150": hummed(
            1.5e5,
            100.0,
            **{
                PRESSURE: LOG[PRESSURE]
                + 1.5e5 * np.sin(0.3 + 2.0 * np.pi * 150.0 * T * ROWS)
                + 2e4 * np.sin(2.0 * np.pi * 100.0 * T * ROWS)
            },
        ),
        "with gaps": hummed(
            1.5e5,
            **{PRESSURE: gone(LOG[PRESSURE] + 1.5e5 * np.sin(2.0 * np.pi * 60.0 * T * ROWS), *range(50, 70), 400)},
        ),
        "size from [Pa]": edge(lambda one: count(one), 1e2, 4e5, 14),
        "lowest [Hz]": edge(lambda one: count(1.5e5, one), 30.0, 50.0, 10),
        "highest [Hz]": edge(lambda one: count(1.5e5, one), 150.0, 240.0, 10),
        "motion up to [rad/s]": edge(lambda one: count(1.5e5, 50.3, one), 0.0, 30.0, 12),
        "a row of lines": [count(0.0, **{PRESSURE: LOG[PRESSURE] + 1.5e5 * rows[k]}) for k in rows],
        "beside another of the share": edge(
            lambda one: count(
                1.5e5,
                80.0,
                **{
                    PRESSURE: LOG[PRESSURE]
                    + 1.5e5 * np.sin(2.0 * np.pi * 80.0 * T * ROWS)
                    + one * np.sin(2.0 * np.pi * 95.0 * T * ROWS)
                },
            ),
            1e2,
            2.9e4,
            12,
        ),
        "as far from another [Hz]": edge(
            lambda one: count(
                0.0,
                **{
                    PRESSURE: LOG[PRESSURE]
                    + 1.5e5
                    * (np.sin(2.0 * np.pi * 80.0 * T * ROWS) + 0.95 * np.sin(2.0 * np.pi * (80.0 + one) * T * ROWS))
                },
            ),
            10.0,
            60.0,
            10,
        ),
        "harmonic of the drive": [
            count(0.0, **{PRESSURE: LOG[PRESSURE] + 1e5 * driven + 1.5e5 * np.sin(2.0 * np.pi * f * T * ROWS)})
            for f in (87.5, 88.2, 89.0, 93.0)
        ],
        "without motion": [
            count(1.5e5, **{POSITION: None}),
            count(1.5e5, **{POSITION: None, SPEED: None}),
            count(1.5e5, **{POSITION: np.full(N, np.nan)}),
        ],
        "harmonic of the drive, off by [Hz]": edge(
            lambda one: count(
                0.0, **{PRESSURE: LOG[PRESSURE] + 1e6 * driven + 1.5e5 * np.sin(2.0 * np.pi * (100.0 + one) * T * ROWS)}
            ),
            0.2,
            4.0,
            10,
        ),
        "harmonic of the drive, short by [Hz]": edge(
            lambda one: count(
                0.0, **{PRESSURE: LOG[PRESSURE] + 1e6 * driven + 1.5e5 * np.sin(2.0 * np.pi * (100.0 - one) * T * ROWS)}
            ),
            0.2,
            4.0,
            10,
        ),
        "no pressure": hum.without_hum(LOG.replace(**{PRESSURE: None}))[1],
        "no sample": hum.without_hum(LOG.replace(**{PRESSURE: np.full(N, np.nan)}))[1],
        "between two lines [Hz]": [
            hum._line_frequency(np.arange(5.0) * 0.2, np.array(lines), place)  # pyright: ignore[reportPrivateUsage]
            for lines, place in (
                ([1.0, 5.0, 40.0, 9.0, 1.0], 2),
                ([9.0, 5.0, 1.0, 1.0, 2.0], 0),
                ([1.0, 1.0, 1.0, 1.0, 1.0], 2),
                ([1.0, 1.0, 1.0, 2.0, 9.0], 4),
            )
        ],
        "a tone in stretches [Pa]": hum._tone(
            LOG[PRESSURE][:700] + 1.5e5 * np.sin(0.9 * ROWS[:700] + 1e-6 * ROWS[:700] ** 2), 0.9 / (2.0 * np.pi)
        )[[0, 1, 170, 350, 699]],  # pyright: ignore[reportPrivateUsage]
        "a tone of a few": hum._tone(gone(np.sin(0.9 * ROWS[:7]), 2, 4), 0.14),  # pyright: ignore[reportPrivateUsage]
        "lines": hum._lines(LOG[PRESSURE][:411])[[0, 1, 50, 100, 150, -1]],  # pyright: ignore[reportPrivateUsage]
        "lines of what stands": hum._lines(np.ones(60)).max(),  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case()
def outliers_left_out() -> dict[str, Any]:
    wave = np.sin(0.05 * np.arange(400.0)) + noise(0.01, 400)

    def lost(values: Array, size: float = 0.0) -> list[int]:
        return np.flatnonzero(np.isnan(outliers.without_outliers(values, size))).tolist()

    def spiked(size: float, *places: int) -> Array:
        out = wave.copy()
        out[list(places)] += size
        return out

    step = np.where(np.arange(400) < 200, 0.0, 1.0) + noise(0.01, 400)
    peak = np.exp(-(((np.arange(400.0) - 200.0) / 3.0) ** 2)) + noise(0.001, 400)
    slip = LOG.replace(**{VELOCITY: LOG[VELOCITY] + 0.5 * (np.abs(ROWS - 700) < 2)})
    confirmed = slip.replace(**{POSITION: LOG[POSITION] + np.interp(ROWS, [698, 701], [0.0, 2.5e-3])})
    still = np.where(ROWS % 200 < 190, 2e5, LOG[PRESSURE])
    clipped = LOG.replace(**{PRESSURE: np.where(ROWS == 300, 3e6, still), POSITION: np.where(ROWS == 300, 1.0, still)})
    channels = (SPEED, POSITION, VELOCITY, PRESSURE, "absent")
    return {
        "sound": lost(wave),
        "one": lost(spiked(5.0, 100)),
        "one from": edge(lambda one: lost(spiked(one, 100)), 0.01, 2.0, 16),
        "one from, of known noise": edge(lambda one: lost(spiked(one, 100), 0.02), 0.01, 2.0, 16),
        "one on a bend from": edge(lambda one: lost(spiked(one, 31)), 0.01, 2.0, 16),
        "in a row": [lost(spiked(5.0, *range(100, 100 + count))) for count in (2, 3, 4, 5)],
        "at the ends from": [
            edge(lambda one, at=at: lost(spiked(one, at)), 0.5, 15.0, 14) for at in (0, 2, 3, 397, 399)
        ],
        "below at the ends from": edge(lambda one: lost(spiked(-one, 1)), 0.5, 15.0, 14),
        "a step": lost(step),
        "a peak": lost(peak),
        "of few": [lost(np.array([0.0, 0.1, 0.0, 9.0, 0.1, 0.0, 0.1, 0.0][:count])) for count in (6, 7, 8)],
        "with gaps": lost(gone(spiked(5.0, 100), 101, 102, 103)),
        "running ranks": outliers._running_ranks(wave[:12], 7, [2, 3, 4])[:, [0, 1, 6, 11]],  # pyright: ignore[reportPrivateUsage]
        "long": [len(outliers._running_ranks(np.arange(count) % 11.0, 7, [3])[0]) for count in (5,)],  # pyright: ignore[reportPrivateUsage]
        "sorted": [list(map(list, outliers.sorting_exchanges(count))) for count in (2, 3, 5, 7)],
        "comparisons": [len(outliers.sorting_exchanges(count)) for count in (1, 8, 11, 16)],
        "of logs": [told(outliers.without_gross_outliers(one, channels)[1]) for one in (LOG, slip, confirmed, clipped)],
    }


@NUMBERS.case()
def logs_that_are_cleaned() -> dict[str, Any]:
    changes: dict[str, dict[str, Any]] = {
        "sound": {},
        "an outlier, a hum, a clip": {
            POSITION: LOG[POSITION] + 1.0 * (ROWS == 77),
            PRESSURE: np.clip(LOG[PRESSURE], -3e5, 3e5),
        },
        "dead pressure": {PRESSURE: noise(4e3)},
        "a reversed pump beside a frozen velocity": {SPEED: -LOG[SPEED], VELOCITY: stands(LOG[VELOCITY], 200, 400)},
        "held": {POSITION: LOG[POSITION][ROWS // 4 * 4]},
        "no pressure": {PRESSURE: None},
    }
    return {
        name: {
            "left out": told(found.left_out),
            "objections": told(found.objections),
            "mistakes": told(found.mistakes),
            "to pressure": len(found.objections_to((PRESSURE,))),
            "variances": dict(found.variances),
            "missing": {one: int(np.isnan(found.record[one]).sum()) for one in found.record},
        }
        for name, change in changes.items()
        for found in [clean_log(LOG.replace(**change), HEALTHY)]
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
