"""Expressions of a kernel: names, numbers, operators, comparisons, choices, elements, attributes."""

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

from plant.compiled.native import arrays
from plant.compiled.native.calls import call
from plant.compiled.native.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    ArrayKind,
    KernelError,
    Slice,
    TupleKind,
    Value,
    common_kind,
    is_literal,
    number,
    tuple_value,
)
from plant.compiled.native.operators import arithmetic, comparison, convert, negative, select_value, truth
from plant.compiled.native.scope import Scope, integer

CONSTANTS = {"inf": math.inf, "nan": math.nan, "pi": math.pi, "e": math.e}


def read(scope: Scope, node: ast.expr) -> Value:
    """Write an expression and return its value.

    Raises
    ------
    KernelError
        If the expression, or its operation on these kinds of values, is not supported.
    """
    writer = _WRITERS.get(type(node))
    if writer is None:
        raise KernelError(f"{type(node).__name__} is not compiled")
    return writer(scope, node)


def _constant(scope: Scope, node: ast.Constant) -> Value:  # noqa: ARG001  all take a scope
    return number(node.value)


def _name(scope: Scope, node: ast.Name) -> Value:
    return scope.read(node.id)


def _binary(scope: Scope, node: ast.BinOp) -> Value:
    return operator_result(scope, node.op, read(scope, node.left), read(scope, node.right))


def operator_result(scope: Scope, operator: ast.operator, a: Value, b: Value) -> Value:
    """Return the result of an operator on numbers, or on arrays element by element."""
    if isinstance(a.kind, TupleKind) and isinstance(b.kind, TupleKind) and isinstance(operator, ast.Add):
        return tuple_value([*a.items, *b.items])
    if not isinstance(a.kind, ArrayKind) and not isinstance(b.kind, ArrayKind):
        return arithmetic(scope, operator, a, b)
    elements = [one.kind.element if isinstance(one.kind, ArrayKind) else one.kind for one in (a, b)]
    kind = COMPLEX if COMPLEX in elements else INT if elements == [INT, INT] else FLOAT
    if isinstance(operator, ast.Div) and kind == INT:
        kind = FLOAT
    return arrays.map_elements(scope, kind, (a, b), lambda given: arithmetic(scope, operator, *given))


def _unary(scope: Scope, node: ast.UnaryOp) -> Value:
    value = read(scope, node.operand)
    if isinstance(node.op, ast.Not):
        return Value(BOOL, (scope.op(f"xor i1 {truth(scope, value)}, true"),))
    if isinstance(node.op, ast.USub) and isinstance(value.kind, ArrayKind):
        return arrays.map_elements(scope, value.kind.element, (value,), lambda given: negative(scope, given[0]))
    if isinstance(node.op, ast.USub):
        return negative(scope, value)
    if isinstance(node.op, ast.UAdd):
        return value
    raise KernelError(f"{type(node.op).__name__} is not compiled")


def _compare(scope: Scope, node: ast.Compare) -> Value:
    values = [read(scope, part) for part in (node.left, *node.comparators)]
    found = [comparison(scope, how, *pair) for how, pair in zip(node.ops, pairwise(values), strict=True)]
    result = found[0]
    for one in found[1:]:
        result = scope.op(f"and i1 {result}, {one}")
    return Value(BOOL, (result,))


def _logical(scope: Scope, node: ast.BoolOp) -> Value:
    """Write ``and`` and ``or``: the second operand is evaluated only if the first does not decide."""
    both = isinstance(node.op, ast.And)
    place, done = scope.room("i1"), scope.fresh("decided")
    outside = scope.known
    for k, part in enumerate(node.values):
        value = truth(scope, read(scope, part))
        if k == 0:
            outside = dict(scope.known)
        scope.line(f"store i1 {value}, ptr {place}")
        if k == len(node.values) - 1:
            break
        onward = scope.fresh("onward")
        scope.branch(value, *((onward, done) if both else (done, onward)))
        scope.label(onward)
    scope.jump(done)
    scope.label(done)
    scope.known = outside
    return Value(BOOL, (scope.op(f"load i1, ptr {place}"),))


def _conditional(scope: Scope, node: ast.IfExp) -> Value:
    condition = truth(scope, read(scope, node.test))
    if all(_plain(part) for part in (node.body, node.orelse)):
        return select_value(scope, condition, *_to_common_kind(scope, read(scope, node.body), read(scope, node.orelse)))
    yes, no, done = (scope.fresh(name) for name in ("yes", "no", "chosen"))
    outside = dict(scope.known)
    scope.branch(condition, yes, no)
    ends: list[tuple[Value, int]] = []
    for label, part in ((yes, node.body), (no, node.orelse)):
        scope.label(label)
        scope.known = dict(outside)
        ends.append((read(scope, part), len(scope.body)))
        scope.jump(done)
    return _branch_value(scope, ends, done, outside)


