"""Mutations of a file's blocks: lines, archive members, segments and elements."""

import re

import numpy as np

from tests.fuzz.mutations import CELLS, INTERESTING, mutated

Generator = np.random.Generator

MARKS = re.compile(
    rb"\n|PK[\1\3\5][\2\4\6]|TDSm|##[A-Z]{2}|TREE|HEAP|SNOD|OHDR|FRHP|BTHD|PAR1|\xff{4}|ARROW1|\x0e\0\0\0"
)
"""Patterns at which lines, members, segments, blocks and elements begin."""


def boundaries(data: bytes) -> list[int]:
    """Return the places at which blocks of a file begin, with both ends of the file."""
    found = [one.start() for one in MARKS.finditer(data)]
    return sorted({0, *found, *(one + 4 for one in found), len(data)})


def _two(data: bytes, rng: Generator) -> tuple[int, int]:
    places = boundaries(data)
    first, last = sorted(int(rng.choice(places)) for _ in range(2))
    return first, min(last, first + int(rng.choice((64, 4096, 10**9))))


def cut(data: bytes, rng: Generator) -> bytes:
    """Return the file up to a boundary, or up to a byte before or after it."""
    return data[: max(int(rng.choice(boundaries(data))) + int(rng.integers(-1, 2)), 0)]


def headless(data: bytes, rng: Generator) -> bytes:
    """Return the file from a boundary on."""
    return data[int(rng.choice(boundaries(data))) :]


def doubled(data: bytes, rng: Generator) -> bytes:
    """Return the file with a block written twice, or about a thousand times."""
    first, last = _two(data, rng)
    block = data[first:last]
    return data[:last] + block * (1 + 999 * int(rng.random() < 0.1 and len(block) < 4000)) + data[last:]


def exchanged(data: bytes, rng: Generator) -> bytes:
    """Return the file with two adjacent blocks exchanged."""
    first, last = _two(data, rng)
    middle = (first + last) // 2
    return data[:first] + data[middle:last] + data[first:middle] + data[last:]


def lost(data: bytes, rng: Generator) -> bytes:
    """Return the file without one block."""
    first, last = _two(data, rng)
    return data[:first] + data[last:]


def blank(data: bytes, rng: Generator) -> bytes:
    """Return the file with a block filled with one byte, as after the loss of disk sectors."""
    first, last = _two(data, rng)
    return data[:first] + bytes([int(rng.choice((0, 0xFF, 0x20)))]) * (last - first) + data[last:]


def swapped(data: bytes, rng: Generator) -> bytes:
    """Return the file with the bytes of a part in reverse order, as in the other byte order."""
    size = int(rng.choice((2, 4, 8)))
    first = int(rng.choice(boundaries(data)))
    last = min(len(data), first + size * int(rng.integers(1, 40)))
    last -= (last - first) % size
    stretch = np.frombuffer(data[first:last], "u1").reshape(-1, size)[:, ::-1]
    return data[:first] + stretch.tobytes() + data[last:]


def declared(data: bytes, rng: Generator) -> bytes:
    """Return the file with impossible counts or offsets at the beginning of blocks."""
    made = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        at, size = int(rng.choice(boundaries(data))) + 4 * int(rng.integers(0, 8)), int(rng.choice((2, 4, 8)))
        number = int(rng.choice((*INTERESTING[:9], len(data), len(data) + 1, 2**31 - 8, 10**9))) & (256**size - 1)
        made[at : at + size] = number.to_bytes(size, str(rng.choice(("little", "big"))))  # pyright: ignore[reportArgumentType]
    return bytes(made)


def rained(data: bytes, rng: Generator) -> bytes:
    """Return the file with bits flipped at random places."""
    made = np.frombuffer(data, "u1").copy()
    if len(made):
        at = rng.integers(len(made), size=int(rng.choice((1, 3, 30, 300))))
        made[at] ^= (1 << rng.integers(8, size=len(at))).astype("u1")
    return made.tobytes()


def anywhere(data: bytes, rng: Generator) -> bytes:
    """Return the file mutated as by the other fuzzer."""
    return mutated(data, rng, CELLS)


BINARY = (cut, headless, doubled, exchanged, lost, blank, swapped, declared, declared, rained, anywhere)
