"""Operations on numbers in memory that a kernel builds from its lines: steps, copies, transposes."""

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from plant.compiled.native.kinds import BOOL, FLOAT, INT, NOTHING, Value, tuple_value
from plant.compiled.native.lines import Lines, names_of, vector
from plant.compiled.native.operators import convert
from plant.compiled.native.scope import Scope
from plant.compiled.source import ROWS, Slot

Functions = Mapping[str, ast.FunctionDef]
Operation = Callable[[Scope, Sequence[Value]], Value]
"""Writes the operation on given values."""

NONE = Value(NOTHING, ())


def place(scope: Scope, address: str, distance: int | str) -> str:
    """Return a pointer at a distance in bytes from an address."""
    return scope.op(f"inttoptr i64 {scope.op(f'add i64 {address}, {distance}')} to ptr")


def operation_of(node: ast.Call, functions: Functions, constants: Mapping[str, object]) -> Operation | None:
    """Return the operation that a call in a kernel's text creates, if it creates one.

    Parameters
    ----------
    functions : Mapping[str, ast.FunctionDef]
        The kernel's functions, including lines.
    constants : Mapping[str, object]
        Values of names.
    """

    def value(part: ast.expr) -> Any:
        return constants[part.id] if isinstance(part, ast.Name) else ast.literal_eval(part)

    def lines(part: ast.expr) -> ast.FunctionDef:
        return functions[ast.unparse(part)]

    match ast.unparse(node.func), node.args:
        case "stepping", [slots, width, *parts]:
            return stepping(value(slots), value(width), [lines(part) for part in parts])
        case "moving", [width]:
            return moving(value(width))
        case "complete", [width, count, stride]:
            return complete(value(width), value(count), value(stride))
        case "loading", [count]:
            return loading(value(count))
        case "advancing", [given, slots, part, _]:
            return advancing(value(given), value(slots), lines(part))
        case "function_of", [part, _]:
            return function_of(lines(part))
        case _:
            return None


def stepping(slots: Mapping[str, Slot], width: int, parts: Sequence[ast.FunctionDef]) -> Operation:
    """Return ``step(address, j, *others)``: lines in sequence, each from numbers in memory and from earlier lines.

    The numbers are at the address, or at one of the others, see `plant.compiled.source.Slot`. It is a separate
    function, because its lines are many and may be called from several places.
    """
    kind = vector(width)

    def pointer(scope: Scope, name: str) -> str:
        slot = slots[name]
        base, distance = ("at", slot) if isinstance(slot, int) else (f"other{slot[0]}", slot[1])
        return place(scope, f"%{base}", 8 * distance)

    def body(scope: Scope) -> None:
        known = {"j": _spread(scope, "%j", width)}
        results: dict[str, str] = {}
        for part in parts:
            for name in names_of(part):
                if name not in known:
                    known[name] = scope.op(f"load {kind}, ptr {pointer(scope, name)}, align 8")
            found = Lines(scope, width, known).results(part)
            results |= found
            known |= found
        for name, register in results.items():
            if name in slots:
                scope.line(f"store {kind} {register}, ptr {pointer(scope, name)}, align 8")
        scope.line("ret void")

    made: list[str] = []

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        others = [convert(scope, one, INT).parts[0] for one in given[2:]]
        if not made:
            formal = ["i64 %at", "double %j", *(f"i64 %other{k}" for k in range(len(others)))]
            made.append(scope.program.separate("step", ", ".join(formal), body))
        address, j = convert(scope, given[0], INT).parts[0], convert(scope, given[1], FLOAT).parts[0]
        passed = [f"i64 {address}", f"double {j}", *(f"i64 {one}" for one in others)]
        scope.line(f"call void @{made[0]}({', '.join(passed)})")
        return NONE

    return operation


def _spread(scope: Scope, number: str, width: int) -> str:
    """Return a vector with the same number in each place."""
    if width == 1:
        return number
    kind = vector(width)
    single = scope.op(f"insertelement {kind} undef, double {number}, i32 0")
    return scope.op(f"shufflevector {kind} {single}, {kind} undef, <{width} x i32> zeroinitializer")


def moving(width: int) -> Operation:
    """Return ``move(source, target)``, which copies a fixed number of numbers."""
    kind = vector(width)

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        source, target = (place(scope, one.parts[0], 0) for one in given)
        scope.line(f"store {kind} {scope.op(f'load {kind}, ptr {source}, align 8')}, ptr {target}, align 8")
        return NONE

    return operation


