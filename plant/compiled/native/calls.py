"""Calls in a kernel: functions of Python, `math` and NumPy, and functions of the kernel itself."""

import ast
from collections.abc import Callable, Mapping, Sequence

from plant.compiled.native import arrays
from plant.compiled.native.kinds import (
    BOOL,
    COMPLEX,
    FLOAT,
    INT,
    SCALARS,
    ArrayKind,
    KernelError,
    Range,
    ScalarKind,
    Slice,
    Value,
    common_kind,
)
from plant.compiled.native.operators import comparison, convert, negative, select_value, truth
from plant.compiled.native.scope import Scope, integer

Read = Callable[[Scope, ast.expr], Value]

INSTRUCTIONS: Mapping[str, str] = {
    "sqrt": "llvm.sqrt.f64",
    "exp": "llvm.exp.f64",
    "log": "llvm.log.f64",
    "sin": "llvm.sin.f64",
    "cos": "llvm.cos.f64",
    "fabs": "llvm.fabs.f64",
    "floor": "llvm.floor.f64",
    "tanh": "tanh",
    "log10": "log10",
    "log1p": "log1p",
    "expm1": "expm1",
    "atan": "atan",
}
"""Functions of one number, and their names in LLVM or the C library."""

DTYPES: Mapping[str, ScalarKind] = {
    **SCALARS,
    "float64": FLOAT,
    "int64": INT,
    "bool_": BOOL,
    "complex128": COMPLEX,
}


def call(scope: Scope, node: ast.Call, read: Read) -> Value:
    """Write a call and return its result.

    Raises
    ------
    KernelError
        If the function is not supported.
    """
    name, module = _function_name(node.func)
    if module == "np" and name in _MAKERS:
        return _MAKERS[name](scope, node, read)
    if module is None and isinstance(node.func, ast.Attribute):
        return _method(scope, node.func, read)
    given = _arguments(scope, node, read)
    if module is None and scope.program.has(name):
        return scope.program.call(name, given, scope)
    if module is None and name in _BUILTINS:
        return _BUILTINS[name](scope, given)
    if module == "math" and name == "copysign":
        size, sign = (f"double {convert(scope, one, FLOAT).parts[0]}" for one in given)
        scope.program.declare("declare double @llvm.copysign.f64(double, double)")
        return Value(FLOAT, (scope.op(f"call double @llvm.copysign.f64({size}, {sign})"),))
    if module is not None and name in _PREDICATES:
        part = convert(scope, given[0], FLOAT).parts[0]
        return Value(BOOL, (scope.op(_PREDICATES[name].format(part)),))
    if module is not None and name in (*INSTRUCTIONS, "abs", "conj", "ascontiguousarray"):
        return _of_array_or_number(scope, name, given[0])
    raise KernelError(f"{ast.unparse(node.func)} is not compiled")


def _function_name(function: ast.expr) -> tuple[str, str | None]:
    match function:
        case ast.Name(id=name):
            return name, None
        case ast.Attribute(value=ast.Name(id=module), attr=name) if module in ("math", "np"):
            return name, module
        case _:
            return ast.unparse(function), None


def _arguments(scope: Scope, node: ast.Call, read: Read) -> list[Value]:
    found: list[Value] = []
    for part in node.args:
        found += read(scope, part.value).items if isinstance(part, ast.Starred) else [read(scope, part)]
    return found


def _method(scope: Scope, function: ast.Attribute, read: Read) -> Value:
    value = read(scope, function.value)
    if function.attr == "copy":
        return arrays.contiguous_copy(scope, value)
    raise KernelError(f"{function.attr} of {value.kind.name} is not compiled")


_PREDICATES = {
    "isnan": "fcmp uno double {0}, {0}",
    "isfinite": "fcmp one double {0}, 0x7FF0000000000000",
}


def _of_array_or_number(scope: Scope, name: str, value: Value) -> Value:
    if name == "ascontiguousarray":
        return value if value.array.packed else arrays.contiguous_copy(scope, value)
    if not isinstance(value.kind, ArrayKind):
        return function_of(scope, name, value)
    element = value.kind.element
    kind = FLOAT if element == INT or name == "abs" else element
    return arrays.map_elements(scope, kind, (value,), lambda given: function_of(scope, name, given[0]))


def function_of(scope: Scope, name: str, value: Value) -> Value:
    """Return a function of one number."""
    if value.kind == COMPLEX:
        return _of_complex(scope, name, value)
    if name == "conj":
        return value
    if name == "abs":
        return _absolute(scope, [value])
    instruction = INSTRUCTIONS[name]
    scope.program.declare(f"declare double @{instruction}(double)")
    part = convert(scope, value, FLOAT).parts[0]
    return Value(FLOAT, (scope.op(f"call {scope.flags}double @{instruction}(double {part})"),))


