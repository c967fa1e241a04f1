"""The contents of records and tables, and whether a log is trusted, kept in `numbers_records.json`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from plant.log.checks import checked_log
from plant.log.inspection import clock_facts, inspect_table
from plant.log.record import Record
from plant.log.table import table_of
from tests.numbers import Numbers, or_refused, told
from tests.plant.log.clock.made_stamps import NOISE, TICKS, T, jittering

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def logs_that_are_trusted() -> dict[str, Any]:
    def log(gone: Mapping[str, Any], **more: Any) -> Any:
        columns = {"time_s": 0.02 * TICKS, "motor_speed_rad_s": 50.0 * NOISE, "position_m": 0.01 * np.sin(0.2 * TICKS)}
        for name, rows in gone.items():
            columns[name] = columns.get(name, np.cos(TICKS)).astype(float).copy()
            columns[name][rows] = np.nan
        columns |= more

        def made() -> Any:
            found = checked_log(columns, source="a.csv")
            return {"channels": list(found.channels), "sample time [s]": found.sample_time, "notes": told(found.notes)}

        return or_refused(made)

    pressure = {"pressure_a_pa": 1e6 + 1e5 * NOISE, "pressure_b_pa": 9e5 - 1e5 * NOISE}
    every = {f"every {step} rows": [k for k in range(60) if k % step] for step in (2, 3, 6)}
    return {
        "whole": log({}),
        **{f"{count} missing": log({"position_m": range(count)}) for count in (3, 4)},
        **{f"{count} missing of a voltage": log({"motor_voltage_v": range(count)}) for count in (3, 4, 60)},
        **{f"a voltage {name}": log({"motor_voltage_v": rows}) for name, rows in every.items()},
        "a voltage every 2 rows, two of 30 gone": log(
            {"motor_voltage_v": [k for k in range(60) if k % 2 or k in (8, 20)]}
        ),
        "a voltage every 7 rows": log({"motor_voltage_v": [k for k in range(60) if k % 7]}),
        **{f"{count} times missing": log({"time_s": range(20, 20 + count)}) for count in (1, 3, 4)},
        "of ten": {
            str(count): or_refused(
                lambda count=count: len(
                    checked_log(
                        {
                            "time_s": T * np.arange(count),
                            "motor_speed_rad_s": np.arange(count) + 1.0,
                            "position_m": np.ones(count),
                        },
                        source="a.csv",
                    ).channels
                )
            )
            for count in (9, 10)
        },
        "chambers": log({}, **pressure),
        "pressure and chambers": log({}, differential_pressure_pa=2e5 * NOISE, **pressure),
        "infinite": log({}, position_m=np.where(TICKS == 7.0, np.inf, 0.0)),
        "time alone": or_refused(lambda: checked_log({"time_s": TICKS}, source="a", required=())),
        "nothing": or_refused(lambda: checked_log({}, source="a")),
        **{
            f"nine times of {count}": or_refused(
                lambda count=count: (
                    checked_log(
                        {
                            "time_s": np.where(np.arange(count) < count - 1, T * np.arange(count), np.nan),
                            "position_m": np.ones(count),
                        },
                        source="a",
                        required=(),
                    ).sample_time
                )
            )
            for count in (10, 20, 30)
        },
        "truth that is missing": log({}, true_x=np.full(60, np.nan)),
        **{
            f"a sample time of {size:g} s": log({}, time_s=size * TICKS)
            for size in (0.9e-8, 1.1e-8, 4e-6, 6e-6, 0.45, 0.6, 0.99e4, 1.01e4)
        },
    }


@NUMBERS.case()
def stamps_as_they_are() -> dict[str, Any]:
    def facts(stamps: Any) -> Any:
        found = clock_facts(stamps)
        return None if found is None else vars(found)

    dates: Any = np.datetime64("2026-03-01T00:00:00", "ns") + (1e7 * TICKS[:8]).astype("timedelta64[ns]")
    return {
        "even": facts(T * TICKS),
        "steps below 1": facts(np.array([0.0, 0.3, 0.6, 0.6, 0.9, 0.8, 1.1])),
        "jittering": facts(jittering(0.2)),
        "a gap, a repeat, one back": facts(np.array([0.0, 1.0, 2.1, 3.0, 4.6, 4.6, 6.0, 5.5, 6.5, 9.5, 10.5])),
        "steps of 1.4 to 1.6": facts(np.cumsum([1.0, 1.0, 1.49, 1.0, 1.51, 1.0, 1.0, 1.0, 1.0, 1.0])),
        "of two": facts(np.array([0.0, 1.0, np.nan])),
        "of three": facts(np.array([0.0, 1.0, 3.0])),
        "dates": facts(np.where(np.arange(8) == 3, np.datetime64("NaT"), dates)),
        "no date": facts(np.full(4, np.datetime64("NaT"), dtype="datetime64[ns]")),
        "back alone": facts(-TICKS),
        "beyond numbers": facts(np.array([-1.7e308, 0.0, 1.7e308, 1.7e308])),
    }


@NUMBERS.case()
def what_a_table_holds() -> dict[str, Any]:
    dates: Any = np.array(["2026-03-01T00:00:00", "NaT", "2026-03-01T00:00:02"], dtype="datetime64[ns]")
    named = {"x": np.array([1.0, np.nan, -3.0]), "t": dates, "note": np.array(["a", "b", "c"], dtype=object)}
    found = inspect_table(table_of("a", named, units={"x": "mm"}))
    return {
        "rows": found.rows,
        "columns": [
            {"missing": one.missing, "span": one.span, "present": one.present, "stamped": one.heading.stamped}
            for one in found.columns
        ],
        "places of numbers": list(found.numbers),
    }


@NUMBERS.case()
def a_record_and_its_parts() -> dict[str, Any]:
    record = Record(T, {"position_m": np.arange(12.0), "velocity_m_s": -np.arange(12.0)}, {"a": 1}, start_time=0.5)

    def whole(one: Record) -> dict[str, Any]:
        return {
            "sample time [s]": one.sample_time,
            "duration [s]": one.duration,
            "time [s]": one.time,
            "channels": {name: one[name] for name in one},
            "metadata": dict(one.metadata),
        }

    slices = ((0, None, 1), (3, None, 1), (2, 11, 4), (0, None, 0), (-1, None, 1), (1, 3, 2))
    return {
        **{f"slice {part}": or_refused(lambda part=part: whole(record.slice(*part))) for part in slices},
        "replaced": whole(record.replace(position_m=None, force_n=np.ones(12))),
        "annotated": dict(record.annotate(b=2).metadata),
        "frame": {name: values.to_numpy() for name, values in record.to_frame().items()},
        "in it": ["position_m" in record, "force_n" in record],
        "begins at [s], unless told": Record(T, {"a": np.zeros(2)}).start_time,
        "slice, unless told": whole(record.slice()),
        "no such": or_refused(lambda: record["force_n"]),
        **{
            f"sample time {size}": or_refused(lambda size=size: Record(size, {"a": np.zeros(2)}).duration)
            for size in (0.0, -1.0, np.inf, np.nan, 1e-9)
        },
        "two lengths": or_refused(lambda: len(Record(T, {"a": np.zeros(2), "b": np.zeros(3)}))),
        "a matrix": or_refused(lambda: len(Record(T, {"a": np.zeros((2, 2))}))),
        "none": or_refused(lambda: len(Record(T, {}))),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
