"""Kinds of values that a kernel computes with, and their spelling in LLVM's intermediate representation."""

import struct
from dataclasses import dataclass
from typing import TypeAlias


class KernelError(Exception):
    """A kernel cannot be compiled; the message names the line, what was expected and what was found."""

    placed = False

    def within(self, place: str) -> "KernelError":
        """Return the error with the innermost location at which it occurred."""
        if self.placed:
            return self
        error = KernelError(f"{place}: {self}")
        error.placed = True
        return error


@dataclass(frozen=True, eq=False)
class ScalarKind:
    """A single number; each kind has one instance.

    Parameters
    ----------
    parts : tuple of str
        LLVM types of its parts, in registers.
    stored : str
        Its LLVM type in an array.
    size : int
        Its size in an array [bytes].
    """

    name: str
    parts: tuple[str, ...]
    stored: str
    size: int


FLOAT = ScalarKind("float", ("double",), "double", 8)
INT = ScalarKind("int", ("i64",), "i64", 8)
BOOL = ScalarKind("bool", ("i1",), "i8", 1)
COMPLEX = ScalarKind("complex", ("double", "double"), "{ double, double }", 16)
SCALARS = {kind.name: kind for kind in (FLOAT, INT, BOOL, COMPLEX)}


@dataclass(frozen=True)
class ArrayKind:
    """An array: a pointer, its lengths and, unless it is contiguous row by row, its strides [elements].

    Parameters
    ----------
    packed : bool
        Whether rows follow each other without gaps.
    """

    element: ScalarKind
    rank: int
    packed: bool = True

    @property
    def parts(self) -> tuple[str, ...]:
        """LLVM types of its parts."""
        return ("ptr", *["i64"] * (self.rank if self.packed else 2 * self.rank))

    @property
    def name(self) -> str:
        """Name in error messages."""
        return f"array of {self.element.name}, {self.rank}-dimensional"


@dataclass(frozen=True)
class Slice:
    """A part of an axis, by its start and end."""

    parts: tuple[str, ...] = ("i64", "i64")
    name: str = "slice"


@dataclass(frozen=True)
class Range:
    """Range of a loop: start, end, step."""

    parts: tuple[str, ...] = ("i64", "i64", "i64")
    name: str = "range"


@dataclass(frozen=True)
class TupleKind:
    """A tuple.

    Parameters
    ----------
    names : tuple of str
        Names of its items, for a named tuple.
    """

    items: tuple["AnyKind", ...]
    names: tuple[str, ...] = ()

    @property
    def parts(self) -> tuple[str, ...]:
        """LLVM types of its parts."""
        return tuple(part for item in self.items for part in item.parts)

    @property
    def name(self) -> str:
        """Name in error messages."""
        return f"({', '.join(item.name for item in self.items)})"


AnyKind: TypeAlias = ScalarKind | ArrayKind | Slice | Range | TupleKind

NOTHING = TupleKind(())
"""Result of a function that returns nothing."""


@dataclass(frozen=True)
class Value:
    """A value: its kind, and the registers or constants that hold its parts.

    Parameters
    ----------
    origin : frozenset of str
        The function's parameters whose memory may contain the array.
    """

    kind: AnyKind
    parts: tuple[str, ...]
    origin: frozenset[str] = frozenset()

    @property
    def array(self) -> ArrayKind:
        """Its kind, for an array."""
        if not isinstance(self.kind, ArrayKind):
            raise KernelError(f"an array is wanted, got {self.kind.name}")
        return self.kind

    @property
    def lengths(self) -> tuple[str, ...]:
        """Lengths of an array's axes."""
        return self.parts[1 : 1 + self.array.rank]

    @property
    def items(self) -> "tuple[Value, ...]":
        """Items of a tuple."""
        if not isinstance(self.kind, TupleKind):
            raise KernelError(f"a tuple is wanted, got {self.kind.name}")
        found: list[Value] = []
        place = 0
        for kind in self.kind.items:
            found.append(Value(kind, self.parts[place : place + len(kind.parts)], self.origin))
            place += len(kind.parts)
        return tuple(found)


def structure(kind: AnyKind) -> str:
    """Return the LLVM type of a function's result."""
    parts = kind.parts
    return "void" if not parts else parts[0] if len(parts) == 1 else f"{{ {', '.join(parts)} }}"


def tuple_value(values: "tuple[Value, ...] | list[Value]") -> Value:
    """Return values as a tuple."""
    parts = tuple(part for value in values for part in value.parts)
    origin = frozenset[str]().union(*(value.origin for value in values))
    return Value(TupleKind(tuple(value.kind for value in values)), parts, origin)


def double_text(number: float) -> str:
    """Return the hexadecimal text of a number, exact to the bit.

    Parameters
    ----------
    number : float
        The number [any unit].
    """
    (bits,) = struct.unpack("<Q", struct.pack("<d", number))
    return f"0x{bits:016X}"


def number(value: object) -> Value:
    """Return a constant as a value."""
    match value:
        case bool():
            return Value(BOOL, ("true" if value else "false",))
        case int():
            return Value(INT, (str(value),))
        case float():
            return Value(FLOAT, (double_text(value),))
        case complex():
            return Value(COMPLEX, (double_text(value.real), double_text(value.imag)))
        case tuple():
            return tuple_value([number(item) for item in value])
        case _:
            raise KernelError(f"a kernel has numbers and tuples of them as constants, got {value!r}")


def is_literal(part: str) -> bool:
    """Return whether an integer is a constant at compile time."""
    return part.lstrip("-").isdigit()


_WIDENING_ORDER = (BOOL, INT, FLOAT, COMPLEX)


def common_kind(name: str, a: AnyKind | None, b: AnyKind) -> AnyKind:
    """Return the kind of a variable that holds two kinds of values.

    Raises
    ------
    KernelError
        If no kind holds both.
    """
    if a is None or a == b:
        return b
    match a, b:
        case ScalarKind(), ScalarKind() if BOOL not in (a, b):
            return _WIDENING_ORDER[max(_WIDENING_ORDER.index(a), _WIDENING_ORDER.index(b))]
        case ArrayKind(), ArrayKind() if (a.element, a.rank) == (b.element, b.rank):
            return ArrayKind(a.element, a.rank, packed=False)
        case TupleKind(), TupleKind() if len(a.items) == len(b.items):
            return TupleKind(tuple(common_kind(name, *pair) for pair in zip(a.items, b.items, strict=True)))
        case _:
            raise KernelError(f"{name} is once {a.name} and once {b.name}: it needs two names")