def _branch_value(scope: Scope, ends: Sequence[tuple[Value, int]], done: str, outside: dict[str, Value]) -> Value:
    """Return the value of either branch; each branch stores its own before its jump."""
    kind = common_kind("a choice", ends[0][0].kind, ends[1][0].kind)
    places = [scope.room(part) for part in kind.parts]
    for value, at in reversed(ends):
        tail = scope.body[at:]
        del scope.body[at:]
        for part, place, register in zip(kind.parts, places, convert(scope, value, kind).parts, strict=True):
            scope.line(f"store {part} {register}, ptr {place}")
        scope.body += tail
    scope.label(done)
    scope.known = outside
    loaded = tuple(scope.op(f"load {part}, ptr {place}") for part, place in zip(kind.parts, places, strict=True))
    return Value(kind, loaded, ends[0][0].origin | ends[1][0].origin)


def _plain(node: ast.expr) -> bool:
    """Return whether an expression can always be computed safely: it reads no memory and calls nothing."""
    looked = (ast.Subscript, ast.Call, ast.FloorDiv, ast.Mod, ast.IfExp, ast.BoolOp, ast.Attribute)
    return not any(isinstance(part, looked) and not _known_attribute(part) for part in ast.walk(node))


def _known_attribute(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ("math", "np")


def _to_common_kind(scope: Scope, a: Value, b: Value) -> tuple[Value, Value]:
    kind = common_kind("a choice", a.kind, b.kind)
    return convert(scope, a, kind), convert(scope, b, kind)


def _tuple(scope: Scope, node: ast.Tuple) -> Value:
    found: list[Value] = []
    for part in node.elts:
        if isinstance(part, ast.Starred):
            found += read(scope, part.value).items
        else:
            found.append(read(scope, part))
    return tuple_value(found)


def _slice(scope: Scope, node: ast.Slice) -> Value:
    if node.step is not None:
        raise KernelError("a slice with a step is not compiled")
    ends = (integer(read(scope, part)) if part is not None else "" for part in (node.lower, node.upper))
    return Value(Slice(), tuple(ends))


def _subscript(scope: Scope, node: ast.Subscript) -> Value:
    value, items = place_of(scope, node)
    if isinstance(value.kind, TupleKind):
        return _item(scope, value, items[0])
    return arrays.indexed(scope, value, items)


def _item(scope: Scope, value: Value, index: Value) -> Value:
    """Return an item of a tuple; if the index is not known, the item is a number."""
    part = integer(index)
    if is_literal(part):
        return value.items[int(part)]
    return arrays.load(scope, arrays.tuple_as_array(scope, value), [part])


def place_of(scope: Scope, node: ast.Subscript) -> tuple[Value, list[Value]]:
    """Return the indexed value, and the indices."""
    value = read(scope, node.value)
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    return value, [read(scope, part) for part in parts]


def _attribute(scope: Scope, node: ast.Attribute) -> Value:
    if _known_attribute(node):
        if node.attr not in CONSTANTS:
            raise KernelError(f"{node.attr} is no number that is compiled")
        return number(CONSTANTS[node.attr])
    if node.attr == "data" and isinstance(node.value, ast.Attribute) and node.value.attr == "ctypes":
        return arrays.address(scope, read(scope, node.value.value))
    value = read(scope, node.value)
    match node.attr:
        case "size":
            return arrays.size(scope, value)
        case "shape":
            return tuple_value([Value(INT, (length,)) for length in value.lengths])
        case "T":
            return arrays.transposed(scope, value)
        case name if isinstance(value.kind, TupleKind) and name in value.kind.names:
            return value.items[value.kind.names.index(name)]
        case "real" | "imag" if value.kind == COMPLEX:
            return Value(FLOAT, (value.parts[node.attr == "imag"],))
        case _:
            raise KernelError(f"{node.attr} of {value.kind.name} is not compiled")


def _call(scope: Scope, node: ast.Call) -> Value:
    if any(keyword.arg != "dtype" for keyword in node.keywords):
        raise KernelError("arguments are given by place")
    return call(scope, node, read)


_WRITERS: Mapping[type[ast.expr], Callable[..., Value]] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.Compare: _compare,
    ast.BoolOp: _logical,
    ast.IfExp: _conditional,
    ast.Tuple: _tuple,
    ast.Slice: _slice,
    ast.Subscript: _subscript,
    ast.Attribute: _attribute,
    ast.Call: _call,
}