def complete(width: int, count: int, stride: int) -> Operation:
    """Return ``complete(address)``: whether a fixed number of vectors, a stride in bytes apart, contain no NaN."""
    kind, truths = vector(width), "i1" if width == 1 else f"<{width} x i1>"

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        address = given[0].parts[0]
        found = [scope.op(f"load {kind}, ptr {place(scope, address, stride * k)}, align 8") for k in range(count)]
        every = ""
        for a, b in zip(found[::2], [*found[1::2], found[-1]], strict=False):  # ordered: neither value is NaN
            ordered = scope.op(f"fcmp ord {kind} {a}, {b}")
            every = scope.op(f"and {truths} {every}, {ordered}") if every else ordered
        if width == 1:
            return Value(BOOL, (every,))
        bits = scope.op(f"bitcast {truths} {every} to i{width}")
        return Value(BOOL, (scope.op(f"icmp eq i{width} {bits}, -1"),))

    return operation


def loading(count: int) -> Operation:
    """Return ``load(address)``: a tuple of a fixed number of consecutive numbers."""

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        places = [place(scope, given[0].parts[0], 8 * k) for k in range(count)]
        return tuple_value([Value(FLOAT, (scope.op(f"load double, ptr {one}"),)) for one in places])

    return operation


def store(scope: Scope, given: Sequence[Value]) -> Value:
    """Write a tuple's numbers consecutively: ``store(numbers, address)``."""
    for k, number in enumerate(given[0].items):
        register = convert(scope, number, FLOAT).parts[0]
        scope.line(f"store double {register}, ptr {place(scope, given[1].parts[0], 8 * k)}")
    return NONE


def advancing(names: Sequence[str], slots: Mapping[str, int], part: ast.FunctionDef) -> Operation:
    """Return ``advance((a, b), address)``: lines on a tuple of numbers, and on numbers in memory."""

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        numbers = dict(zip(names, (convert(scope, one, FLOAT).parts[0] for one in given[0].items), strict=True))
        for name in names_of(part):
            if name not in numbers:
                numbers[name] = scope.op(f"load double, ptr {place(scope, given[1].parts[0], 8 * slots[name])}")
        return tuple_value([Value(FLOAT, (one,)) for one in Lines(scope, 1, numbers).results(part).values()])

    return operation


def function_of(part: ast.FunctionDef) -> Operation:
    """Return ``function((a, b))``: lines on a tuple of numbers, in the order of their names."""

    def operation(scope: Scope, given: Sequence[Value]) -> Value:
        numbers = (convert(scope, one, FLOAT).parts[0] for one in given[0].items)
        found = Lines(scope, 1, dict(zip(names_of(part), numbers, strict=True))).results(part)
        return tuple_value([Value(FLOAT, (one,)) for one in found.values()])

    return operation


def transpose(scope: Scope, given: Sequence[Value]) -> Value:
    """Copy 8 numbers from each of 8 places into 8 rows of 8: ``transpose(places, offset, ahead, target, stride)``.

    All are in bytes: the address of the places' addresses, the offset added to each, the distance ahead at which data
    are prefetched into the cache, the address of the first row, and the distance between rows.
    """
    places, offset, ahead, target, stride = (one.parts[0] for one in given)
    kind, every = vector(ROWS), range(ROWS)
    scope.program.declare("declare void @llvm.prefetch.p0(ptr, i32, i32, i32)")
    rows: list[str] = []
    for lane in every:
        begin = scope.op(f"add i64 {scope.op(f'load i64, ptr {place(scope, places, 8 * lane)}')}, {offset}")
        rows.append(scope.op(f"load {kind}, ptr {place(scope, begin, 0)}, align 8"))
        # the last three arguments: for reading, into the second-level cache, data
        scope.line(f"call void @llvm.prefetch.p0(ptr {place(scope, begin, ahead)}, i32 0, i32 2, i32 1)")
    # exchange the two off-diagonal blocks of each group of 2 by 2 blocks of this size
    for span in (1, 2, 4):
        kept = [k + ROWS - span if k & span else k for k in every]
        for low in (lane for lane in every if not lane & span):
            pair = f"{kind} {rows[low]}, {kind} {rows[low + span]}"
            orders = (kept, [k + span for k in kept])
            rows[low], rows[low + span] = (
                scope.op(f"shufflevector {pair}, <8 x i32> <{', '.join(f'i32 {k}' for k in order)}>")
                for order in orders
            )
    for row in every:
        here = place(scope, target, scope.op(f"mul i64 {stride}, {row}"))
        scope.line(f"store {kind} {rows[row]}, ptr {here}, align 8")
    return NONE


GIVEN: Mapping[str, Operation] = {"store": store, "transpose": transpose}
"""Operations that every kernel has."""
