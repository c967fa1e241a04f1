"""Expressions of a translated function."""

import ast
from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

from plant.compiled.c99.shapes import Block, Scalar, Thing, flat_parameters

if TYPE_CHECKING:
    from plant.compiled.c99.loops import Translation

OPERATORS: Mapping[type[ast.operator], tuple[str, str]] = {
    ast.Add: ("+", "additions"),
    ast.Sub: ("-", "additions"),
    ast.Mult: ("*", "products"),
    ast.Div: ("/", "divisions"),
}
"""Spelling in C of each operation, and the category in which it is counted."""

COMPARED: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
FUNCTIONS = {"exp": "calls of exp, log, tanh", "log": "calls of exp, log, tanh", "sqrt": "square roots"}
NUMBERS = {"inf": "INFINITY", "nan": "NAN"}


def untranslated_error(node: ast.AST) -> NotImplementedError:
    """Return the error for code that is not translated."""
    return NotImplementedError(f"{ast.unparse(node)} is none of what is translated to C")


class Values:
    """Writes the expressions of one function, and counts their operations.

    Parameters
    ----------
    owner : Translation
        The translation to which the function belongs.
    names : dict[str, Thing]
        Its names [any unit].
    """

    def __init__(self, owner: "Translation", names: dict[str, Thing]) -> None:
        self.owner, self.names, self.depth = owner, names, 0
        self.written: set[str] = set()
        self.counted = Counter[str]()

    def thing(self, node: ast.expr) -> Thing:
        """Return the number, array or tuple that an expression represents."""
        match node:
            case ast.Name(id=name) if name in self.names:
                return self.names[name]
            case ast.Name(id=name) if name in self.owner.constants:
                return Scalar(str(self.owner.constants[name]), True)
            case ast.Constant(value=bool()):
                raise untranslated_error(node)
            case ast.Constant(value=int() as value):
                return Scalar(str(value), True)
            case ast.Constant(value=float() as value):
                return Scalar(self.owner.precision.literal(value))
            case ast.Attribute(value=ast.Name(id="np"), attr=("inf" | "nan") as name):
                return Scalar(f"(({self.owner.precision.name}){NUMBERS[name]})")
            case ast.Attribute(value=ast.Name(id="math"), attr="pi"):
                return Scalar(self.owner.precision.literal(3.141592653589793))
            case ast.Subscript(value=ast.Attribute(value=array, attr="shape"), slice=ast.Constant(value=int() as axis)):
                return Scalar(str(self._block(array).shape[axis]), True)
            case ast.Subscript(value=array, slice=ast.Slice(lower=None, upper=None, step=None)):
                return self._block(array)
            case ast.Subscript(value=array, slice=place):
                places = place.elts if isinstance(place, ast.Tuple) else [place]
                return self._block(array).at([self.thing_text(one) for one in places])
            case ast.Tuple(elts=parts):
                return tuple(self.thing(part) for part in parts)
            case _:
                return self._arithmetic(node)

    def _arithmetic(self, node: ast.expr) -> Scalar:
        match node:
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = self.scalar(operand)
                return Scalar(f"(-{inner.text})", inner.whole)
            case ast.BinOp(left=left, op=ast.Pow(), right=ast.Constant(value=2)):
                inner = self.scalar(left)
                self.counted["products"] += 1
                return Scalar(f"({inner.text} * {inner.text})", inner.whole)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in OPERATORS:
                sign, kind = OPERATORS[type(operator)]
                a, b = self.scalar(left), self.scalar(right)
                if a.whole and b.whole:
                    if sign == "/":
                        raise untranslated_error(node)
                    return Scalar(f"({a.text} {sign} {b.text})", True)
                self.counted[kind] += 1
                return Scalar(f"({a.text} {sign} {b.text})")
            case ast.IfExp(test=test, body=body, orelse=orelse):
                condition, a, b = self.truth(test), self.scalar(body), self.scalar(orelse)
                return Scalar(f"({condition} ? {a.text} : {b.text})", a.whole and b.whole)
            case ast.Call(func=ast.Attribute(value=ast.Name(id="math"), attr=name), args=[value]) if name in FUNCTIONS:
                self.counted[FUNCTIONS[name]] += 1
                return Scalar(f"{self.owner.precision.function(name)}({self.thing_text(value)})")
            case ast.Call(func=ast.Name(id="float"), args=[value]):
                return Scalar(f"(({self.owner.precision.name}){self.thing_text(value)})")
            case ast.Call():
                return Scalar(self.call(node))
            case _:
                raise untranslated_error(node)

    def truth(self, node: ast.expr) -> str:
        """Return a condition."""
        match node:
            case ast.Compare(left=ast.Name(id=a), ops=[ast.Eq()], comparators=[ast.Name(id=b)]) if a == b:
                return f"!isnan({self.thing_text(node.left)})"
            case ast.Compare(left=left, ops=[ast.Eq()], comparators=[right]) if ast.unparse(left) == ast.unparse(right):
                return f"!isnan({self.thing_text(left)})"
            case ast.Compare(left=left, ops=[operator], comparators=[right]) if type(operator) in COMPARED:
                self.counted["choices and comparisons"] += 1
                return f"{self.thing_text(left)} {COMPARED[type(operator)]} {self.thing_text(right)}"
            case ast.BoolOp(op=operator, values=values):
                joined = " && " if isinstance(operator, ast.And) else " || "
                return joined.join(f"({self.truth(value)})" for value in values)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"!({self.truth(operand)})"
            case ast.Call(func=ast.Attribute(value=ast.Name(id="math"), attr="isfinite"), args=[value]):
                return f"isfinite({self.thing_text(value)})"
            case _:
                return f"{self.scalar(node).text} != 0"

    def call(self, node: ast.Call, behind: "list[str] | None" = None) -> str:
        """Return a call of a function that is translated, or that already exists in C."""
        if not isinstance(node.func, ast.Name):
            raise untranslated_error(node)
        name, given = node.func.id, [self.thing(one) for one in node.args]
        flat = [one for thing in given for _, one in flat_parameters("", thing)]
        if name in self.owner.outside:
            called = self.owner.outside[name]
        elif name in self.owner.functions:
            called = self.owner.translate(name, given)
        else:
            raise untranslated_error(node)
        self.counted.update(called.operations)
        for one, written in zip(flat, called.written, strict=True):
            if written and isinstance(one, Block):
                self.written.add(one.root)
        return f"{called.name}({', '.join([*(one.text for one in flat), *(behind or [])])})"

    def scalar(self, node: ast.expr) -> Scalar:
        """Return an expression that must be a number."""
        found = self.thing(node)
        if not isinstance(found, Scalar):
            raise untranslated_error(node)
        return found

    def thing_text(self, node: ast.expr) -> str:
        """Return a number's C expression."""
        return self.scalar(node).text

    def known_loop_end(self, node: ast.expr) -> int:
        """Return the end of a loop as a number known at translation."""
        text = self.thing_text(node)
        if not text.isdigit():
            raise untranslated_error(node)
        return int(text)

    def _block(self, node: ast.expr) -> Block:
        found = self.thing(node)
        if not isinstance(found, Block):
            raise untranslated_error(node)
        return found
