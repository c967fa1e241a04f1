"""A compiled kernel as Python calls it: arguments are checked and laid out, results are copied."""

import ctypes
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn, TypeAlias

import numpy as np

from plant.compiled.native.kinds import BOOL, COMPLEX, FLOAT, INT, AnyKind, ArrayKind, ScalarKind, TupleKind
from plant.compiled.native.signature import Argument, Signature

Call: TypeAlias = Callable[[Any, Any], None]

_DTYPES = {
    FLOAT: np.dtype(np.float64),
    INT: np.dtype(np.int64),
    BOOL: np.dtype(np.bool_),
    COMPLEX: np.dtype(np.complex128),
}
_CODES = {FLOAT: "d", INT: "q", BOOL: "q", COMPLEX: "dd"}


def _code(kind: AnyKind) -> str:
    """Return the packing codes of a kind's parts."""
    match kind:
        case ScalarKind():
            return _CODES[kind]
        case ArrayKind():
            return "Q" + "q" * kind.rank
        case TupleKind():
            return "".join(map(_code, kind.items))
        case _:
            raise TypeError(f"a kernel is not entered with a {kind.name}")


@dataclass
class _ArgumentLayout:
    """Arguments during their layout.

    Parameters
    ----------
    numbers : list
        Their parts.
    arrays : list of (str, int, int, bool)
        Arguments that are not empty: name, start and end in memory, and whether the kernel changes them.
    back : list of (ndarray, ndarray)
        Copies, and the arrays to which their changes are copied back.
    copies : list of ndarray
        All copies, which must live while the kernel runs.
    lengths : dict
        Values of named lengths, and the argument that set each.
    """

    numbers: list[Any]
    arrays: list[tuple[str, int, int, bool]]
    back: list[tuple[Any, Any]]
    copies: list[Any]
    lengths: dict[str, tuple[int, str]]


