"""A function of a kernel during its translation: its instructions, its variables, and what is known of them."""

import ast
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from typing import Protocol

from plant.compiled.native.kinds import BOOL, INT, AnyKind, KernelError, Value, common_kind, is_literal


class Program(Protocol):
    """Interface of a kernel for its functions."""

    constants: dict[str, Value]

    def call(self, name: str, given: Sequence[Value], scope: "Scope") -> Value:
        """Call another function of the kernel."""
        ...

    def declare(self, text: str) -> None:
        """Declare an external function: of the C library, or an operation of the processor."""
        ...

    def separate(self, name: str, parameters: str, body: "Callable[[Scope], None]") -> str:
        """Write a separate function from its instructions, and return its name."""
        ...

    def has(self, name: str) -> bool:
        """Return whether a function or an operation has this name."""
        ...


def family(kind: AnyKind) -> str:
    """Return the permanent kind of a variable: Boolean, number, array, slice or tuple."""
    return type(kind).__name__ + (kind.name if kind == BOOL else "")


@cache
def _assigned_names(node: ast.AST) -> frozenset[str]:
    if isinstance(node, ast.Name):
        return frozenset((node.id,)) if isinstance(node.ctx, ast.Store) else frozenset()
    # cached for each node, because an inner loop is looked at again as a part of its outer loop
    return frozenset().union(*map(_assigned_names, ast.iter_child_nodes(node)))


def assigned_in(nodes: Sequence[ast.AST]) -> set[str]:
    """Return the names that statements assign."""
    return {name for node in nodes for name in _assigned_names(node)}


