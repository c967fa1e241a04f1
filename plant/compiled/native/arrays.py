"""Arrays of a kernel: creation, indexing, views, filling, and element-wise computation."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager

from plant.compiled.native.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    ArrayKind,
    KernelError,
    ScalarKind,
    Slice,
    Value,
    double_text,
    is_literal,
)
from plant.compiled.native.operators import convert, strides, truth
from plant.compiled.native.scope import Scope, integer

MOST_ON_STACK = 512
"""Largest number of elements of an array on the stack, if its shape is known."""

WHOLE_AXIS = Value(Slice(), ("", ""))


def element_place(scope: Scope, value: Value, indices: Sequence[str]) -> str:
    """Return the address of an element."""
    offset = "0"
    for index, stride in zip(indices, strides(scope, value), strict=True):
        offset = scope.whole("add", offset, scope.whole("mul", index, stride))
    return scope.op(f"getelementptr inbounds {value.array.element.stored}, ptr {value.parts[0]}, i64 {offset}")


def load(scope: Scope, value: Value, indices: Sequence[str]) -> Value:
    """Return an element."""
    kind = value.array.element
    found = scope.op(f"load {kind.stored}, ptr {element_place(scope, value, indices)}")
    if kind == BOOL:
        return Value(BOOL, (scope.op(f"icmp ne i8 {found}, 0"),))
    if kind == COMPLEX:
        return Value(COMPLEX, tuple(scope.op(f"extractvalue {kind.stored} {found}, {part}") for part in (0, 1)))
    return Value(kind, (found,))


def store(scope: Scope, value: Value, indices: Sequence[str], element: Value) -> None:
    """Change an element."""
    kind = value.array.element
    if kind == BOOL:
        part = scope.op(f"zext i1 {truth(scope, element)} to i8")
    elif kind == COMPLEX:
        real, imaginary = convert(scope, element, kind).parts
        half = scope.op(f"insertvalue {kind.stored} undef, double {real}, 0")
        part = scope.op(f"insertvalue {kind.stored} {half}, double {imaginary}, 1")
    else:
        part = convert(scope, element, kind).parts[0]
    scope.line(f"store {kind.stored} {part}, ptr {element_place(scope, value, indices)}")
    scope.written |= value.origin


def new_array(scope: Scope, element: ScalarKind, lengths: Sequence[str], *, zero: bool) -> Value:
    """Return a new array."""
    kind = ArrayKind(element, len(lengths))
    count = "1"
    for length in lengths:
        count = scope.whole("mul", count, length)
    size = scope.whole("mul", count, str(element.size))
    known = is_literal(count) and int(count) <= MOST_ON_STACK
    if known and not scope.depth and not scope.heap:
        place = f"%{scope.fresh('array.')}"
        scope.begin.append(f"{place} = alloca [{count} x {element.stored}], align 64")
    else:
        scope.program.declare("declare noalias ptr @malloc(i64)")
        place = _heap_memory(scope, size)
    if zero:
        scope.program.declare("declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)")
        scope.line(f"call void @llvm.memset.p0.i64(ptr align 16 {place}, i8 0, i64 {size}, i1 false)")
    return Value(kind, (place, *lengths))


def _heap_memory(scope: Scope, size: str) -> str:
    """Return memory that is freed when the function ends: its first 16 bytes link it to the previous allocation."""
    scope.keeps = True
    block = scope.op(f"call noalias ptr @malloc(i64 {scope.whole('add', size, '16')})")
    before = scope.op(f"load ptr, ptr {scope.owner}")
    scope.line(f"store ptr {before}, ptr {block}")
    scope.line(f"store ptr {block}, ptr {scope.owner}")
    return scope.op(f"getelementptr inbounds i8, ptr {block}, i64 16")


def indexed(scope: Scope, value: Value, items: Sequence[Value]) -> Value:
    """Return an element, or a view if some axes have no index."""
    rank = value.array.rank
    if len(items) > rank:
        raise KernelError(f"{len(items)} indices of an {value.array.name}")
    if len(items) == rank and all(item.kind == INT for item in items):
        return load(scope, value, [nonnegative_index(scope, value, *place) for place in enumerate(items)])
    return view(scope, value, items)


def nonnegative_index(scope: Scope, value: Value, axis: int, item: Value) -> str:
    """Return an index; one that is known to be negative counts from the end."""
    part = integer(item)
    return scope.whole("add", value.lengths[axis], part) if is_literal(part) and int(part) < 0 else part


def view(scope: Scope, value: Value, items: Sequence[Value]) -> Value:
    """Return a view of an array."""
    items = [*items, *[WHOLE_AXIS] * (value.array.rank - len(items))]
    offset, lengths, steps = "0", list[str](), list[str]()
    packed, sliced = value.array.packed, False
    for axis, (item, stride) in enumerate(zip(items, strides(scope, value), strict=True)):
        if item.kind == INT:
            offset = scope.whole("add", offset, scope.whole("mul", nonnegative_index(scope, value, axis, item), stride))
            packed = packed and not sliced
            continue
        if not isinstance(item.kind, Slice):
            raise KernelError(f"an index is a whole number or a slice, got {item.kind.name}")
        begin, end = _slice_bounds(scope, value.lengths[axis], item)
        packed = packed and not (sliced and item is not WHOLE_AXIS and item.parts != ("", ""))
        sliced = True
        offset = scope.whole("add", offset, scope.whole("mul", begin, stride))
        lengths.append(scope.whole("sub", end, begin))
        steps.append(stride)
    place = scope.op(f"getelementptr inbounds {value.array.element.stored}, ptr {value.parts[0]}, i64 {offset}")
    parts = (place, *lengths, *([] if packed else steps))
    return Value(ArrayKind(value.array.element, len(lengths), packed), parts, value.origin)


def _slice_bounds(scope: Scope, length: str, item: Value) -> tuple[str, str]:
    """Return the start and end of a slice; it ends at the end of its axis at the latest."""
    begin, end = item.parts
    begin = begin or "0"
    if is_literal(begin) and int(begin) < 0:
        begin = scope.whole("add", length, begin)
    if not end:
        return begin, length
    if is_literal(end) and int(end) < 0:
        return begin, scope.whole("add", length, end)
    beyond = scope.op(f"icmp sgt i64 {end}, {length}")
    end = scope.op(f"select i1 {beyond}, i64 {length}, i64 {end}")
    empty = scope.op(f"icmp slt i64 {end}, {begin}")
    return begin, scope.op(f"select i1 {empty}, i64 {begin}, i64 {end}")


def transposed(scope: Scope, value: Value) -> Value:
    """Return an array with its axes in reverse order."""
    kind = value.array
    if kind.rank == 1:
        return value
    turned = (*reversed(value.lengths), *reversed(strides(scope, value)))
    return Value(ArrayKind(kind.element, kind.rank, packed=False), (value.parts[0], *turned), value.origin)


@contextmanager
def element_loops(scope: Scope, lengths: Sequence[str]) -> Generator[list[str]]:
    """Write loops over all elements; the block receives the indices."""
    if not lengths:
        yield []
        return
    with scope.counting("0", lengths[0]) as first, element_loops(scope, lengths[1:]) as others:
        yield [first, *others]


def map_elements(
    scope: Scope, element: ScalarKind, operands: Sequence[Value], of: Callable[[Sequence[Value]], Value]
) -> Value:
    """Return a new array, computed element by element from the operands; a number serves every element."""
    shape = next(value for value in operands if isinstance(value.kind, ArrayKind)).lengths
    result = new_array(scope, element, shape, zero=False)
    with element_loops(scope, shape) as indices:
        given = [load(scope, one, indices) if isinstance(one.kind, ArrayKind) else one for one in operands]
        store(scope, result, indices, of(given))
    return result


def fill(scope: Scope, target: Value, source: Value) -> None:
    """Set every element of an array to a number, or to the corresponding element of another array."""
    with element_loops(scope, target.lengths) as indices:
        store(scope, target, indices, load(scope, source, indices) if isinstance(source.kind, ArrayKind) else source)


def contiguous_copy(scope: Scope, value: Value) -> Value:
    """Return a contiguous copy."""
    result = new_array(scope, value.array.element, value.lengths, zero=False)
    fill(scope, result, value)
    return result


def eye(scope: Scope, length: str) -> Value:
    """Return an identity matrix."""
    result = new_array(scope, FLOAT, [length, length], zero=True)
    with scope.counting("0", length) as index:
        store(scope, result, [index, index], Value(FLOAT, (double_text(1.0),)))
    return result


def address(scope: Scope, value: Value) -> Value:
    """Return an array's address as an integer."""
    scope.written |= value.origin
    return Value(INT, (scope.op(f"ptrtoint ptr {value.parts[0]} to i64"),))


def size(scope: Scope, value: Value) -> Value:
    """Return the number of elements of an array."""
    count = "1"
    for length in value.lengths:
        count = scope.whole("mul", count, length)
    return Value(INT, (count,))


def shape_of(items: Sequence[Value]) -> list[str]:
    """Return lengths from integers."""
    return [integer(item) for item in items]


def tuple_as_array(scope: Scope, value: Value) -> Value:
    """Return a tuple of numbers as an array, so that its items can be indexed; for a parameter, only once."""
    if value.parts in scope.spilled:
        return scope.spilled[value.parts]
    items = [convert(scope, item, FLOAT).parts[0] for item in value.items]
    place = f"%{scope.fresh('items.')}"
    scope.begin.append(f"{place} = alloca [{len(items)} x double], align 64")
    result = Value(ArrayKind(FLOAT, 1), (place, str(len(items))))
    lasting = all(item.startswith("%in.") for item in items)
    for k, item in enumerate(items):
        here = f"%{scope.fresh('item.')}"
        lines = (f"{here} = getelementptr double, ptr {place}, i64 {k}", f"store double {item}, ptr {here}")
        (scope.begin if lasting else scope.body).extend(lines)
    if lasting:
        scope.spilled[value.parts] = result
    return result
