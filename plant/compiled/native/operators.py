"""Arithmetic of single numbers: conversions, sums and products, comparisons."""

import ast
from collections.abc import Mapping

from plant.compiled.native.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    AnyKind,
    ArrayKind,
    KernelError,
    TupleKind,
    Value,
    double_text,
    is_literal,
    number,
    tuple_value,
)
from plant.compiled.native.scope import Scope

FLOATING: Mapping[type[ast.operator], str] = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
WHOLE: Mapping[type[ast.operator], str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
BITS: Mapping[type[ast.operator], str] = {ast.BitAnd: "and", ast.BitOr: "or", ast.BitXor: "xor"}
COMPARED: Mapping[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("olt", "slt"),
    ast.LtE: ("ole", "sle"),
    ast.Gt: ("ogt", "sgt"),
    ast.GtE: ("oge", "sge"),
    ast.Eq: ("oeq", "eq"),
    ast.NotEq: ("une", "ne"),
}


def convert(scope: Scope, value: Value, kind: AnyKind) -> Value:
    """Return a value converted to a wider kind."""
    if value.kind == kind:
        return value
    match value.kind, kind:
        case ArrayKind(), ArrayKind():
            return Value(kind, (*value.parts, *strides(scope, value)), value.origin)
        case TupleKind(), TupleKind():
            return tuple_value([convert(scope, *pair) for pair in zip(value.items, kind.items, strict=True)])
        case _:
            pass
    part = value.parts[0]
    if kind == FLOAT and value.kind == INT:
        return Value(
            FLOAT, (double_text(float(int(part))) if is_literal(part) else scope.op(f"sitofp i64 {part} to double"),)
        )
    if kind == FLOAT and value.kind == BOOL:
        return Value(FLOAT, (scope.op(f"uitofp i1 {part} to double"),))
    if kind == INT and value.kind == BOOL:
        return Value(INT, (scope.op(f"zext i1 {part} to i64"),))
    if kind == COMPLEX:
        return Value(COMPLEX, (*convert(scope, value, FLOAT).parts, double_text(0.0)))
    raise KernelError(f"{kind.name} is wanted, got {value.kind.name}")


def truth(scope: Scope, value: Value) -> str:
    """Return the register that says whether a value is true."""
    if value.kind == BOOL:
        return value.parts[0]
    if value.kind == INT:
        return scope.op(f"icmp ne i64 {value.parts[0]}, 0")
    return scope.op(f"fcmp une double {convert(scope, value, FLOAT).parts[0]}, {double_text(0.0)}")


def strides(scope: Scope, value: Value) -> list[str]:
    """Return the strides of an array along its axes [elements]."""
    kind = value.array
    if not kind.packed:
        return list(value.parts[1 + kind.rank :])
    found = ["1"]
    for length in reversed(value.lengths[1:]):
        found.insert(0, scope.whole("mul", length, found[0]))
    return found


def _float_operation(scope: Scope, name: str, a: str, b: str) -> str:
    return scope.op(f"{name} {scope.flags}double {a}, {b}")


def arithmetic(scope: Scope, operator: ast.operator, a: Value, b: Value) -> Value:
    """Return the result of an operator on two numbers, as in Python; a division by zero raises no error."""
    kind = type(operator)
    if COMPLEX in (a.kind, b.kind):
        return _complex(scope, kind, a, b)
    if kind is ast.Pow:
        return power(scope, a, b)
    if kind in (ast.FloorDiv, ast.Mod) and FLOAT not in (a.kind, b.kind):
        x, y = (convert(scope, value, INT).parts[0] for value in (a, b))
        return Value(INT, (_integer_division(scope, x, y, rest=kind is ast.Mod),))
    if kind in BITS and a.kind == b.kind and a.kind in (BOOL, INT):
        return Value(a.kind, (scope.op(f"{BITS[kind]} {a.kind.parts[0]} {a.parts[0]}, {b.parts[0]}"),))
    if kind in FLOATING and (kind is ast.Div or FLOAT in (a.kind, b.kind)):
        x, y = (convert(scope, value, FLOAT).parts[0] for value in (a, b))
        return Value(FLOAT, (_float_operation(scope, FLOATING[kind], x, y),))
    if kind in WHOLE:
        x, y = (convert(scope, value, INT).parts[0] for value in (a, b))
        return Value(INT, (scope.whole(WHOLE[kind], x, y),))
    raise KernelError(f"{kind.__name__} of {a.kind.name} and {b.kind.name} is not compiled")


def _integer_division(scope: Scope, a: str, b: str, *, rest: bool) -> str:
    """Return quotient or remainder of integers, rounded down; zero for a division by zero, which would trap."""
    if is_literal(a) and is_literal(b) and int(b) != 0:
        return str(int(a) % int(b) if rest else int(a) // int(b))
    none = "false"
    if not is_literal(b) or int(b) == 0:
        none = scope.op(f"icmp eq i64 {b}, 0")
        b = scope.op(f"select i1 {none}, i64 1, i64 {b}")
    quotient, left = scope.op(f"sdiv i64 {a}, {b}"), scope.op(f"srem i64 {a}, {b}")
    apart = scope.op(f"icmp slt i64 {scope.op(f'xor i64 {left}, {b}')}, 0")
    below = scope.op(f"and i1 {apart}, {scope.op(f'icmp ne i64 {left}, 0')}")
    if rest:
        found = scope.op(f"select i1 {below}, i64 {scope.op(f'add i64 {left}, {b}')}, i64 {left}")
    else:
        found = scope.op(f"sub i64 {quotient}, {scope.op(f'zext i1 {below} to i64')}")
    return found if none == "false" else scope.op(f"select i1 {none}, i64 0, i64 {found}")


def power(scope: Scope, base: Value, exponent: Value) -> Value:
    """Return a power: a known integer power by products; a power of one half not by a root, to round as Python does."""
    part = exponent.parts[0]
    if exponent.kind == INT and is_literal(part) and int(part) >= 0:
        result, square, left = number(1) if base.kind == INT else number(1.0), base, int(part)
        first = True
        while left:
            if left & 1:
                result = square if first else arithmetic(scope, ast.Mult(), result, square)
                first = False
            left >>= 1
            square = arithmetic(scope, ast.Mult(), square, square) if left else square
        return result
    scope.program.declare("declare double @llvm.pow.f64(double, double)")
    x, y = (convert(scope, value, FLOAT).parts[0] for value in (base, exponent))
    return Value(FLOAT, (scope.op(f"call {scope.flags}double @llvm.pow.f64(double {x}, double {y})"),))


def _complex(scope: Scope, kind: type[ast.operator], a: Value, b: Value) -> Value:
    """Return a sum, difference or product, of which one number may be real; or a quotient by a real number."""
    if kind in (ast.Add, ast.Sub):
        pairs = zip(*(convert(scope, value, COMPLEX).parts for value in (a, b)), strict=True)
        return Value(COMPLEX, tuple(_float_operation(scope, FLOATING[kind], x, y) for x, y in pairs))
    if kind is ast.Mult and a.kind == b.kind:
        (p, q), (r, s) = a.parts, b.parts
        products = [_float_operation(scope, "fmul", x, y) for x, y in ((p, r), (q, s), (p, s), (q, r))]
        return Value(
            COMPLEX, (_float_operation(scope, "fsub", *products[:2]), _float_operation(scope, "fadd", *products[2:]))
        )
    if kind is ast.Mult and a.kind != COMPLEX:
        a, b = b, a
    if kind in (ast.Mult, ast.Div) and b.kind != COMPLEX:
        factor = convert(scope, b, FLOAT).parts[0]
        return Value(COMPLEX, tuple(_float_operation(scope, FLOATING[kind], part, factor) for part in a.parts))
    raise KernelError(f"{kind.__name__} of {a.kind.name} and {b.kind.name} is not compiled")


def negative(scope: Scope, value: Value) -> Value:
    """Return a number with the opposite sign."""
    if value.kind == COMPLEX:
        return Value(COMPLEX, tuple(scope.op(f"fneg {scope.flags}double {part}") for part in value.parts))
    if value.kind == FLOAT:
        part = value.parts[0]
        if part.startswith("0x"):
            return Value(FLOAT, (f"0x{int(part, 16) ^ 1 << 63:016X}",))
        return Value(FLOAT, (scope.op(f"fneg {scope.flags}double {part}"),))
    part = convert(scope, value, INT).parts[0]
    return Value(INT, (scope.whole("sub", "0", part),))


def comparison(scope: Scope, operator: ast.cmpop, a: Value, b: Value) -> str:
    """Return the register with the result of a comparison of two numbers."""
    floating, whole = COMPARED[type(operator)]
    if FLOAT in (a.kind, b.kind):
        x, y = (convert(scope, value, FLOAT).parts[0] for value in (a, b))
        return scope.op(f"fcmp {scope.flags}{floating} double {x}, {y}")
    x, y = (convert(scope, value, INT).parts[0] for value in (a, b))
    return scope.op(f"icmp {whole} i64 {x}, {y}")


def select_value(scope: Scope, condition: str, a: Value, b: Value) -> Value:
    """Return one of two values of the same kind."""
    pairs = zip(a.kind.parts, a.parts, b.parts, strict=True)
    return Value(a.kind, tuple(scope.op(f"select i1 {condition}, {t} {x}, {t} {y}") for t, x, y in pairs))