def _of_complex(scope: Scope, name: str, value: Value) -> Value:
    real, imaginary = (Value(FLOAT, (part,)) for part in value.parts)
    if name == "conj":
        return Value(COMPLEX, (real.parts[0], negative(scope, imaginary).parts[0]))
    if name == "exp":
        turned = [function_of(scope, one, imaginary).parts[0] for one in ("cos", "sin")]
        grown = function_of(scope, "exp", real).parts[0]
        return Value(COMPLEX, tuple(scope.op(f"fmul {scope.flags}double {grown}, {part}") for part in turned))
    raise KernelError(f"{name} of a complex number is not compiled")


def _absolute(scope: Scope, given: Sequence[Value]) -> Value:
    value = given[0]
    if value.kind == INT:
        below = scope.op(f"icmp slt i64 {value.parts[0]}, 0")
        return select_value(scope, below, negative(scope, value), value)
    return function_of(scope, "fabs", value)


def _extreme(how: type[ast.cmpop]) -> Callable[[Scope, Sequence[Value]], Value]:
    def found(scope: Scope, given: Sequence[Value]) -> Value:
        best = given[0]
        for other in given[1:]:
            kind = common_kind("a choice", best.kind, other.kind)
            best, other = (convert(scope, value, kind) for value in (best, other))
            best = select_value(scope, comparison(scope, how(), other, best), other, best)
        return best

    return found


def _int(scope: Scope, given: Sequence[Value]) -> Value:
    if given[0].kind == FLOAT:
        return Value(INT, (scope.op(f"fptosi double {given[0].parts[0]} to i64"),))
    return convert(scope, given[0], INT)


def _length(scope: Scope, given: Sequence[Value]) -> Value:  # noqa: ARG001  all take a scope
    value = given[0]
    return Value(INT, (value.lengths[0] if isinstance(value.kind, ArrayKind) else str(len(value.items)),))


def _slice(scope: Scope, given: Sequence[Value]) -> Value:  # noqa: ARG001  all take a scope
    begin, end = given if len(given) == 2 else (Value(INT, ("0",)), given[0])
    return Value(Slice(), (integer(begin), integer(end)))


def _range(scope: Scope, given: Sequence[Value]) -> Value:
    ends = [integer(convert(scope, one, INT)) for one in given]
    return Value(Range(), ("0", ends[0], "1") if len(ends) == 1 else (*ends, "1")[:3])


_BUILTINS: Mapping[str, Callable[[Scope, Sequence[Value]], Value]] = {
    "abs": _absolute,
    "min": _extreme(ast.Lt),
    "max": _extreme(ast.Gt),
    "float": lambda scope, given: convert(scope, given[0], FLOAT),
    "int": _int,
    "bool": lambda scope, given: Value(BOOL, (truth(scope, given[0]),)),
    "len": _length,
    "slice": _slice,
    "range": _range,
}


def _lengths(scope: Scope, node: ast.expr, read: Read) -> list[str]:
    shape = read(scope, node)
    return arrays.shape_of(shape.items if shape.kind != INT else [shape])


def _new(*, zero: bool) -> Callable[[Scope, ast.Call, Read], Value]:
    def new(scope: Scope, node: ast.Call, read: Read) -> Value:
        chosen = [*node.args[1:], *(keyword.value for keyword in node.keywords)]
        name = "float" if not chosen else ast.unparse(chosen[0]).removeprefix("np.")
        if name not in DTYPES:
            raise KernelError(f"arrays of {name} are not compiled")
        return arrays.new_array(scope, DTYPES[name], _lengths(scope, node.args[0], read), zero=zero)

    return new


def _new_like(*, zero: bool) -> Callable[[Scope, ast.Call, Read], Value]:
    def new(scope: Scope, node: ast.Call, read: Read) -> Value:
        value = read(scope, node.args[0])
        return arrays.new_array(scope, value.array.element, value.lengths, zero=zero)

    return new


def _eye(scope: Scope, node: ast.Call, read: Read) -> Value:
    return arrays.eye(scope, integer(read(scope, node.args[0])))


_MAKERS: Mapping[str, Callable[[Scope, ast.Call, Read], Value]] = {
    "zeros": _new(zero=True),
    "empty": _new(zero=False),
    "zeros_like": _new_like(zero=True),
    "empty_like": _new_like(zero=False),
    "eye": _eye,
}
