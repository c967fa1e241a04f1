"""A reader of MAT files of version 4 for numbers and text, which a damaged file cannot crash.

Octave writes them on request, and simulations in Modelica (Dymola, OpenModelica) always do. The layout is that of
"MAT-File Format", The MathWorks, appendix on level 4: five integers, the name, the real part, the imaginary part.
"""

import struct

import numpy as np

from plant.log.formats.mat_reader import DamagedMatError, MatValue

HEADER = struct.calcsize("5i")
NUMBERS = ("f8", "f4", "i4", "i2", "u2", "u1")
"""Types of numbers, by the tens of a variable's type."""

NUMERIC, TEXT, SPARSE = 0, 1, 2
LARGEST_KIND = 10 * (len(NUMBERS) - 1) + SPARSE
"""Largest type of a little-endian variable; 1000 more is a big-endian one."""

LONGEST_NAME = 4096
"""Bytes of the longest name of a variable [count]; judged. MATLAB's have 63 at most."""


def is_version_4(content: bytes) -> bool:
    """Return whether a file begins as a MAT file of version 4 does.

    Examples
    --------
    >>> is_version_4(struct.pack("<5i", 0, 100, 1, 0, 2) + b"x" + bytes(1)), is_version_4(b"MATLAB 5.0 MAT-file" * 9)
    (True, False)
    """
    try:
        *_, imaginary, name = _header(content, 0)
    except DamagedMatError:
        return False
    return imaginary in (0, 1) and name > 1 and HEADER + name <= len(content)


def read_variables_of_version_4(content: bytes) -> dict[str, MatValue]:
    """Return the variables of a MAT file of version 4.

    Returns
    -------
    dict[str, MatValue]
        Arrays without their dimensions of one; text of one row as a string, of several as a list of strings; None for a
        sparse matrix.

    Raises
    ------
    DamagedMatError
        If the file ends too early, or contradicts itself.
    """
    found: dict[str, MatValue] = {}
    at = 0
    while at < len(content):
        order, kind, rows, columns, imaginary, named = _header(content, at)
        tens, use = divmod(kind, 10)
        at += HEADER
        name = content[at : at + named].split(b"\0", 1)[0].decode("latin-1")
        at += named
        dtype, parts = np.dtype(order + NUMBERS[tens]), 2 if imaginary else 1
        after = at + parts * rows * columns * dtype.itemsize
        if after > len(content):
            raise DamagedMatError(f"the file ends within the variable {name[:80]!r}")
        values = np.frombuffer(content, dtype, parts * rows * columns, at)
        at = after
        real, *others = (one.reshape((rows, columns), order="F") for one in np.split(values, parts))
        if use == SPARSE:
            found[name] = None
        elif use == TEXT:
            found[name] = _text(real)
        else:
            value = real if not others else real.astype(np.complex128) + 1j * others[0].astype(np.float64)
            found[name] = value.squeeze() if value.size else value
    return found


def _header(content: bytes, at: int) -> tuple[str, int, int, int, int, int]:
    """Return a variable's byte order, its type without it, rows, columns, imaginary part, and length of its name."""
    if at + HEADER > len(content):
        raise DamagedMatError("the file ends within a variable's header")
    for order in "<>":
        kind, *sizes = struct.unpack_from(f"{order}5i", content, at)
        kind -= 0 if order == "<" else 1000
        rows, columns, imaginary, name = sizes
        plain = 0 <= kind <= LARGEST_KIND and kind % 10 <= SPARSE
        if plain and min(rows, columns) >= 0 and 0 < name <= LONGEST_NAME:
            return order, kind, rows, columns, imaginary, name
    raise DamagedMatError(f"no variable of version 4 begins at byte {at}")


def _text(codes: np.ndarray) -> str | list[str]:
    """Return the rows of a matrix of character codes."""
    with np.errstate(invalid="ignore"):
        letters = np.clip(np.nan_to_num(codes), 0, 255).astype(np.uint8)
    rows = [bytes(row).decode("latin-1").rstrip(" \0") for row in letters]
    return rows[0] if len(rows) == 1 else rows
