"""The values read from text logs and stamps, kept in `numbers_text.json`."""

from typing import Any

import numpy as np
import pytest

from plant.log.clock.stamps import is_stamp, read_stamps
from plant.log.formats import csv_layout, layouts_seen
from plant.log.formats.csv_layout import layout_of_lines
from plant.log.stream.csv_rows import CsvStream
from plant.log.stream.source import BatchCounts, broker_of, stream_lines
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def moments() -> dict[str, Any]:
    cells = (
        "2026-03-01 12:34:56.123456789",
        "2026-03-01T12:34:56Z",
        "2026-03-01T12:34:56.5+02:30",
        "2026-03-01 12:34:56-0700",
        "2026-03-01T12:34+01",
        "1.3.26 7:08",
        "01.03.1999 07:08:09,5",
        "3/1/2026 12:30:01 AM",
        "3/1/2026 12:30:01 PM",
        "3/1/99 1:02 p.m.",
        "13/2/2026 1:02:03",
        "2026/3/1",
        "12:34",
        "1:02:03.25",
        "24:00:00",
        "25:00:00",
        "23:59:60",
        "12:60:00",
        "12:00:61",
        "61:02.5",
        "01:02.5",
        "2242-01-01 00:00:00",
        "2245-01-01 00:00:00",
        "1700-01-01 00:00:00",
        "1690-01-01 00:00:00",
        "2026-02-30 00:00:00",
        "12:00 PM",
        "7:05 am",
        "01:02:03:500",
        "x",
        "2026-03-01 12:00:00 CET",
        "2026-03-01T12:00:00+01:00[Europe/Berlin]",
        "1899-12-31T00:00:00.1",
        "1.1.99 0:00",
        "1.1.00 0:00",
    )

    def read(*some: str) -> Any:
        return or_refused(
            lambda: read_stamps(some, lambda row, text: ValueError(f"{row} {text}")).astype("i8").tolist()
        )

    return {
        **{cell: [is_stamp(cell), read(cell)] for cell in cells},
        "longest": [is_stamp(" " * 20 + "12:00:00" + f".{'1' * n}") for n in (9, 12, 13)],
        "long zones": [is_stamp(f"2026-03-01T12:00:00+01:00[{'a' * n}]") for n in (20, 21, 22, 23)],
        "alike": read("2026-03-01 00:00:00.5", "2026-03-01 00:00:01.5", "2026-03-01 00:00:02.5"),
        "alike, in zones": read("2026-03-01T00:00:00+01:30", "2026-03-01T00:00:01+01:30"),
        "not alike": read("2026-03-01T00:00:00+01:00", "2026-03-01T00:00:01+02:00"),
        "alike, one no date": read("2026-03-01 00:00:00", "2026-02-31 00:00:00"),
        "over midnight": read("23:00:00", "", "11:30:00", "11:00:00", "23:00:00", "00:00:00"),
        "over midnight, dated": read("2026-03-01 23:00", "2026-03-01 01:00"),
        "two days": read("23:59:59", "00:00:01", "23:59:59", "00:00:00"),
        "minutes": read("59:59.5", "61:00.25"),
        "months or days first": read("3/4/2026 0:00", "13/4/2026 0:00", "12/4/2026 0:00"),
    }