@dataclass
class Scope:
    """A function during its translation.

    A variable has a place on the stack, which LLVM optimises away. Within straight-line code its value is also known by
    the register that was assigned last, and the place is not read. A name that holds first a Boolean and then a number
    has no place: it may be reused, but not across a branch or a loop.

    Parameters
    ----------
    kinds : dict[str, AnyKind]
        Kinds of variables, as far as an earlier pass has found them.
    origins : dict[str, frozenset of str]
        Likewise, parameters whose memory may contain a variable's array.
    flags : str
        How freely LLVM may rearrange arithmetic.
    owner : str
        Register with the list of the arrays that this function allocates.
    """

    program: Program
    kinds: dict[str, AnyKind]
    origins: dict[str, frozenset[str]]
    flags: str = ""
    owner: str = "%owned"
    known: dict[str, Value] = field(default_factory=dict[str, Value])
    again: bool = False
    ended: bool = False
    depth: int = 0
    heap: bool = False
    keeps: bool = False
    returned: AnyKind | None = None
    loops: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    body: list[str | tuple[str, str]] = field(default_factory=list[str | tuple[str, str]])
    begin: list[str] = field(default_factory=list[str])
    written: frozenset[str] = frozenset()
    origin: frozenset[str] = frozenset()
    spilled: dict[tuple[str, ...], Value] = field(default_factory=dict[tuple[str, ...], Value])
    mixed: set[str] = field(default_factory=set[str])
    _slots: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    _read: set[str] = field(default_factory=set[str])
    _count: int = 0

    def line(self, text: str) -> None:
        """Write an instruction without a result."""
        self.body.append(text)

    def op(self, text: str) -> str:
        """Write an instruction and return the register of its result."""
        self._count += 1
        name = f"%v{self._count}"
        self.body.append(f"{name} = {text}")
        return name

    def fresh(self, name: str) -> str:
        """Return an unused name."""
        self._count += 1
        return f"{name}{self._count}"

    def label(self, name: str) -> None:
        """Begin a block."""
        self.body.append(f"{name}:")
        self.ended = False

    def jump(self, target: str) -> None:
        """Jump to a block, unless the current block has ended."""
        if not self.ended:
            self.line(f"br label %{target}")
            self.ended = True

    def branch(self, condition: str, yes: str, no: str) -> None:
        """Jump to one of two blocks."""
        self.line(f"br i1 {condition}, label %{yes}, label %{no}")
        self.ended = True

    def room(self, kind: str, name: str = "room") -> str:
        """Return a place on the stack."""
        place = f"%{self.fresh(name + '.')}"
        self.begin.append(f"{place} = alloca {kind}, align 16")
        return place

    def assign(self, name: str, value: Value, convert: Callable[["Scope", Value, AnyKind], Value]) -> None:
        """Give a variable a value."""
        if name == "_":
            return
        before = self.kinds.get(name)
        if before is not None and family(before) != family(value.kind):
            self.mixed.add(name)
        if name in self.mixed:
            self.known[name] = value
            return
        kind = common_kind(name, before, value.kind)
        if kind != before:
            self.again = self.again or before is not None
            self.kinds[name] = kind
            self._slots.pop(name, None)
        value = convert(self, value, kind)
        if name not in self._slots:
            self._slots[name] = [self.room(part, name) for part in kind.parts]
        for place, part, register in zip(self._slots[name], kind.parts, value.parts, strict=True):
            self.body.append((place, f"store {part} {register}, ptr {place}"))
        self.known[name] = value
        if not value.origin <= self.origins.get(name, frozenset()):
            self.again = self.again or before is not None
            self.origins[name] = self.origins.get(name, frozenset()) | value.origin

    def read(self, name: str) -> Value:
        """Return a variable's value, or a constant's."""
        if name in self.known:
            return self.known[name]
        if name in self.mixed:
            raise KernelError(f"{name} is once a number, once something else: it needs two names")
        if name in self._slots:
            kind, places = self.kinds[name], self._slots[name]
            self._read.update(places)
            parts = [self.op(f"load {part}, ptr {place}") for part, place in zip(kind.parts, places, strict=True)]
            self.known[name] = Value(kind, tuple(parts), self.origins.get(name, frozenset()))
            return self.known[name]
        if name in self.program.constants:
            return self.program.constants[name]
        raise KernelError(f"{name} is used before it is assigned, and is no constant of the kernel")

    def forget(self, names: set[str]) -> None:
        """Forget the registers of variables and use only their places: a block may be reached from several sides."""
        for name in names:
            self.known.pop(name, None)

    @contextmanager
    def counting(self, begin: str, end: str, step: str = "1", *, forget: set[str] | None = None) -> Generator[str]:
        """Write a loop; the block receives its counter."""
        place, head, body, after, done = (self.fresh(name) for name in ("count.", "head", "body", "next", "done"))
        self.begin.append(f"%{place} = alloca i64")
        self.line(f"store i64 {begin}, ptr %{place}")
        self.forget(forget or set())
        self.jump(head)
        self.label(head)
        counter = self.op(f"load i64, ptr %{place}")
        test = "sgt" if step.startswith("-") else "slt"
        self.branch(self.op(f"icmp {test} i64 {counter}, {end}"), body, done)
        self.label(body)
        self.loops.append((after, done))
        self.depth += 1
        outside = dict(self.known)
        yield counter
        self.depth -= 1
        self.loops.pop()
        self.jump(after)
        self.label(after)
        following = self.op(f"add nsw i64 {counter}, {step}")
        self.line(f"store i64 {following}, ptr %{place}")
        self.jump(head)
        self.label(done)
        self.known = outside
        self.forget(forget or set())

    def whole(self, operation: str, a: str, b: str) -> str:
        """Return a sum, difference or product of integers, computed at once if both are known."""
        if is_literal(a) and is_literal(b):
            return str({"add": int(a) + int(b), "sub": int(a) - int(b), "mul": int(a) * int(b)}[operation])
        if operation == "mul" and "1" in (a, b):
            return b if a == "1" else a
        if operation == "mul" and "0" in (a, b):
            return "0"
        if (operation in ("add", "sub") and b == "0") or (operation == "add" and a == "0"):
            return a if b == "0" else b
        return self.op(f"{operation} nsw i64 {a}, {b}")

    def instructions(self) -> list[str]:
        """Return the instructions, without stores that are never read."""
        read = {*self._read, self.owner} if self.keeps and not self.heap else self._read
        kept = [one if isinstance(one, str) else one[1] for one in self.body if isinstance(one, str) or one[0] in read]
        return [*self.begin, *kept]


def integer(value: Value) -> str:
    """Return the register of an integer.

    Raises
    ------
    KernelError
        If the value is not an integer.
    """
    if value.kind != INT:
        raise KernelError(f"a whole number is wanted, got {value.kind.name}")
    return value.parts[0]
