"""A reader of MAT files of versions 5 to 7 for numbers, text and structs, which a damaged file cannot crash.

scipy's reader trusts the tags of a file: one wrong byte can end the process. The layout is that of "MAT-File Format",
The MathWorks. Other contents (cells, objects, sparse matrices) are skipped.
"""

import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from plant.log.formats.packed import inflate, most_unpacked

MatValue = NDArray[np.generic] | str | Mapping[str, "MatValue"] | Sequence["MatValue"] | None

NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
MATRIX, COMPRESSED = 14, 15
STRUCT, CHAR, FIRST_NUMERIC, LAST_NUMERIC = 2, 4, 6, 15
COMPLEX = 0x0800
HEADER = 128
MAT_7_3_VERSIONS = (b"\x00\x02IM", b"\x02\x00MI")
"""Version and byte order of a MAT 7.3."""

MOST_NESTED = 20
"""Structs within structs that are read [count]; judged."""


class DamagedMatError(ValueError):
    """A MAT file ends too early or contradicts itself."""


@dataclass
class _Reader:
    """A cursor over the elements of one part of a file."""

    data: memoryview
    order: Literal["little", "big"]
    at: int = 0
    depth: int = 0

    def integer(self, at: int) -> int:
        return int.from_bytes(self.data[at : at + 4], self.order)

    def has_more(self) -> bool:
        return self.at + 8 <= len(self.data)

    def element(self) -> tuple[int, memoryview]:
        """Return the type and the content of the next element, and move past it."""
        if not self.has_more():
            raise DamagedMatError("the file ends within an element")
        kind, count, start = self.integer(self.at), self.integer(self.at + 4), self.at + 8
        after = start + count + (0 if kind == COMPRESSED else -count % 8)
        if kind >> 16:  # up to four bytes of data are in the tag itself
            kind, count, start, after = kind & 0xFFFF, min(kind >> 16, 4), self.at + 4, self.at + 8
        if start + count > len(self.data):
            raise DamagedMatError("the file ends within an element")
        self.at = after
        return kind, self.data[start : start + count]

    def numbers(self) -> NDArray[np.generic]:
        kind, content = self.element()
        if kind not in NUMBERS:
            raise DamagedMatError(f"numbers of the unknown kind {kind}")
        dtype = np.dtype(NUMBERS[kind]).newbyteorder("<" if self.order == "little" else ">")
        return np.frombuffer(content[: len(content) // dtype.itemsize * dtype.itemsize], dtype)

    def nested_reader(self, content: memoryview) -> "_Reader":
        if self.depth > MOST_NESTED:
            raise DamagedMatError(f"structs within structs, over {MOST_NESTED} deep")
        return _Reader(content, self.order, depth=self.depth + 1)


def read_variables(content: bytes, source: str = "the file") -> dict[str, MatValue]:
    """Return the variables of a MAT file of version 5 to 7.

    Returns
    -------
    dict[str, MatValue]
        Arrays without their dimensions of one, text, structs as mappings; None for what is not read.

    Raises
    ------
    DamagedMatError
        If the file is of another version, ends too early, or contradicts itself.
    LogError
        If it unpacks to more than a log does.
    """
    if content[HEADER - 4 : HEADER] in MAT_7_3_VERSIONS:
        raise DamagedMatError("a MAT file of version 7.3 that holds no HDF5")
    mark = content[HEADER - 2 : HEADER]
    if mark not in (b"IM", b"MI"):
        raise DamagedMatError("no mark of a MAT file of version 4 to 7")
    order: Literal["little", "big"] = "little" if mark == b"IM" else "big"
    variables = _variables(_Reader(memoryview(content), order, HEADER), most_unpacked(len(content)), source)
    return {name: value for name, value in variables if name}


def _variables(reader: _Reader, most: int, source: str) -> Iterator[tuple[str, MatValue]]:
    while reader.has_more():
        kind, content = reader.element()
        if kind == COMPRESSED:
            try:
                unpacked = inflate(content, most, source)
                most -= len(unpacked)
            except zlib.error as error:
                raise DamagedMatError(f"a compressed variable cannot be unpacked: {error}") from error
            kind, content = reader.nested_reader(memoryview(unpacked)).element()
        if kind == MATRIX:
            yield _matrix(reader.nested_reader(content))


def _matrix(reader: _Reader) -> tuple[str, MatValue]:
    flags = reader.numbers()
    if len(flags) == 0:
        raise DamagedMatError("a variable without a class")
    kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & COMPLEX)
    if kind != CHAR and kind != STRUCT and not FIRST_NUMERIC <= kind <= LAST_NUMERIC:
        return "", None
    shape = tuple(int(size) for size in reader.numbers())
    name = bytes(reader.element()[1]).decode("latin-1")
    if kind == CHAR:
        return name, _text(reader)
    if kind == STRUCT:
        structs = _structs(reader, prod(shape))
        return name, structs[0] if len(structs) == 1 else structs
    values = _reshape(reader.numbers(), shape)
    if not is_complex:
        return name, values
    return name, values.astype(np.complex128) + 1j * _reshape(reader.numbers(), shape).astype(np.float64)


def _reshape(values: NDArray[np.generic], shape: tuple[int, ...]) -> NDArray[np.generic]:
    if any(size < 0 for size in shape) or prod(shape) != len(values):
        raise DamagedMatError(f"{len(values)} numbers in an array of shape {shape}")
    return values if values.size == 0 else values.reshape(shape, order="F").squeeze()


def _text(reader: _Reader) -> str:
    kind, content = reader.element()
    encoding = TEXTS.get(kind, "latin-1")
    if encoding.startswith(("utf-16", "utf-32")):
        encoding += "-le" if reader.order == "little" else "-be"
    return bytes(content).decode(encoding, errors="replace")


def _structs(reader: _Reader, count: int) -> list[Mapping[str, MatValue]]:
    """Return the structs of an array; all have the same fields."""
    width, (_, labels) = reader.numbers(), reader.element()
    if len(width) != 1 or int(width[0]) < 1:
        raise DamagedMatError("a struct without a length of its field names")
    size = int(width[0])
    names = [
        bytes(labels[start : start + size]).split(b"\0", 1)[0].decode("latin-1")
        for start in range(0, len(labels), size)
    ]
    structs: list[Mapping[str, MatValue]] = []
    for _ in range(count):
        fields: dict[str, MatValue] = {}
        for name in names:
            kind, content = reader.element()
            fields[name] = _matrix(reader.nested_reader(content))[1] if kind == MATRIX and len(content) else None
        if not fields:
            break
        structs.append(fields)
    return structs