@NUMBERS.case()
def layouts() -> dict[str, Any]:
    def told(*lines: str) -> Any:
        def made() -> Any:
            one = layout_of_lines(lines, "utf-8", "a.csv")
            names = [[each.name, each.unit, each.stamped] for each in one.headings]
            return [names, one.skipped, one.delimiter, one.decimal_point, sorted(one.stamped)]

        return or_refused(made)

    rows = [f"{k},{k + 1}.5" for k in range(4)]
    return {
        "plain": told("t,x", *rows),
        "semicolons and commas": told("t;x", "0,5;1,5", "1,5;2"),
        "blanks": told("t  x [mm]", "0.5 1", "1 2"),
        "blanks, a name of two words": told("time now  way", "0.5 1", "1 2"),
        "bars": told("t|x", "0|1", "1|2"),
        "one column": told("x", "1", "2"),
        "one of two is text": told("x,y", "1,a", "2,b"),
        "one of three is text": told("x,y,z", "1,a,2", "2,b,3"),
        "units below": told("t,x", "[ms],[mm]", *rows),
        "no units below": told("t,x", "ms,no unit here", *rows),
        "units and blanks": told("t,x", "s,-", *rows),
        "comment": told("# bench", "# t,x", *rows),
        "quotes": told('"t, s","x"', '"0","1"', '"1","2"'),
        "closed": told("t;x;", "0;1;", "1;2;"),
        "header short by one": told("t;x", "0;1;", "1;2;"),
        "broken first row": told("t,x", "oops,1", "1,2", "2,3"),
        "stamps": told("when,x", "2026-03-01 12:00:00,1", "2026-03-01 12:00:01,2", "x,3"),
        "half stamps": told("when,x", "12:00:00,1", "3,2", "4,2"),
        "missing": told("t,x", "0,NaN", "1,", "2,inf", "3,5"),
        "strange letters": [
            isinstance(told("\x01" * n + "a" * (100 - n), "0,1", "1,2"), str) for n in (9, 10, 11, 12, 13)
        ],
        "zero byte": told("t,x\0", "0,1"),
        "long cells": [told("t,x", f"{'1' * n},2", f"{'2' * n},3")[0] for n in (60, 61)],
        "widths": told("t,x", "0,1,2", "0,1", "1,2", "2,3"),
        "two widths alike": told("a,b", "0,1", "1,2", "0,1,2", "1,2,3"),
        "header alone": told("# t;x;v"),
        "decimal commas in commas": told("t,x,y", "0,5,1", "1,5,2"),
        "numbers": [
            csv_layout.is_value(cell)
            for cell in ("1", "-1.5e-3", "1,5", ".5", "1d4", "1e", "--1", "NaN", "INF", "", "12:00", "a")
        ],  # pyright: ignore[reportPrivateUsage]
        "encodings": [
            or_refused(lambda one=one: csv_layout._encoding(one, "a"))
            for one in (  # pyright: ignore[reportPrivateUsage]
                b"t,x\n",
                "t,ä".encode("cp1252"),
                "t,ä\n0,1\n".encode("cp1252"),
                "t,x".encode("utf-16"),
                ("t,x\n" * 9).encode("utf-16-le"),
                ("t,x\n" * 9).encode("utf-16-be"),
                b"\0\0ab",
                b"a\0" * 40 + b"bc" * 4,
                b"a\0" * 40 + b"bc" * 5,
                "aä".encode()[:-1],
                b"abc\xe4",
                b"\xe4abc",
                b"\xe4ab",
            )
        ],
    }


@NUMBERS.case()
def layouts_that_were_seen() -> dict[str, Any]:
    def kept(count: int, header: str = "t,x,v", lines: int = 300, row: str = "{k},1.5,2") -> bool:
        layouts_seen._seen.clear()  # pyright: ignore[reportPrivateUsage]
        start = (header + "\n" + "".join(row.format(k=k) + "\n" for k in range(count))).encode()
        layouts_seen.remember_layout(start, lines, layout_of_lines(start.decode().split("\n")[:lines], "utf-8", "a"))
        found = layouts_seen.remembered_layout(start, lines) is not None
        layouts_seen._seen.clear()  # pyright: ignore[reportPrivateUsage]
        return found

    def many(count: int) -> int:
        layouts_seen._seen.clear()  # pyright: ignore[reportPrivateUsage]
        for n in range(count):
            start = (f"t,x,v{n}\n" + "".join(f"{k},1.5,2\n" for k in range(120))).encode()
            layouts_seen.remember_layout(start, 300, layout_of_lines(start.decode().split("\n"), "utf-8", "a"))
        size = len(layouts_seen._seen)  # pyright: ignore[reportPrivateUsage]
        layouts_seen._seen.clear()  # pyright: ignore[reportPrivateUsage]
        return size

    return {
        "rows": [kept(count) for count in (98, 99, 100, 101, 299, 300, 400)],
        "columns": [kept(150, header, 300, row) for header, row in (("t,x", "{k},1.5"), ("t,x,v", "{k},1.5,2"))],
        "lines above": [kept(150, "# a\n" * n + "t,x,v") for n in (18, 19, 20, 21)],
        "lines looked at": [kept(150, lines=lines) for lines in (50, 100, 101, 102, 151, 152)],
        "digits": [kept(150, row=f"{{k}},{'1' * n},2") for n in (16, 17, 18)],
        "plain": [kept(150, row=row) for row in ("{k},1.5,", "{k},a,2", "{k},1e400,2", "{k},+1.5E-3,2")],
        "kept": [many(count) for count in (7, 8, 9, 10)],
    }


