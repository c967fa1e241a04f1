"""Straight lines of a kernel as instructions, on one number or on several side by side.

The same lines serve one filter and many side by side, and both give the same bits.
"""

import ast
from collections.abc import Mapping, Sequence

from plant.compiled.native.calls import INSTRUCTIONS
from plant.compiled.native.kinds import KernelError, double_text
from plant.compiled.native.operators import COMPARED, FLOATING
from plant.compiled.native.scope import Scope


def vector(width: int) -> str:
    """Return the LLVM type of a vector of numbers."""
    return "double" if width == 1 else f"<{width} x double>"


class Lines:
    """Writes straight lines: each name is bound once, to a register.

    Parameters
    ----------
    width : int
        Numbers side by side.
    known : Mapping[str, str]
        Registers of the lines' inputs.
    """

    def __init__(self, scope: Scope, width: int, known: Mapping[str, str]) -> None:
        self._scope, self._width, self._known = scope, width, dict(known)
        self._type = vector(width)
        self._truth = "i1" if width == 1 else f"<{width} x i1>"

    def results(self, node: ast.FunctionDef) -> dict[str, str]:
        """Write all lines of a function."""
        for line in node.body:
            match line:
                case ast.Assign(targets=[ast.Name(id=name)], value=value):
                    self._known[name] = self._read(value)
                case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Call(func=ast.Name(id=of)) as packed):
                    columns = [[self._read(part) for part in ast_tuple(one).elts] for one in packed.args]
                    for name, value in zip(names, self._vectorised(of, columns), strict=True):
                        self._known[ast.unparse(name)] = value
                case ast.Return(value=ast.Dict(keys=keys, values=values)):
                    return {str(_constant(key)): self._read(value) for key, value in zip(keys, values, strict=True)}
                case _:
                    raise KernelError(f"{ast.unparse(line)} is none of the lines that are compiled")
        raise KernelError(f"{node.name} returns nothing")

    def _op(self, text: str) -> str:
        return self._scope.op(text)

    def _number(self, value: float) -> str:
        return double_text(value) if self._width == 1 else f"splat (double {double_text(value)})"

    def _read(self, node: ast.expr) -> str:
        match node:
            case ast.Name(id=name):
                return self._known[name]
            case ast.Constant(value=int() | float() as value):
                return self._number(float(value))
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as value)):
                return self._number(-float(value))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._op(f"fneg {self._type} {self._read(operand)}")
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in FLOATING:
                a, b = self._read(left), self._read(right)
                return self._op(f"{FLOATING[type(operator)]} {self._type} {a}, {b}")
            case ast.Compare(left=left, ops=[operator], comparators=[right]):
                a, b = self._read(left), self._read(right)
                return self._op(f"fcmp {COMPARED[type(operator)][0]} {self._type} {a}, {b}")
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._operation(name, [self._read(one) for one in arguments])
            case _:
                raise KernelError(f"{ast.unparse(node)} is none of the operations that are compiled")

    def _operation(self, name: str, given: Sequence[str]) -> str:
        kind = self._type
        match name, given:
            case "present", [x]:
                return self._op(f"fcmp ord {kind} {x}, {x}")
            case "where", [condition, a, b]:
                return self._op(f"select {self._truth} {condition}, {kind} {a}, {kind} {b}")
            case "sign", [x]:
                one = self._instruction("copysign", kind, [self._number(1.0), x])
                apart = self._op(f"fcmp one {kind} {x}, {self._number(0.0)}")
                return self._operation("where", [apart, one, self._number(0.0)])
            case (("fma" | "sqrt" | "abs"), _):
                return self._instruction("fabs" if name == "abs" else name, kind, given)
            case (("exp" | "log" | "tanh" | "sin" | "cos" | "atan"), [x]):
                return self._library_call(name, x)
            case _:
                raise KernelError(f"{name} is none of the operations that are compiled")

    def _instruction(self, name: str, kind: str, given: Sequence[str]) -> str:
        short = "f64" if kind == "double" else f"v{kind[1:].split()[0]}f64"
        self._scope.program.declare(f"declare {kind} @llvm.{name}.{short}({', '.join([kind] * len(given))})")
        return self._op(f"call {kind} @llvm.{name}.{short}({', '.join(f'{kind} {one}' for one in given)})")

    def _library_call(self, name: str, x: str) -> str:
        """Return a function of the C library, applied number by number."""
        function = INSTRUCTIONS["tanh"] if name == "tanh" else name
        self._scope.program.declare(f"declare double @{function}(double)")
        if self._width == 1:
            return self._op(f"call double @{function}(double {x})")
        for place in range(self._width):
            one = self._op(f"extractelement {self._type} {x}, i32 {place}")
            one = self._op(f"call double @{function}(double {one})")
            x = self._op(f"insertelement {self._type} {x}, double {one}, i32 {place}")
        return x

    def _vectorised(self, name: str, columns: Sequence[Sequence[str]]) -> list[str]:
        """Return quotients or roots; those of single numbers are computed by one instruction."""
        if self._width > 1:
            if name == "roots":
                return [self._operation("sqrt", [one]) for one in columns[0]]
            return [self._op(f"fdiv {self._type} {a}, {b}") for a, b in zip(*columns, strict=True)]
        count = len(columns[0])
        wide, given = vector(count), list[str]()
        for column in columns:
            beside = f"splat (double {double_text(1.0)})"
            for place, one in enumerate(column):
                beside = self._op(f"insertelement {wide} {beside}, double {one}, i32 {place}")
            given.append(beside)
        if name == "roots":
            found = self._instruction("sqrt", wide, given)
        else:
            found = self._op(f"fdiv {wide} {given[0]}, {given[1]}")
        return [self._op(f"extractelement {wide} {found}, i32 {place}") for place in range(count)]


def ast_tuple(node: ast.expr) -> ast.Tuple:
    """Return a tuple's node.

    Raises
    ------
    KernelError
        If it is not a tuple.
    """
    if not isinstance(node, ast.Tuple):
        raise KernelError(f"a tuple is wanted, got {ast.unparse(node)}")
    return node


def _constant(node: ast.expr | None) -> object:
    return node.value if isinstance(node, ast.Constant) else None


def names_of(node: ast.FunctionDef) -> list[str]:
    """Return the names of a function's parameters."""
    return [argument.arg for argument in node.args.args]
