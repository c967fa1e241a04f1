"""A kernel's text as LLVM's intermediate representation: its entry functions, and all functions that they call."""

import ast
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from plant.compiled.native.kinds import (
    NOTHING,
    AnyKind,
    ArrayKind,
    KernelError,
    TupleKind,
    Value,
    number,
    structure,
    tuple_value,
)
from plant.compiled.native.lines import names_of
from plant.compiled.native.operations import GIVEN, Operation, operation_of
from plant.compiled.native.operators import convert
from plant.compiled.native.scope import Scope
from plant.compiled.native.statements import NOTHING_VALUE, return_value, write

MOST_PASSES = 20

RELEASE = """
declare noalias ptr @malloc(i64)
declare void @free(ptr)
define void @release(ptr %list) {
start:
  %first = load ptr, ptr %list
  br label %head
head:
  %block = phi ptr [ %first, %start ], [ %next, %body ]
  %end = icmp eq ptr %block, null
  br i1 %end, label %done, label %body
body:
  %next = load ptr, ptr %block
  call void @free(ptr %block)
  br label %head
done:
  store ptr null, ptr %list
  ret void
}
"""
"""Frees a list of arrays."""


@dataclass(frozen=True)
class CompiledFunction:
    """A function that has been written.

    Parameters
    ----------
    symbol : str
        Its name in the object.
    returns : AnyKind
        What it returns.
    written : frozenset of str
        Parameters whose arrays it changes.
    origin : frozenset of str
        Parameters whose memory may contain an array that it returns.
    lends : bool
        Whether it returns arrays that it allocates and its caller frees.
    """

    symbol: str
    returns: AnyKind
    written: frozenset[str]
    origin: frozenset[str]
    lends: bool


def _has_array(kind: AnyKind) -> bool:
    return isinstance(kind, ArrayKind) or (isinstance(kind, TupleKind) and any(map(_has_array, kind.items)))


