"""A reader of MAT files of versions 5 to 7 for numbers, text and structs, which a damaged file cannot crash.

scipy's reader trusts the tags of a file: one wrong byte can end the process. Layout as in "MAT-File Format",
The MathWorks; what is not read here (cells, objects, sparse matrices) is skipped.
"""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import prod
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Value = NDArray[np.generic] | str | Mapping[str, "Value"] | None

NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
MATRIX, COMPRESSED = 14, 15
STRUCT, CHAR, FIRST_NUMERIC, LAST_NUMERIC = 2, 4, 6, 15
COMPLEX = 0x0800
HEADER = 128


class DamagedMatError(ValueError):
    """A MAT file ends too early or contradicts itself."""


@dataclass
class _Reader:
    """A walk through the elements of one stretch of a file."""

    data: memoryview
    order: Literal["little", "big"]
    at: int = 0

    def integer(self, at: int) -> int:
        return int.from_bytes(self.data[at : at + 4], self.order)

    def more(self) -> bool:
        return self.at + 8 <= len(self.data)

    def element(self) -> tuple[int, memoryview]:
        """Return the kind and the content of the next element, and step over it."""
        if not self.more():
            raise DamagedMatError("the file ends within an element")
        kind, count, start = self.integer(self.at), self.integer(self.at + 4), self.at + 8
        after = start + count + (0 if kind == COMPRESSED else -count % 8)
        if kind >> 16:  # four bytes or fewer stand in the tag itself
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

    def inside(self, content: memoryview) -> "_Reader":
        return _Reader(content, self.order)


def read_variables(content: bytes) -> dict[str, Value]:
    """Return the variables of a MAT file of version 5 to 7.

    Returns
    -------
    dict[str, Value]
        Arrays without their dimensions of one, text, structs as mappings; None for what is not read.

    Raises
    ------
    DamagedMatError
        If the file is of another version, ends too early, or contradicts itself.
    """
    mark = content[HEADER - 2 : HEADER]
    if mark not in (b"IM", b"MI"):
        raise DamagedMatError("no mark of a MAT file of version 5 to 7")
    order: Literal["little", "big"] = "little" if mark == b"IM" else "big"
    variables = _variables(_Reader(memoryview(content), order, HEADER))
    return {name: value for name, value in variables if name}


def _variables(reader: _Reader) -> Iterator[tuple[str, Value]]:
    while reader.more():
        kind, content = reader.element()
        if kind == COMPRESSED:
            try:
                unpacked = zlib.decompress(content)
            except zlib.error as error:
                raise DamagedMatError(f"a compressed variable cannot be unpacked: {error}") from error
            kind, content = reader.inside(memoryview(unpacked)).element()
        if kind == MATRIX:
            yield _matrix(reader.inside(content))


def _matrix(reader: _Reader) -> tuple[str, Value]:
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
        return name, _struct(reader) if prod(shape) == 1 else None
    values = _shaped(reader.numbers(), shape)
    if not is_complex:
        return name, values
    return name, values.astype(np.complex128) + 1j * _shaped(reader.numbers(), shape).astype(np.float64)


def _shaped(values: NDArray[np.generic], shape: tuple[int, ...]) -> NDArray[np.generic]:
    if any(size < 0 for size in shape) or prod(shape) != len(values):
        raise DamagedMatError(f"{len(values)} numbers in an array of shape {shape}")
    return values if values.size == 0 else values.reshape(shape, order="F").squeeze()


def _text(reader: _Reader) -> str:
    kind, content = reader.element()
    encoding = TEXTS.get(kind, "latin-1")
    if encoding.startswith(("utf-16", "utf-32")):
        encoding += "-le" if reader.order == "little" else "-be"
    return bytes(content).decode(encoding, errors="replace")


def _struct(reader: _Reader) -> Mapping[str, Value]:
    width, (_, labels) = reader.numbers(), reader.element()
    if len(width) != 1 or int(width[0]) < 1:
        raise DamagedMatError("a struct without a length of its field names")
    size = int(width[0])
    fields: dict[str, Value] = {}
    for start in range(0, len(labels), size):
        name = bytes(labels[start : start + size]).split(b"\0", 1)[0].decode("latin-1")
        kind, content = reader.element()
        fields[name] = _matrix(reader.inside(content))[1] if kind == MATRIX and len(content) else None
    return fields
