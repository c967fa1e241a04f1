"""What compiled kernels do that Numba has no word for: lines as instructions, on numbers in memory.

A kernel contains the text of this file (`plant.compiled.source`), for Numba's cache does not notice a change in what a
kernel imports.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numba
from llvmlite import ir
from numba.extending import intrinsic

from plant.compiled.vector import DOUBLE, SHORT, WORD, Vector, vector_type

Lines = Callable[..., Mapping[str, Any]]
"""Straight lines: from values by name to results by name."""


def function_of(lines: Lines, results: int) -> Any:
    """Return lines as an operation on a tuple of numbers, in the order of their names, which gives all results.

    Parameters
    ----------
    lines : callable
        The lines.
    results : int
        How many they give.

    Returns
    -------
    intrinsic
        ``function((a, b))``, a tuple.
    """

    @intrinsic
    def function(_: Any, given: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            values = [Vector(builder, builder.extract_value(arguments[0], k)) for k in range(len(given))]
            found = [Vector(builder, DOUBLE(0.0)).like(value) for value in lines(*values).values()]
            return context.make_tuple(builder, signature.return_type, found)

        return numba.types.UniTuple(numba.float64, results)(given), code

    return function


def advancing(given: Sequence[str], slots: Mapping[str, int], lines: Lines, results: int) -> Any:
    """Return lines as an operation on a tuple of numbers, and on numbers in memory, which gives all results.

    Parameters
    ----------
    given : sequence of str
        Names of the numbers in the tuple.
    slots : Mapping[str, int]
        Where the others stand.
    lines : callable
        The lines.
    results : int
        How many they give.

    Returns
    -------
    intrinsic
        ``advance((a, b), address)``, a tuple, with the address of slot 0.
    """

    @intrinsic
    def advance(_: Any, numbers: Any, address: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            def value(name: str) -> Vector:
                if name in given:
                    return Vector(builder, builder.extract_value(arguments[0], given.index(name)))
                return Vector(builder, builder.load(_place(builder, arguments[1], WORD(8 * slots[name]), DOUBLE)))

            found = lines(*map(value, inspect.signature(lines).parameters)).values()
            numbers = [Vector(builder, DOUBLE(0.0)).like(result) for result in found]
            return context.make_tuple(builder, signature.return_type, numbers)

        return numba.types.UniTuple(numba.float64, results)(numbers, address), code

    return advance


def loading(count: int) -> Any:
    """Return an operation that reads so many numbers, one after the other.

    Parameters
    ----------
    count : int
        How many.

    Returns
    -------
    intrinsic
        ``load(address)``, a tuple.
    """

    @intrinsic
    def load(_: Any, address: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            places = [_place(builder, arguments[0], WORD(8 * k), DOUBLE) for k in range(count)]
            return context.make_tuple(builder, signature.return_type, [builder.load(place) for place in places])

        return numba.types.UniTuple(numba.float64, count)(address), code

    return load


def _store(_: Any, numbers: Any, address: Any) -> Any:
    def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        for k in range(len(numbers)):
            place = _place(builder, arguments[1], WORD(8 * k), DOUBLE)
            builder.store(builder.extract_value(arguments[0], k), place)
        return context.get_dummy_value()

    return numba.void(numbers, address), code


store = intrinsic(_store)
"""``store(numbers, address)``: write a tuple's numbers, one after the other."""


def stepping(slots: Mapping[str, int], width: int, *parts: Lines) -> Any:
    """Return an operation on numbers in memory: lines one after the other, each from what stands and from those before.

    Parameters
    ----------
    slots : Mapping[str, int]
        Where the first of a symbol's numbers stands, the others following.
    width : int
        How many of each are taken.
    *parts : callable
        Lines.

    Returns
    -------
    intrinsic
        ``step(address, j)``, with the address of slot 0; ``j`` is given to the lines by that name.
    """

    @intrinsic
    def step(_: Any, address: Any, j: Any) -> Any:  # noqa: ARG001  Numba passes types
        def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            def place(name: str) -> Any:
                return _place(builder, arguments[0], WORD(8 * slots[name]), vector_type(width))

            attributes = builder.function.attributes
            attributes.alignstack = 64  # what registers cannot hold is put aside in whole cache lines
            attributes.add("nounwind")  # llvmlite forgets an alignment that stands alone
            known = {"j": Vector(builder, _spread(builder, arguments[1], width))}
            results: dict[str, Any] = {}
            for lines in parts:
                names = inspect.signature(lines).parameters
                known |= {
                    name: Vector(builder, builder.load(place(name), align=8)) for name in names if name not in known
                }
                results |= lines(*(known[name] for name in names))
                known |= results
            for name, value in results.items():
                if name in slots:
                    builder.store(known["j"].like(value), place(name), align=8)
            return context.get_dummy_value()

        return numba.void(numba.int64, numba.float64), code

    return step


def _place(builder: Any, address: Any, distance: Any, kind: Any) -> Any:
    """Return a pointer to what stands at a distance in bytes from an address."""
    return builder.inttoptr(builder.add(address, distance), kind.as_pointer())


def _spread(builder: Any, number: Any, width: int) -> Any:
    """Return a vector that holds a number in each place."""
    if width == 1:
        return number
    single = builder.insert_element(vector_type(width)(ir.Undefined), number, SHORT(0))
    return builder.shuffle_vector(single, single, ir.VectorType(SHORT, width)([0] * width))


def moving(width: int) -> Any:
    """Return an operation that copies so many numbers from one address to another.

    Parameters
    ----------
    width : int
        How many.

    Returns
    -------
    intrinsic
        ``move(source, target)``.
    """

    @intrinsic
    def move(_: Any, source: Any, target: Any) -> Any:  # noqa: ARG001  Numba passes types
        def code(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            source, target = (_place(builder, address, WORD(0), vector_type(width)) for address in arguments)
            builder.store(builder.load(source, align=8), target, align=8)
            return context.get_dummy_value()

        return numba.void(numba.int64, numba.int64), code

    return move
