"""The contents read from packed files, sheets and tables, kept in `numbers_files.json`."""

import zlib
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.log.columns import Column
from plant.log.formats import mdf, packed, tdms, xlsx
from plant.log.formats.arrow import from_arrow, to_arrow
from plant.log.formats.cells import number, numbers
from plant.log.formats.csv_layout import layout_of_lines
from plant.log.formats.detect import format_of
from plant.log.formats.packed import inflate, most_unpacked
from plant.log.table import Table, table_of
from plant.log.tables import gather_channels
from tests.edges import edge
from tests.numbers import Numbers
from tests.plant.log.made_files import in_a_file, or_refused

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def packed_files() -> dict[str, Any]:
    data = zlib.compress(b"a" * 1000)
    return {
        "most unpacked": [most_unpacked(size) for size in (0, 5_368_709, 5_368_710, 10_000_000)],
        "inflated": [or_refused(lambda most=most: len(inflate(data, most, "a"))) for most in (999, 1000, 5000)],
        "cut": or_refused(lambda: inflate(data[:-5], 5000, "a")),
        "packing": [
            in_a_file(content, packed.packing_of)
            for content in (b"\x1f\x8babc", b"\x28\xb5\x2f\xfd", b"\x28\xb5\x2f", b"abcd")
        ],
        "formats": [
            in_a_file(content, format_of, name)
            for content, name in (
                (b"PAR1xx", "a"),
                (b"ARROW1", "a"),
                (b"TDSm", "a"),
                (b"MDF     ", "a"),
                (b"\x89HDF\r\n\x1a\n", "a"),
                (b"PK\x03\x04", "a"),
                (b"\xd0\xcf\x11\xe0", "a"),
                (b"\x1f\x8b", "a"),
                (b"x" * 512 + b"\x89HDF", "a"),
                (b"x" * 511 + b"\x89HDF", "a"),
                (b"MATLAB" + b"x" * 118 + b"\x00\x01IM", "a"),
                (b"x" * 124 + b"\x00\x01IM", "a"),
                (b"x" * 124 + b"\x07\x01IM", "a"),
                (b"", "a"),
                (b"text", "a.mat"),
                (b"text", "a.h5"),
                (b"te\0xt", "a.h5"),
                (b"text", "a.xls"),
                (b"te\0xt", "a.mf4"),
            )
        ],
        "arrow": [
            from_arrow(
                __import__("pyarrow").chunked_array(
                    [to_arrow(np.where(np.arange(11) % 4 == 1, np.nan, np.arange(11.0)))[2:9], to_arrow(np.arange(3.0))]
                )
            )
        ],
        "cells": [or_refused(lambda one=one: number(one)) for one in (" 1.5 ", "NaN", "", "1_0", "a", "null")],
        "columns": [
            or_refused(lambda one=one: numbers(one, "x", "a"))
            for one in (
                np.array([1, 2]),
                np.array([True, False]),
                np.array([1.0, "2", None, ""], dtype=object),
                np.array([1 + 0j, 2]),
                np.array([1 + 0j, 2 + 1j]),
                np.zeros((2, 2)),
                np.array(["a"], dtype=object),
            )
        ],
    }