class Entry:
    """A compiled function of a kernel.

    Parameters
    ----------
    name : str
        Kernel and function, for errors.
    takes : tuple of Argument
        Its arguments.
    returns : AnyKind
        Its result.
    written : frozenset of str
        Arguments whose arrays it changes.
    call, release : callable
        The machine code, and the function that frees the arrays that it allocated.
    """

    def __init__(
        self, name: str, takes: Signature, returns: AnyKind, written: frozenset[str], call: Call, release: Call
    ) -> None:
        self.__name__ = name
        self._takes, self._returns, self._written = takes, returns, written
        self._call, self._release = call, release
        self._plan = [(one, _dtype(one.kind), one.name in written) for one in takes]
        self._layout = struct.Struct("=" + "".join(_code(argument.kind) for argument in takes))
        self._results = struct.Struct("=" + _code(returns))
        self._room = ctypes.c_char * (self._results.size + 8)

    def __call__(self, *given: Any) -> Any:
        """Run the kernel without Python's lock.

        Raises
        ------
        TypeError
            If an argument is of another kind than the kernel was compiled for.
        ValueError
            If an array has another shape, or overlaps with one that is changed.
        """
        laid, packed = self._lay_all(given)
        room = self._room()
        self._call(packed, room)
        for array, copy in laid.back:
            array[...] = copy
        if not self._results.size:
            return None
        parts = iter(self._results.unpack_from(room))
        result = _result(self._returns, parts)
        pointer = ctypes.addressof(room) + self._results.size
        if ctypes.c_void_p.from_address(pointer).value:
            self._release(pointer, None)
        return result

    def prepared_call(self, *given: Any) -> Callable[[], None]:
        """Return a call on these arguments, laid out only once: for a loop that fills the same arrays again and again.

        Raises
        ------
        TypeError
            If an argument is of another kind, or would have to be copied, or if the kernel returns something.
        ValueError
            As for a call.
        """
        laid, packed = self._lay_all(given)
        if laid.copies or self._results.size:
            raise TypeError(f"{self.__name__}: what is called again takes arrays as they are and returns nothing")
        room = self._room()

        def call(_kept: Sequence[Any] = given) -> None:  # the arrays live as long as the call
            self._call(packed, room)

        return call

    def _lay_all(self, given: Sequence[Any]) -> tuple[_ArgumentLayout, bytes]:
        """Return arguments in the layout of the machine code."""
        if len(given) != len(self._takes):
            names = ", ".join(argument.name for argument in self._takes)
            raise TypeError(f"{self.__name__} takes {len(self._takes)} arguments ({names}), got {len(given)}")
        laid = _ArgumentLayout([], [], [], [], {})
        for (argument, dtype, changed), value in zip(self._plan, given, strict=True):
            if type(value) is np.ndarray and value.dtype is dtype and value.flags.carray:
                self._lay_valid_array(argument, value, laid, changed=changed)
            else:
                self._lay_value(argument, value, laid, changed=changed)
        if self._written:
            self._check_disjoint(laid)
        try:
            return laid, self._layout.pack(*laid.numbers)
        except struct.error:
            self._fail("a whole number", "64 bits", "more")

    def _fail(self, what: str, wanted: str, came: str) -> NoReturn:
        raise TypeError(f"{self.__name__}: {what} must be {wanted}, got {came}")

    def _lay_value(self, argument: Argument, value: Any, laid: _ArgumentLayout, *, changed: bool) -> None:
        kind = argument.kind
        if isinstance(kind, ArrayKind):
            self._lay_array(argument, kind, value, laid, changed=changed)
        elif isinstance(kind, TupleKind):
            if len(value) != len(argument.items):
                self._fail(argument.name, f"a tuple of {len(argument.items)}", f"{len(value)} items")
            for item, one in zip(argument.items, value, strict=True):
                self._lay_value(item, one, laid, changed=changed)
        elif kind == FLOAT and isinstance(value, float | int | np.floating | np.integer):
            laid.numbers.append(value)
        elif (kind == INT and isinstance(value, int | np.integer)) or (
            kind == BOOL and isinstance(value, bool | np.bool_)
        ):
            laid.numbers.append(int(value))
        else:
            self._fail(argument.name, f"a number ({kind.name})", repr(value))

    def _lay_array(
        self, argument: Argument, kind: ArrayKind, value: Any, laid: _ArgumentLayout, *, changed: bool
    ) -> None:
        dtype = _dtype(kind)
        if not isinstance(value, np.ndarray) or value.ndim != kind.rank:
            came = f"{value.ndim}-dimensional" if isinstance(value, np.ndarray) else type(value).__name__
            self._fail(argument.name, f"an {kind.name}", came)
        array: Any = value
        if array.dtype != dtype or not (array.flags.c_contiguous and array.flags.aligned):
            if not np.can_cast(array.dtype, dtype, "equiv" if changed else "safe"):
                self._fail(argument.name, f"an array of {dtype}", f"one of {array.dtype}")
            array = np.require(array, dtype, ["C", "A"])
            laid.copies.append(array)
            if changed:
                laid.back.append((value, array))
        if changed and not value.flags.writeable:
            self._fail(argument.name, "an array that may be changed", "one that is read-only")
        self._lay_valid_array(argument, array, laid, changed=changed)

    def _lay_valid_array(self, argument: Argument, array: Any, laid: _ArgumentLayout, *, changed: bool) -> None:
        """Lay out an array that is valid except for its shape, which is checked here."""
        shape, name = array.shape, argument.name
        if len(shape) != len(argument.lengths):
            self._fail(name, f"an {argument.kind.name}", f"{len(shape)}-dimensional")
        for axis, wanted in enumerate(argument.lengths):
            length = shape[axis]
            if wanted is None or wanted == length:
                continue
            # the first argument with a named length sets that length
            known, by = laid.lengths.setdefault(wanted, (length, name)) if isinstance(wanted, str) else (wanted, "")
            if known != length:
                of = f"{known} ({wanted}, as of {by})" if by else known
                raise ValueError(f"{self.__name__}: axis {axis} of {name} must have length {of}, got {length}")
        address = _address(array)
        laid.numbers += (address, *shape)
        if size := array.nbytes:
            laid.arrays.append((name, address, address + size, changed))

    def _check_disjoint(self, laid: _ArgumentLayout) -> None:
        """Check that arrays that are changed do not share memory with others, as the machine code assumes."""
        for name, begin, end, changed in laid.arrays:
            if not changed:
                continue
            for other, first, last, _ in laid.arrays:
                if begin < last and first < end and other != name:
                    raise ValueError(f"{self.__name__}: {name} and {other} must not share memory")


def _address_through_object(array: Any) -> int:
    """Return the address of an array's data, which NumPy stores directly after Python's object header."""
    return _WORD.from_address(id(array) + object.__basicsize__).value


_WORD = ctypes.c_size_t
_PROBE = np.zeros(4)[1:]

# ten times quicker than `ctypes.data`, which each log needs hundreds of times; used only if both give the same address
_address: Callable[[Any], int] = (
    _address_through_object
    if _address_through_object(_PROBE) == _PROBE.ctypes.data
    else lambda array: array.ctypes.data
)


def _dtype(kind: AnyKind) -> Any:
    """Return the data type of an array's elements; None for any other kind."""
    return _DTYPES[kind.element] if isinstance(kind, ArrayKind) else None


def _result(kind: AnyKind, parts: Any) -> Any:
    """Return a result from its parts."""
    if isinstance(kind, TupleKind):
        return tuple(_result(item, parts) for item in kind.items)
    if isinstance(kind, ArrayKind):
        address = next(parts)
        return _independent_copy(address, [next(parts) for _ in range(kind.rank)], _DTYPES[kind.element])
    if kind == COMPLEX:
        return complex(next(parts), next(parts))
    return bool(next(parts)) if kind == BOOL else next(parts)


def _independent_copy(address: int, shape: Sequence[int], dtype: Any) -> Any:
    """Return an independent array, copied from memory that is about to be freed."""
    result = np.empty(shape, dtype)
    ctypes.memmove(result.ctypes.data, address, result.nbytes)
    return result
