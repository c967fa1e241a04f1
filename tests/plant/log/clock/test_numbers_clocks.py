"""How rows of a log are treated on either side of each limit of the clock, kept in `numbers_clocks.json`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from plant.arrays import Array
from plant.log.checks import Clock
from plant.log.clock.merging import LoggerChannels, merge_loggers
from plant.log.clock.uniform import CheckedLog, on_uniform_clock
from plant.notes import Note
from tests.numbers import Numbers, or_refused, told
from tests.plant.log.clock.made_stamps import TICKS, T, jittering

NUMBERS = Numbers(__file__)


def uniform(time: Array, clock: Clock | None = None, **more: Array) -> Any:
    notes: list[Note] = []
    channels = {"position_m": np.sin(np.arange(len(time))), **more}

    def made() -> Mapping[str, Any]:
        found = on_uniform_clock({"time_s": time, **channels}, "a.csv", clock, notes)
        return {**of(found), "notes": told(notes)}

    return or_refused(made)


def of(found: CheckedLog) -> dict[str, Any]:
    return {
        "sample time [s]": found.sample_time,
        "begin [s]": found.start_time,
        "rows": len(next(iter(found.channels.values()))),
        "missing": {name: np.flatnonzero(np.isnan(one)) for name, one in found.channels.items()},
        "some": {name: one[3:6] for name, one in found.channels.items()},
    }


@NUMBERS.case()
def logs_on_a_uniform_clock() -> dict[str, Any]:
    even = 0.25 + T * TICKS
    gone = {f"{count} of {60 + count - 2} left out": list(range(9, 9 + count)) for count in (1, 2, 3)}
    whole = 7.0 + T * np.arange(80.0)
    twice = np.repeat(even, np.where(TICKS % 30 == 7, 2, 1))
    many = np.repeat(even, np.where(TICKS % 14 == 7, 2, 1))
    copies = np.sin(np.repeat(TICKS, np.where(TICKS % 14 == 7, 2, 1)))
    return {
        "even": uniform(even),
        **{name: uniform(np.delete(even, rows)) for name, rows in gone.items()},
        **{f"{count} of 80 left out": uniform(np.delete(whole, range(9, 9 + count))) for count in (4, 5)},
        **{f"off by {off:g} of a step": uniform(even + off * T * (TICKS == 5.0)) for off in (5e-7, 2e-6, 8e-3, 0.015)},
        **{f"jitter of {share:g}": uniform(jittering(share)) for share in (0.1, 0.4, 0.45, 0.55, 0.7)},
        "a rounded clock": uniform(1e-3 * np.rint(0.4 * TICKS)),
        "a rounded clock, rows left out": uniform(np.delete(1e-3 * np.rint(2.6 * TICKS), [20, 21])),
        "stamps twice": uniform(twice),
        "stamps twice, many": uniform(many),
        "rows twice, many": uniform(many, position_m=copies),
        "stamps twice, of nine": uniform(np.repeat(even[:9], 2)),
        "all one": uniform(np.ones(20)),
        "one back": uniform(even - 3.0 * T * (TICKS == 30.0)),
        "beyond numbers": uniform(np.concatenate((even, [1.7e308, -1.7e308]))),
        "a jump of a year": uniform(even + np.where(TICKS > 40.0, 3e7, 0.0)),
        "off by 0.012 of two steps": uniform(np.delete(even, 9) + 0.024 * T * (TICKS[:59] == 9.0)),
        **{
            f"a jitter of 0.2 with {count} gone": uniform(np.delete(jittering(0.2), range(20, 20 + count)))
            for count in (2, 3, 4)
        },
        **{
            f"a rounded clock with {count} gone": uniform(np.delete(1e-3 * np.rint(2.6 * TICKS), range(20, 20 + count)))
            for count in (3, 4)
        },
        "too short": uniform(even[:9]),
        "of two stamps": uniform(np.array([0.0, 1.0])),
        "all rows late by a quantum of floats": uniform(2.0**33 + T * np.arange(60.0)),
        "far beyond floats": uniform(2.0**43 + T * np.arange(60.0)),
        "jitter and a jump": uniform(jittering(0.2) + np.where(TICKS > 40.0, 0.4, 0.0)),
        "late": uniform(1.7e9 + 1e-3 * TICKS),
    }


@NUMBERS.case()
def logs_with_a_clock_of_their_own() -> dict[str, Any]:
    even = 100.0 + T * TICKS
    clock = Clock(T, 100.0)
    return {
        **{
            f"off by {off:g} of a step": len(uniform(even + off * T * (TICKS == 9.0), clock)["notes"])
            for off in (5e-7, 0.8e-6, 1.4e-6, 3e-6)
        },
        **{
            f"longer by {by:g}": uniform(even, Clock(T * (1.0 + by), 100.0))["sample time [s]"] / T - 1.0
            for by in (1e-8, 1e-4)
        },
        **{
            f"longer by {by:g} of a long log": uniform(1e7 + T * TICKS, Clock(T * (1.0 + by), 1e7))["sample time [s]"]
            / T
            - 1.0
            for by in (2e-8, 6e-8, 1e-7, 1e-6)
        },
        "early": uniform(even, Clock(T, 99.0))["begin [s]"],
    }


@NUMBERS.case()
def channels_with_times_of_their_own() -> dict[str, Any]:
    time = 0.5 + 0.25 * T * np.arange(240.0)
    rows = np.arange(240)

    def log(fast: int, slow: int, shift: int, fewer: int = 240) -> Any:
        speed = np.where((rows % fast == 0) & (rows < fewer), np.sin(0.1 * rows), np.nan)
        return uniform(time, position_m=speed, velocity_m_s=np.where(rows % slow == shift, 0.01 * rows, np.nan))

    return {
        "half as fast, between": log(4, 8, 1),
        "as fast, between": log(4, 4, 2),
        "half of it at the same": log(4, 2, 0),
        "in the same rows": log(4, 8, 0),
        "one that is nowhere": uniform(
            time,
            position_m=np.where(rows % 4, np.nan, 1.0 * rows),
            velocity_m_s=np.where(rows % 8 == 1, 1.0, np.nan),
            force_n=np.full(240, np.nan),
        ),
        "a third of it apart": uniform(
            time,
            position_m=np.where(rows % 4, np.nan, 1.0 * rows),
            velocity_m_s=np.where((rows % 12 == 1) | (rows % 12 == 4) | (rows % 12 == 8), 1.0, np.nan),
        ),
        "two thirds of it apart": uniform(
            time,
            position_m=np.where(rows % 4, np.nan, 1.0 * rows),
            velocity_m_s=np.where((rows % 12 == 1) | (rows % 12 == 5) | (rows % 12 == 8), 1.0, np.nan),
        ),
        "nine of the fastest": log(4, 64, 1, 36),
        "ten of the fastest": log(4, 64, 1, 40),
        "back": uniform(
            time - 0.1 * (rows == 77),
            position_m=np.where(rows % 4, np.nan, 1.0 * rows),
            velocity_m_s=np.where(rows % 8 == 1, 1.0, np.nan),
        ),
    }


@NUMBERS.case()
def loggers_on_one_clock() -> dict[str, Any]:
    def laid(*parts: LoggerChannels) -> Any:
        def made() -> Mapping[str, Any]:
            found = merge_loggers(parts, "both")
            time = found.channels["time_s"]
            kind = {"seconds": time[[0, 1, -1]]} if time.dtype.kind == "f" else {"dates": time[[0, -1]].astype(str)}
            channels = {name: values for name, values in found.channels.items() if name != "time_s"}
            return {
                **kind,
                "rows": len(time),
                "there": {name: np.flatnonzero(np.isfinite(one)) for name, one in channels.items()},
                "sum": {name: float(np.nansum(one)) for name, one in channels.items()},
                "notes": told(found.notes),
            }

        return or_refused(made)

    def logger(
        name: str, begin: float, step: float, count: int = 30, *, dated: bool = False, source: str = "x"
    ) -> LoggerChannels:
        seconds = begin + step * np.arange(count)
        stamps: Any = np.datetime64("2026-03-01T00:00:00", "ns") + np.rint(1e9 * seconds).astype("timedelta64[ns]")
        return LoggerChannels(source, stamps if dated else seconds, {name: np.cos(70.0 * seconds)}, name)

    fast = logger("a", 0.1, T)
    missing: Any = np.where(np.arange(40) < 30, logger("b", 0.0, T, 40, dated=True).time, np.datetime64("NaT"))
    return {
        "alone": laid(fast),
        "none": or_refused(lambda: dict(merge_loggers([], "both").channels)),
        "of one clock": laid(fast, logger("b", 0.1 + 0.9e-3 * T, T)),
        "of nearly one": laid(fast, logger("b", 0.1 + 1.1e-3 * T, T)),
        "half a step late": laid(fast, logger("b", 0.1 + 3.5 * T, T)),
        "slower": laid(fast, logger("b", 0.1 - 3.3 * T, 3.0 * T)),
        "slower with a gap": laid(
            fast,
            LoggerChannels("y", np.delete(0.1 + 2.0 * T * np.arange(31.0), 7), {"b": np.delete(np.arange(31.0), 7)}),
        ),
        "dated": laid(logger("a", 0.0, T, dated=True), logger("b", 0.3 * T, 2.0 * T, dated=True)),
        "dated, some not": laid(logger("a", 0.0, T, dated=True), LoggerChannels("y", missing, {"b": np.arange(40.0)})),
        "dated beside seconds": laid(fast, logger("b", 0.1, T, dated=True)),
        "ten together": laid(fast, logger("b", 0.1 + 20.0 * T, T, 31)),
        "nine together": laid(fast, logger("b", 0.1 + 21.0 * T, T, 31)),
        "nine samples": laid(fast, logger("b", 0.1, T, 9)),
        "names": [
            LoggerChannels(source, np.zeros(2), {}, label).name
            for source, label in (("a\\b/c.csv", ""), ("c", "group"))
        ],
        "of two rows": laid(logger("a", 0.0, T, 2), logger("b", 0.5e-3 * T, T, 2)),
        "apart by a share of a step": [
            list(merge_loggers([logger("a", 0.0, T, 11), logger("b", by * T, T, 11)], "both").channels)
            for by in (0.98e-3,)
        ],
        "of one row": laid(logger("a", 0.0, T, 1), logger("b", 0.0, T, 1)),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