@NUMBERS.case()
def cells_of_sheets() -> dict[str, Any]:
    def table(*rows: tuple[Any, ...]) -> Any:
        def made() -> Any:
            found = xlsx._table(Path("a"), "s", rows)  # pyright: ignore[reportPrivateUsage]
            if found is None:
                return None
            raw = found.read([Column(place, one.name, "true_x") for place, one in enumerate(found.headings)])
            return [
                [one.name for one in found.headings],
                {str(column.position): values for column, values in raw.items() if values.dtype.kind == "f"},
            ]

        return or_refused(made)

    import datetime as dt

    return {
        "plain": table(("t", "x"), (0.0, 1.0), (1.0, None), (2.0, 3.0)),
        "ragged": table(("t", "x", None), (0.0,), (1.0, 2.0), (2.0, 3.0)),
        "blank rows": table(("t", "x"), (0, 1), (None, None), (2, 3)),
        "one column": table(("t",), (0,), (1,)),
        "nothing": [table(), table((None, None)), table((None, None), (None, None))],
        "text": table(("t", "x"), ("0,5", "1"), ("1,5", "2")),
        "spans": table(("t", "x"), (dt.timedelta(seconds=1.5), 2), (dt.timedelta(seconds=2), 3)),
        "said": [
            xlsx._cell_text(one)
            for one in (
                None,
                1.5,
                2,
                "a  b\n",
                dt.datetime(2026, 3, 1, 12, 0),
                dt.time(1, 2, 3),
                dt.timedelta(seconds=90),
                dt.date(2026, 3, 1),
                True,
            )
        ],  # pyright: ignore[reportPrivateUsage]
        "wide": [xlsx._fit_width((1, 2, 3), width) for width in (2, 3, 5)],  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case()
def tables_of_several_kinds() -> dict[str, Any]:
    t = 1e-3 * np.arange(20.0)
    wave = np.sin(50.0 * t)

    def told(*tables: Table, mapping: Any = None, required: Any = (), sample_time: float | None = None) -> Any:
        def made() -> Any:
            found = gather_channels(tables, mapping, required, "a", sample_time)
            return [
                found.began,
                {name: [len(values), values[[0, 1, -1]]] for name, values in found.columns.items()},
                [str(one.code) for one in found.notes],
            ]

        return or_refused(made)

    one = table_of("a", {"time_s": t, "motor_speed_rad_s": 30.0 * wave}, label="g")
    other = table_of("a", {"time_s": t + 2.5e-3, "position_mm": wave}, label="h")
    stepped = table_of("a", {"position_m": wave}, step=1e-3, began=np.datetime64("2026-03-01T00:00:00", "ns"))
    bare = table_of("a", {"position_m": wave}, label="b")
    dates: Any = np.datetime64("2026-03-01T00:00:00", "ns") + (1e9 * t).astype("timedelta64[ns]")
    dated = table_of("a", {"time": np.where(np.arange(20) < 2, np.datetime64("NaT"), dates), "position_m": wave})
    return {
        "one": told(one),
        "two": told(one, other),
        "stepped": told(stepped),
        "bare": told(bare),
        "bare, with a sample time": told(bare, sample_time=2e-3),
        "bare beside one of its length": told(one, bare),
        "dated": told(dated),
        "lacking": told(one, required=("position_m or velocity_m_s",)),
        "both": told(one, table_of("a", {"time_s": t, "motor_speed_rpm": wave}, label="k")),
        "by group": told(one, table_of("a", {"time_s": t, "x": wave}, label="k"), mapping={"position_m": "k/x:mm"}),
        "by group, missing": told(one, mapping={"position_m": "k/x:mm"}),
        "no date at all": told(
            table_of("a", {"time": np.full(20, np.datetime64("NaT"), dtype="datetime64[ns]"), "position_m": wave})
        ),
        "dates in a channel": told(table_of("a", {"time_s": t, "position_m": dates})),
        "steps of TDMS": [tdms._number(value) for value in (None, "x", 0.0, -1.0, 1e-3, 0.99e6, 1e6, "2.5")],  # pyright: ignore[reportPrivateUsage]
        "begins of TDMS": [
            None if (found := tdms._stamp(value)) is None else str(found)
            for value in (
                None,
                "x",
                np.datetime64("1904-01-01"),
                np.datetime64("1971-01-01"),
                np.datetime64("1971-01-02"),
                np.datetime64("2026-03-01T01:00"),
            )
        ],  # pyright: ignore[reportPrivateUsage]
        "names of MDF": [mdf._name_without_device(name) for name in ("speed\\XCP: 1", "speed")],  # pyright: ignore[reportPrivateUsage]
        "layout of one": layout_of_lines(["t,x", "0,1", "1,2"], "utf-8", "a").skipped,
    }


@NUMBERS.case()
def where_limits_of_files_lie() -> dict[str, Any]:
    return {
        "a struct's letters": edge(
            lambda one: isinstance(
                or_refused(
                    lambda: __import__("plant.log.formats.mat", fromlist=["write_mat"]).write_mat(
                        {"a" * round(one): np.zeros(2)}, "{}", BytesIO(), "a"
                    )
                ),
                str,
            ),
            50.0,
            80.0,
            6,
        )
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
