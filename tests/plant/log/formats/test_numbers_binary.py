"""The contents read from MAT files, HDF5 files and rings, byte by byte, kept in `numbers_binary.json`."""

import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from plant.log.formats import hdf5
from plant.log.formats.mat import MOST_COLUMNS, columns_of_array, tables_of
from plant.log.formats.mat_reader import read_variables
from plant.log.stream import ring
from plant.log.stream.ring import RingReader, RingWriter, ring_lines
from tests.numbers import Numbers
from tests.plant.log.made_files import in_a_file, or_refused

NUMBERS = Numbers(__file__)


def plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    return (
        value
        if value is None or isinstance(value, str)
        else [plain(one) for one in value]
        if isinstance(value, list)
        else np.asarray(value)
    )


@NUMBERS.case()
def variables_of_mat_files() -> dict[str, Any]:
    content: dict[str, Any] = {
        "wave": np.arange(4.0),
        "grid": np.arange(6.0).reshape(2, 3),
        "one": 2.5,
        "empty": np.zeros((0, 0)),
        "text": "ab µ",
        "phasor": np.array([1 + 2j, 3]),
        "s": {"a": np.arange(3.0), "b": {"c": 1.0}},
        "many": np.array([(1.0,), (2.0,)], dtype=[("x", float)]),
        "small": np.arange(3, dtype="i1"),
        "wide": np.arange(3, dtype="u8"),
        "cells": np.array(["a", 1], dtype=object),
        "last": np.arange(2.0, dtype="f4"),
    }

    def written(*, compress: bool) -> bytes:
        file = BytesIO()
        scipy.io.savemat(file, content, do_compression=compress)
        return file.getvalue()

    whole = written(compress=False)

    def element(kind: int, data: bytes, order: str = "<") -> bytes:
        return struct.pack(f"{order}II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def matrix(order: str, name: bytes, kind: int, body: bytes, shape: tuple[int, ...], *, flags: int = 0) -> bytes:
        head = element(6, struct.pack(f"{order}II", kind | flags, 0), order) + element(
            5, struct.pack(f"{order}{len(shape)}i", *shape), order
        )
        return element(14, head + element(1, name, order) + body, order)

    big = b"x" * 124 + b"\x01\x00MI" + matrix(">", b"v", 6, element(9, struct.pack(">3d", 1.0, 2.0, 3.0), ">"), (3, 1))
    little = b"x" * 124 + b"\x00\x01IM"
    small = little + matrix("<", b"v", 6, struct.pack("<HH4s", 2, 4, bytes([1, 2, 3, 4])), (4, 1))
    return {
        "variables": plain(read_variables(whole)),
        "compressed are the same": str(plain(read_variables(written(compress=True))))
        == str(plain(read_variables(whole))),
        "big-endian": plain(read_variables(big)),
        "in the tag": plain(read_variables(small)),
        "text in utf-16": [
            plain(read_variables(little + matrix("<", b"t", 4, element(kind, text), (1, 2))))
            for kind, text in (
                (4, "hé".encode("utf-16-le")),
                (16, "hé".encode()),
                (18, "hé".encode("utf-32-le")),
                (3, b"ab"),
            )
        ],
        "refused": [
            or_refused(lambda one=one: plain(read_variables(one)))
            for one in (
                b"x" * 124 + b"\x00\x02IM",
                b"x" * 126 + b"XX",
                little + matrix("<", b"v", 6, element(9, b"\0" * 16), (3, 1)),
                little + matrix("<", b"v", 6, element(9, b"\0" * 24), (-3, -1)),
                little + matrix("<", b"v", 6, element(8, b"\0" * 24), (3, 1)),
                little + element(14, element(6, b"")),
                little + element(15, b"abc"),
                little + element(14, b"\0" * 8)[:12],
                little + matrix("<", b"s", 2, element(5, struct.pack("<i", 0)) + element(1, b""), (1, 1)),
                little + matrix("<", b"s", 2, element(5, b"") + element(1, b""), (1, 1)),
            )
        ],
        "classes that are read": [
            list(read_variables(little + matrix("<", b"v", kind, element(9, b"\0" * 8), (1, 1))))
            for kind in (1, 5, 6, 15, 16)
        ],
        "complex flag": plain(
            read_variables(
                little
                + matrix(
                    "<",
                    b"v",
                    6,
                    element(9, struct.pack("<d", 1.0)) + element(9, struct.pack("<d", 4.0)),
                    (1, 1),
                    flags=0x0800,
                )
            )
        ),
        "struct of two fields": plain(
            read_variables(
                little
                + matrix(
                    "<",
                    b"s",
                    2,
                    element(5, struct.pack("<i", 4))
                    + element(1, b"ab\0\0cd\0\0")
                    + matrix("<", b"", 6, element(9, struct.pack("<d", 7.0)), (1, 1))
                    + element(14, b""),
                    (1, 1),
                )
            )
        ),
        "spread": [
            {name: np.asarray(one).shape for name, one in columns_of_array("a", np.zeros(shape)).items()}
            for shape in ((1,), (2,), (3, 2), (2, 3), (2, 2), (99, MOST_COLUMNS), (99, MOST_COLUMNS + 1), (1, 1))
        ],
        "tables": [
            or_refused(
                lambda one=one: [
                    [table.label, [heading.name for heading in table.headings], table.metadata]
                    for table in tables_of(one, "a")
                ]
            )
            for one in (
                {"record": {"x": np.arange(3.0), "metadata_json": "{}"}, "y": np.arange(3.0)},
                {"x": np.arange(3.0), "s": {"a": np.arange(2.0), "in": {"b": np.arange(2.0)}}},
                {
                    "s": {
                        "time": np.arange(3.0),
                        "signals": [
                            {"values": np.arange(3.0), "label": "v"},
                            {"values": np.zeros((3, 2)), "label": ""},
                        ],
                    }
                },
                {"x": "text"},
                {},
            )
        ],
    }


@NUMBERS.case()
def rings() -> dict[str, Any]:
    def written(path: Path) -> Any:
        rows = np.arange(36.0).reshape(12, 3)
        with RingWriter(path, "t,x,v", 8) as writer:
            room = [writer.room()]
            writer.write(rows[:5])
            room.append(writer.room())
            reader = RingReader(path)
            taken = [reader.take()[:, 0].tolist()]
            room.append(writer.room())
            writer.write(rows[5:])
            first = [reader.ended, reader.lost]
            taken += [reader.take()[:, 0].tolist(), reader.take()[:, 0].tolist()]
            writer.write(rows)
            taken.append(reader.take()[:, 0].tolist())
            writer.write(rows[:1] * np.nan)
        content = path.read_bytes()
        lost: list[list[int]] = []
        lines = list(ring_lines(path, lambda count, gone: lost.append([count, gone])))
        return {
            "room": room,
            "taken": taken,
            "first": first,
            "lost": reader.lost,
            "ended": reader.ended,
            "written": writer.written,
            "lines": lines,
            "told": lost,
            "head": [
                content[:8].decode(),
                *struct.unpack_from("<II", content, 8),
                *struct.unpack_from("<QQ", content, 16),
                *struct.unpack_from("<II", content, 32),
            ],
            "header": content[64:69].decode(),
            "size": len(content),
            "row": list(struct.unpack_from("<3d", content, 4096 + 24 * 3)),
        }

    def changed(place: int, value: int, kind: str = "<I") -> Any:
        def of(path: Path) -> Any:
            with RingWriter(path, "t,x,v", 8):
                pass
            content = bytearray(path.read_bytes())
            struct.pack_into(kind, content, place, value)
            path.write_bytes(content)
            return RingReader(path).header

        return in_a_file(b"", of)

    def made(header: str, slots: int) -> Any:
        def of(path: Path) -> Any:
            with RingWriter(path, header, slots):
                return path.stat().st_size

        return in_a_file(b"", of)

    def many(path: Path) -> Any:
        with RingWriter(path, "t", 9000) as writer:
            writer.write(np.arange(8500.0)[:, None])
            reader = RingReader(path)
            return [len(reader.take()), len(reader.take()), len(reader.take()), reader.lost]

    return {
        "written": in_a_file(b"", written),
        "at a time": in_a_file(b"", many),
        "changed": [
            changed(place, value)
            for place, value in ((8, 0), (12, 0), (8, 2), (12, 9), (36, 4), (36, 4032), (36, 4033), (0, 5))
        ],
        "made": [
            made(header, slots) for header, slots in (("", 8), ("t", 1), ("t", 2), ("x" * 4032, 2), ("x" * 4033, 2))
        ],
        "files": [
            in_a_file(content, lambda path: RingReader(path).header)
            for content in (b"", b"HYDRING1", b"HYDRING1" + b"\0" * 4087, b"HYDRING1" + b"\0" * 4088)
        ],
        "pause [s] and most": [ring.PAUSE, ring.MOST_ROWS],
    }


@NUMBERS.case()
def groups_of_hdf5() -> dict[str, Any]:
    h5py = pytest.importorskip("h5py")

    def told(fill: Callable[[Any], None]) -> Any:
        def of(path: Path) -> Any:
            with h5py.File(path, "w") as file:
                fill(file)
            tables = hdf5.open_hdf5(path)
            return [
                [
                    table.label,
                    [[one.name, one.unit] for one in table.headings],
                    {str(k): np.asarray(v)[:3] for k, v in table.numbers().items()},
                    table.metadata,
                ]
                for table in tables
            ]

        return in_a_file(b"", of, "a.h5")

    def some(file: Any) -> None:
        file["x"] = np.arange(5.0)
        file["x"].attrs["unit"] = b" mm "
        file["g/y"] = np.arange(10.0).reshape(5, 2)
        file["g/y"].attrs["names"] = ["a", "b"]
        file["g/z"] = np.arange(10.0).reshape(5, 2)
        file["one"] = 3.0
        file["text"] = "abc"
        file["rec"] = np.array([(1.0, 2, b"a"), (3.0, 4, b"b")], dtype=[("p", "f8"), ("q", "i4"), ("r", "S1")])
        file["rec2"] = np.zeros((2, 2), dtype=[("p", "f8")])

    def matlab(file: Any) -> None:
        file["record/x"] = np.arange(6.0).reshape(1, 6)
        file["record/x"].attrs["MATLAB_class"] = b"double"
        file["record/m"] = np.arange(12.0).reshape(2, 6)
        file["record/m"].attrs["MATLAB_class"] = b"double"
        text = np.frombuffer("{}".encode("utf-16-le"), "<u2")
        file["record/metadata_json"] = text
        file["record/metadata_json"].attrs["MATLAB_class"] = b"char"
        file["y"] = np.arange(6.0)

    return {
        "some": told(some),
        "of MATLAB": told(matlab),
        "nothing": told(lambda _file: None),
        "empty": told(lambda file: file.__setitem__("x", np.zeros(0))),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
