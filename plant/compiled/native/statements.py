"""Statements of a kernel: assignments, branches, loops, returns."""

import ast
from collections.abc import Callable, Mapping, Sequence

from plant.compiled.native import arrays
from plant.compiled.native.expressions import operator_result, place_of, read
from plant.compiled.native.kinds import (
    INT,
    NOTHING,
    ArrayKind,
    KernelError,
    Range,
    Value,
    common_kind,
    is_literal,
    structure,
)
from plant.compiled.native.operators import convert, truth
from plant.compiled.native.scope import Scope, assigned_in


def write(scope: Scope, statements: Sequence[ast.stmt]) -> None:
    """Write statements, as far as they can be reached.

    Raises
    ------
    KernelError
        If one of them is not supported; the message names the line.
    """
    for node in statements:
        if scope.ended:
            return
        writer = _WRITERS.get(type(node))
        try:
            if writer is None:
                raise KernelError(f"{type(node).__name__} is not compiled")
            writer(scope, node)
        except KernelError as error:
            raise error.within(f"line {node.lineno}: {ast.unparse(node).splitlines()[0]}") from None


def _assign(scope: Scope, node: ast.Assign) -> None:
    value = read(scope, node.value)
    for target in node.targets:
        assign_to(scope, target, value)


def assign_to(scope: Scope, target: ast.expr, value: Value) -> None:
    """Assign a value to a name, an element, a view or several of them."""
    match target:
        case ast.Name():
            scope.assign(target.id, value, convert)
        case ast.Tuple():
            items = value.items
            if len(items) != len(target.elts):
                raise KernelError(f"{len(target.elts)} values are wanted, got {len(items)}")
            for part, item in zip(target.elts, items, strict=True):
                assign_to(scope, part, item)
        case ast.Subscript():
            owner, items = place_of(scope, target)
            if len(items) == owner.array.rank and all(item.kind == INT for item in items):
                indices = [arrays.nonnegative_index(scope, owner, *place) for place in enumerate(items)]
                arrays.store(scope, owner, indices, value)
            else:
                arrays.fill(scope, arrays.view(scope, owner, items), value)
        case _:
            raise KernelError(f"an assignment to {ast.unparse(target)} is not compiled")


def _annotated(scope: Scope, node: ast.AnnAssign) -> None:
    if node.value is not None:
        assign_to(scope, node.target, read(scope, node.value))


def _augmented(scope: Scope, node: ast.AugAssign) -> None:
    if isinstance(node.target, ast.Name):
        old, new = scope.read(node.target.id), read(scope, node.value)
        if isinstance(old.kind, ArrayKind):
            _update_array(scope, old, node.op, new)
        else:
            scope.assign(node.target.id, operator_result(scope, node.op, old, new), convert)
        return
    if not isinstance(node.target, ast.Subscript):
        raise KernelError(f"an assignment to {ast.unparse(node.target)} is not compiled")
    owner, items = place_of(scope, node.target)
    new = read(scope, node.value)
    if len(items) == owner.array.rank and all(item.kind == INT for item in items):
        indices = [arrays.nonnegative_index(scope, owner, *place) for place in enumerate(items)]
        arrays.store(scope, owner, indices, operator_result(scope, node.op, arrays.load(scope, owner, indices), new))
    else:
        _update_array(scope, arrays.view(scope, owner, items), node.op, new)


def _update_array(scope: Scope, target: Value, operator: ast.operator, by: Value) -> None:
    """Change an array in place."""
    with arrays.element_loops(scope, target.lengths) as indices:
        other = arrays.load(scope, by, indices) if isinstance(by.kind, ArrayKind) else by
        changed = operator_result(scope, operator, arrays.load(scope, target, indices), other)
        arrays.store(scope, target, indices, changed)


def _if(scope: Scope, node: ast.If) -> None:
    condition = truth(scope, read(scope, node.test))
    yes, no, done = (scope.fresh(name) for name in ("then", "else", "endif"))
    scope.branch(condition, yes, no if node.orelse else done)
    outside, ends = dict(scope.known), list[dict[str, Value]]()
    for label, body in ((yes, node.body), (no, node.orelse)):
        scope.known = dict(outside)
        if not body:
            ends.append(scope.known)
            continue
        scope.label(label)
        write(scope, body)
        if not scope.ended:
            ends.append(scope.known)
            scope.jump(done)
    scope.ended = not ends
    if not ends:
        return
    scope.label(done)
    scope.known = ends[0]
    if len(ends) == 2:
        scope.forget(assigned_in([*node.body, *node.orelse]))
        scope.forget({name for name in scope.known if scope.known[name] is not ends[1].get(name)})