@NUMBERS.case()
def rows_that_still_come() -> dict[str, Any]:
    def told(lines: list[str], most: int = 4, mapping: Any = None) -> Any:
        def made() -> Any:
            stream = CsvStream(lines, mapping, source="a")
            parts = [
                [time, samples.shape[0], samples[-1], gap, int(np.isnan(samples).any(axis=1).sum())]
                for time, samples, gap in stream.samples(most)
            ]
            return {
                "channels": list(stream.channels),
                "sample time": stream.sample_time,
                "start": stream.start_time,
                "parts": parts,
                "cut": stream.cut,
                "left out": stream.left_out,
            }

        return or_refused(made)

    header = "time_ms;motor_speed_rpm;position_mm\n"
    rows = [f"{100 * k};{k},5;{k}\n" for k in range(9)]
    return {
        "plain": told([header, *rows]),
        "with a gap": told([header, *rows[:3], *rows[5:]]),
        "with gaps about the longest": [
            told([header, *rows[:3], f"{200 + gap};1;1\n", f"{300 + gap};1;1\n"], 99)
            for gap in (1000, 1100, 1140, 1200)
        ],
        "back": told([header, *rows[:3], rows[1]]),
        "a step of next to nothing": [
            told([header, *rows[:3], f"{200.0 + one!r};1;1\n"])["left out"] for one in (5e-5, 2e-4)
        ],
        "cut": told([header, *rows[:4], "400;1"]),
        "quoted": told([header, *rows[:3], '"300";"4,5";1\n']),
        "one row": told([header, rows[0]]),
        "two rows": told([header, *rows[:2]]),
        "nothing": told([]),
        "no time": told(["a,b\n", "1,2\n"]),
        "standing": told([header, *[rows[0]] * 3]),
        "a wide row": told([header, *rows[:3], "300;1;1;1\n"]),
        "no number": told([header, *rows[:3], "300;a;1\n"]),
        "infinite": told([header, *rows[:3], "300;inf;1\n"]),
        "no time in a row": told([header, *rows[:3], ";1;1\n"]),
        "missing": told([header, *rows[:3], "300;;1\n"]),
        "blank lines": told(["\n", header, "\n", *rows[:3]]),
        "commas": told(["time_s,position_m,true_x\n", "0,1,5\n", "0.5,2,6\n"]),
        "median of fifty": told([header, *[f"{10 * k};1;1\n" for k in range(60)]], 99)["sample time"],
    }


@NUMBERS.case()
def addresses_of_streams() -> dict[str, Any]:
    addresses = (
        "mqtt://bench/press/events",
        "mqtt://bench:99/a",
        "mqtt://bench/a/+/b",
        "mqtt://bench/a#b",
        "mqtt://bench/",
        "tcp://bench/a",
        "mqtt:///a",
    )
    received = BatchCounts()
    took = [received.takes(number) for number in (3, 4, 4, 2, 9, 10)]
    return {
        "brokers": [or_refused(lambda one=one: list(broker_of(one))) for one in addresses],
        "refused": [
            or_refused(lambda one=one: str(type(stream_lines(one, BatchCounts()))))
            for one in ("tcp://here", "tcp://:9", "ring:", "ring:/x", "foo://a", "mqtt://a", "tcp://a:99999999")
        ],
        "taken": took,
        "received": [received.batches, received.late, received.lost, received.dropped],
        "unless told": [BatchCounts().batches, BatchCounts().late, BatchCounts().lost, BatchCounts().dropped],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