@dataclass
class Module:
    """A kernel during its translation.

    Parameters
    ----------
    text : str
        Its source: functions, constants, and operations made of lines.
    """

    text: str
    constants: dict[str, Value] = field(default_factory=dict[str, Value])
    plain: dict[str, object] = field(default_factory=dict[str, object])
    _functions: dict[str, ast.FunctionDef] = field(default_factory=dict[str, ast.FunctionDef])
    _operations: dict[str, Operation] = field(default_factory=dict[str, Operation])
    _made: dict[tuple[str, tuple[AnyKind, ...], bool], CompiledFunction] = field(
        default_factory=dict[tuple[str, tuple[AnyKind, ...], bool], CompiledFunction]
    )
    _declared: dict[str, None] = field(default_factory=dict[str, None])
    _texts: list[str] = field(default_factory=list[str])

    def __post_init__(self) -> None:
        tree = ast.parse(self.text)
        self._functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        self._operations = {**GIVEN}
        for node in tree.body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self._define(node.targets[0].id, node.value)

    def _define(self, name: str, node: ast.expr) -> None:
        if isinstance(node, ast.Call):
            operation = operation_of(node, self._functions, self.plain)
            if operation is not None:
                self._operations[name] = operation
            return
        try:
            value = ast.literal_eval(node)
        except ValueError:
            return
        self.plain[name] = value
        if isinstance(value, int | float | complex | tuple):
            self.constants[name] = number(value)

    def has(self, name: str) -> bool:
        """Return whether a function or an operation has this name."""
        return name in self._operations or name in self._functions

    def declare(self, text: str) -> None:
        """Declare a function of the C library or an operation of the processor."""
        self._declared[text] = None

    def separate(self, name: str, parameters: str, body: Callable[[Scope], None]) -> str:
        """Write a function from its parameters and its instructions, and return its name."""
        symbol = f"{name}.{len(self._texts)}"
        self._texts.append("")
        scope = Scope(self, {}, {})
        body(scope)
        lines = "\n".join(scope.instructions())
        self._texts.append(f"define internal void @{symbol}({parameters}) alwaysinline #0 {{\n{lines}\n}}\n")
        return symbol

    def call(self, name: str, given: Sequence[Value], scope: Scope) -> Value:
        """Write a call of another function, which is translated for the kinds of its arguments."""
        if name in self._operations:
            return self._operations[name](scope, given)
        given = self._with_defaults(name, given)
        kinds = tuple(value.kind for value in given)
        compiled = self.function(name, kinds)
        parts = [
            f"{part} {register}"
            for value in given
            for part, register in zip(value.kind.parts, value.parts, strict=True)
        ]
        if compiled.lends:
            scope.keeps = True
            parts.append(f"ptr {scope.owner}")
        formal = dict(zip(names_of(self._functions[name]), given, strict=True))
        for parameter in compiled.written:
            scope.written |= formal[parameter].origin
        text = f"call {structure(compiled.returns)} @{compiled.symbol}({', '.join(parts)})"
        count = len(compiled.returns.parts)
        if count == 0:
            scope.line(text)
            return NOTHING_VALUE
        found = scope.op(text)
        whole = structure(compiled.returns)
        registers = (
            (found,) if count == 1 else tuple(scope.op(f"extractvalue {whole} {found}, {k}") for k in range(count))
        )
        origin = frozenset[str]().union(*(formal[parameter].origin for parameter in compiled.origin))
        return Value(compiled.returns, registers, origin)

    def _with_defaults(self, name: str, given: Sequence[Value]) -> list[Value]:
        """Return arguments completed with defaults."""
        node = self._functions[name]
        missing = len(node.args.args) - len(given)
        if not 0 <= missing <= len(node.args.defaults):
            raise KernelError(f"{name} takes {len(node.args.args)} arguments, got {len(given)}")
        defaults = node.args.defaults[len(node.args.defaults) - missing :]
        return [*given, *(number(ast.literal_eval(one)) for one in defaults)]

    def function(self, name: str, kinds: tuple[AnyKind, ...], *, enters: bool = False) -> CompiledFunction:
        """Write a function for parameters of these kinds, unless it exists already.

        Parameters
        ----------
        enters : bool
            Whether it is an entry of the kernel, with arrays that do not overlap.
        """
        key = name, kinds, enters
        if key not in self._made:
            try:
                self._made[key] = self._write(self._functions[name], kinds, enters=enters)
            except KernelError as error:
                raise error.within(name) if not error.placed else KernelError(f"{name}, {error}") from None
        return self._made[key]

    def _write(self, node: ast.FunctionDef, kinds: tuple[AnyKind, ...], *, enters: bool) -> CompiledFunction:
        symbol = f"{node.name}.{len(self._made)}.{len(self._texts)}"
        flags, inlined = _hints(node)
        scope = Scope(self, {}, {}, flags)
        formal: list[str] = []
        given: list[tuple[str, Value]] = []
        for name, kind in zip(names_of(node), kinds, strict=True):
            parts = tuple(f"%in.{name}.{k}" for k in range(len(kind.parts)))
            attribute = " noalias" if enters else ""
            formal += [
                f"{part}{attribute if part == 'ptr' else ''} {one}" for part, one in zip(kind.parts, parts, strict=True)
            ]
            given.append((name, Value(kind, parts, frozenset((name,)))))
        for _ in range(MOST_PASSES):
            scope = self._pass(scope, node, given)
            if not scope.again:
                break
        else:
            raise KernelError("the kinds of its variables are not settled")
        returns = scope.returned or NOTHING
        if scope.heap:
            formal.append(f"ptr {scope.owner}")
        begin = (
            []
            if scope.heap or not scope.keeps
            else [f"{scope.owner} = alloca ptr", f"store ptr null, ptr {scope.owner}"]
        )
        lines = "\n".join([*begin, *scope.instructions()])
        attribute = "noinline" if enters else "alwaysinline" if inlined else ""
        self._texts.append(
            f"define internal {structure(returns)} @{symbol}({', '.join(formal)}) {attribute} #0 {{\n{lines}\n}}\n"
        )
        return CompiledFunction(symbol, returns, scope.written, scope.origin, scope.heap)

    def _pass(self, before: Scope, node: ast.FunctionDef, given: list[tuple[str, Value]]) -> Scope:
        """Write a function once, with the kinds of its variables that the previous pass has found."""
        scope = Scope(self, before.kinds, before.origins, before.flags)
        scope.returned, scope.heap, scope.mixed = before.returned, before.heap, before.mixed
        scope.owner = "%lender" if scope.heap else "%owned"
        for name, value in given:
            scope.assign(name, value, convert)
        write(scope, node.body)
        if not scope.ended:
            return_value(scope, NOTHING_VALUE)
        if scope.returned is not None and _has_array(scope.returned) and not scope.heap:
            scope.heap = scope.again = True
        return scope

    def enter(self, name: str, kinds: tuple[AnyKind, ...]) -> CompiledFunction:
        """Write ``name``, to be called with the addresses of its arguments' parts and of memory for its results."""
        compiled = self.function(name, kinds, enters=True)
        if _has_array(compiled.returns) and not _is_packed(compiled.returns):
            raise KernelError(f"{name} returns a view that is not packed")
        scope, parts = Scope(self, {}, {}), list[str]()
        every = tuple_value([Value(kind, tuple(kind.parts)) for kind in kinds]).kind.parts
        for k, part in enumerate(every):
            held = "i64" if part == "i1" else part
            found = scope.op(f"load {held}, ptr {scope.op(f'getelementptr i64, ptr %given, i64 {k}')}")
            parts.append(f"{part} {scope.op(f'icmp ne i64 {found}, 0') if part == 'i1' else found}")
        count = len(compiled.returns.parts)
        if compiled.lends:
            parts.append(f"ptr {scope.op(f'getelementptr i64, ptr %found, i64 {count}')}")
        whole = structure(compiled.returns)
        text = f"call {whole} @{compiled.symbol}({', '.join(parts)})"
        result = scope.op(text) if count else scope.line(text) or ""
        for k, part in enumerate(compiled.returns.parts):
            one = result if count == 1 else scope.op(f"extractvalue {whole} {result}, {k}")
            one, held = (scope.op(f"zext i1 {one} to i64"), "i64") if part == "i1" else (one, part)
            scope.line(f"store {held} {one}, ptr {scope.op(f'getelementptr i64, ptr %found, i64 {k}')}")
        scope.line("ret void")
        lines = "\n".join(scope.instructions())
        self._texts.append(f"define void @{name}(ptr %given, ptr %found) #0 {{\n{lines}\n}}\n")
        return compiled

    def ir(self) -> str:
        """Return the whole kernel."""
        declared = [one for one in self._declared if one not in RELEASE]
        # values that do not fit into registers are stored in whole cache lines
        attributes = "attributes #0 = { nounwind alignstack=64 }\n"
        return "\n".join([*declared, RELEASE, *self._texts, attributes])


def _is_packed(kind: AnyKind) -> bool:
    if isinstance(kind, TupleKind):
        return all(map(_is_packed, kind.items))
    return kind.packed if isinstance(kind, ArrayKind) else True


def _hints(node: ast.FunctionDef) -> tuple[str, bool]:
    """Return the flags by which arithmetic may be rearranged, and whether a function is inlined."""
    flags: set[str] = set()
    inlined = False
    for decorator in node.decorator_list:
        match decorator:
            case ast.Name("inlined"):
                inlined = True
            case ast.Call(ast.Name("freely"), given):
                flags |= {str(ast.literal_eval(one)) for one in given}
            case _:
                raise KernelError(f"the decorator {ast.unparse(decorator)} means nothing here")
    return "".join(f"{flag} " for flag in sorted(flags)), inlined