def _refuse_else(node: ast.For | ast.While) -> None:
    if node.orelse:
        raise KernelError("the else of a loop is not compiled")


def _for(scope: Scope, node: ast.For) -> None:
    _refuse_else(node)
    changed = assigned_in([*node.body, node.target])
    value = read(scope, node.iter)
    if isinstance(value.kind, Range):
        begin, end, step = value.parts
        if not is_literal(step) or int(step) == 0:
            step = _positive_step(scope, step)
        with scope.counting(begin, end, step, forget=changed) as counter:
            assign_to(scope, node.target, Value(INT, (counter,)))
            write(scope, node.body)
        return
    with scope.counting("0", value.lengths[0], forget=changed) as counter:
        assign_to(scope, node.target, arrays.indexed(scope, value, [Value(INT, (counter,))]))
        write(scope, node.body)


def _positive_step(scope: Scope, step: str) -> str:
    """Return an unknown step; it is assumed to be positive, and is at least one."""
    small = scope.op(f"icmp slt i64 {step}, 1")
    return scope.op(f"select i1 {small}, i64 1, i64 {step}")


def _while(scope: Scope, node: ast.While) -> None:
    _refuse_else(node)
    head, body, done = (scope.fresh(name) for name in ("while", "do", "end"))
    changed = assigned_in(node.body)
    scope.forget(changed)
    scope.jump(head)
    scope.label(head)
    scope.branch(truth(scope, read(scope, node.test)), body, done)
    outside = dict(scope.known)
    scope.label(body)
    scope.loops.append((head, done))
    scope.depth += 1
    write(scope, node.body)
    scope.depth -= 1
    scope.loops.pop()
    scope.jump(head)
    scope.label(done)
    scope.known = outside
    scope.forget(changed)


def _break(scope: Scope, node: ast.Break) -> None:  # noqa: ARG001  all take a node
    scope.jump(scope.loops[-1][1])


def _continue(scope: Scope, node: ast.Continue) -> None:  # noqa: ARG001  all take a node
    scope.jump(scope.loops[-1][0])


def _return(scope: Scope, node: ast.Return) -> None:
    return_value(scope, NOTHING_VALUE if node.value is None else read(scope, node.value))


NOTHING_VALUE = Value(NOTHING, ())


def return_value(scope: Scope, value: Value) -> None:
    """End the function with a result."""
    kind = common_kind("what is returned", scope.returned, value.kind)
    scope.again = scope.again or (scope.returned is not None and scope.returned != kind)
    scope.returned = kind
    value = convert(scope, value, kind)
    scope.origin |= value.origin
    scope.body.append((scope.owner, f"call void @release(ptr {scope.owner})"))
    whole = structure(kind)
    if len(kind.parts) < 2:
        scope.line(f"ret {whole} {value.parts[0]}" if kind.parts else "ret void")
    else:
        result = "undef"
        for place, (part, register) in enumerate(zip(kind.parts, value.parts, strict=True)):
            result = scope.op(f"insertvalue {whole} {result}, {part} {register}, {place}")
        scope.line(f"ret {whole} {result}")
    scope.ended = True


def _expression(scope: Scope, node: ast.Expr) -> None:
    if not isinstance(node.value, ast.Constant):
        read(scope, node.value)


def _pass(scope: Scope, node: ast.Pass) -> None:
    pass


_WRITERS: Mapping[type[ast.stmt], Callable[..., None]] = {
    ast.Assign: _assign,
    ast.AnnAssign: _annotated,
    ast.AugAssign: _augmented,
    ast.If: _if,
    ast.For: _for,
    ast.While: _while,
    ast.Break: _break,
    ast.Continue: _continue,
    ast.Return: _return,
    ast.Expr: _expression,
    ast.Pass: _pass,
}
