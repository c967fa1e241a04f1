"""Statements of a translated function."""

import ast
from collections import Counter
from collections.abc import Callable, Sequence
from math import prod
from typing import TYPE_CHECKING

from plant.compiled.c99.shapes import Block, Scalar, Thing, flat_parameters
from plant.compiled.c99.values import Values, untranslated_error

if TYPE_CHECKING:
    from plant.compiled.c99.loops import Translation


class Body(Values):
    """Writes the statements of one function.

    Parameters
    ----------
    owner : Translation
        The translation to which it belongs.
    names : dict[str, Thing]
        Its parameters [any unit].
    node : ast.FunctionDef
        The function.
    """

    def __init__(self, owner: "Translation", names: dict[str, Thing], node: ast.FunctionDef) -> None:
        super().__init__(owner, names)
        stored = (one for one in ast.walk(node) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store))
        self._settings = Counter(one.id for one in stored)
        self.locals: dict[str, bool] = {}
        self.results: tuple[bool, ...] = ()

    def block(self, nodes: Sequence[ast.stmt]) -> list[str]:
        """Return statements in C, not indented."""
        return [line for node in nodes for line in self._statement(node)]

    def _statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=value):
                return self._tuple_assignment(targets, value)
            case ast.Assign(targets=targets, value=value):
                return self._assignment(targets, value)
            case ast.AugAssign(target=target, op=operator, value=value):
                joined = ast.BinOp(ast.parse(ast.unparse(target), mode="eval").body, operator, value)
                return self._assignment([target], joined)
            case ast.For(target=ast.Name(id=name), iter=over, body=body, orelse=[]):
                return self._loop(name, over, body)
            case ast.If(test=test, body=body, orelse=orelse):
                lines = [f"if ({self.truth(test)}) {{", *_indented(self.block(body))]
                if orelse:
                    lines += ["} else {", *_indented(self.block(orelse))]
                return [*lines, "}"]
            case ast.Return(value=ast.Tuple(elts=values)):
                return self._return_statement(values)
            case ast.Return(value=ast.expr() as value):
                return self._return_statement([value])
            case ast.Expr(value=ast.Call() as call):
                return [f"{self.call(call)};"]
            case _:
                raise untranslated_error(node)

    def _assignment(self, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        found = self.thing(value)
        if isinstance(found, Scalar) and found.text.isdigit() and self._are_set_once(targets):
            self.names |= {target.id: found for target in targets if isinstance(target, ast.Name)}
            return []
        if not isinstance(found, Scalar):
            return self._array_copy(targets, found)
        lines: list[str] = []
        for target in reversed(targets):  # the last target is written first, and its value passed on
            place = self._place(target, found)
            if isinstance(place, Block):
                lines += self._element_loop(place, lambda _, found=found: found.text)
            else:
                lines.append(f"{place} = {found.text};")
                found = Scalar(place, found.whole)
        return lines

    def _are_set_once(self, targets: Sequence[ast.expr]) -> bool:
        """Return whether the targets are names that the function sets only once; such a name represents its value."""
        return all(isinstance(target, ast.Name) and self._settings[target.id] == 1 for target in targets)

    def _place(self, target: ast.expr, value: Scalar) -> str | Block:
        if isinstance(target, ast.Name):
            if target.id not in self.names:
                self.names[target.id] = Scalar(target.id, value.whole)
                self.locals[target.id] = value.whole
            return target.id
        place = self.thing(target)
        self.note_written(place)
        return place if isinstance(place, Block) else place.text if isinstance(place, Scalar) else ""

    def _array_copy(self, targets: Sequence[ast.expr], source: Thing) -> list[str]:
        if len(targets) != 1 or not isinstance(source, Block):
            raise untranslated_error(targets[0])
        target = self.thing(targets[0])
        if not isinstance(target, Block) or target.shape != source.shape:
            raise untranslated_error(targets[0])
        self.note_written(target)
        return self._element_loop(target, lambda place: f"{source.text}[{place}]")

    def _element_loop(self, target: Block, value: Callable[[str], str]) -> list[str]:
        place = f"each{self.depth}"
        line = f"{target.text}[{place}] = {value(place)};"
        return [f"for (int {place} = 0; {place} < {prod(target.shape)}; ++{place}) {{", f"    {line}", "}"]

    def _tuple_assignment(self, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        names = [target.id for target in targets if isinstance(target, ast.Name)]
        found = None if isinstance(value, ast.Call) else self.thing(value)
        if isinstance(found, tuple) and len(names) == len(targets) == len(found):
            if all(not isinstance(one, Scalar) for one in found):
                self.names |= dict(zip(names, found, strict=True))
                return []
            lines = [line for pair in zip(targets, found, strict=True) for line in self._item_assignment(*pair)]
            # a later value would read a target that is already overwritten
            if {one.id for one in ast.walk(value) if isinstance(one, ast.Name)} & {*names}:
                raise untranslated_error(value)
            return lines
        if found is not None or not isinstance(value, ast.Call):
            raise untranslated_error(value)
        results = [Scalar("", False)] * len(targets)
        places = [self._place(target, one) for target, one in zip(targets, results, strict=True)]
        behind = [f"&{place}" for place in places[1:]]
        return [f"{places[0]} = {self.call(value, behind)};"]

    def _item_assignment(self, target: ast.expr, value: Thing) -> list[str]:
        if not isinstance(value, Scalar):
            raise untranslated_error(target)
        return [f"{self._place(target, value)} = {value.text};"]

    def _loop(self, name: str, over: ast.expr, body: list[ast.stmt]) -> list[str]:
        match over:
            case ast.Call(func=ast.Name(id="range"), args=[end]):
                return self._counted_loop(name, ("0", self.thing_text(end)), self.known_loop_end(end), body)
            case ast.Call(func=ast.Name(id="range"), args=[begin, end]):
                return self._counted_loop(
                    name, (self.thing_text(begin), self.thing_text(end)), self.known_loop_end(end), body
                )
            case _:
                return self._loop_over(name, over, body)

    def _loop_over(self, name: str, over: ast.expr, body: list[ast.stmt]) -> list[str]:
        array, counter = self.thing(over), f"each{self.depth}"
        element = array.at([counter]) if isinstance(array, Block) else None
        if not isinstance(array, Block) or not isinstance(element, Scalar):
            raise untranslated_error(over)
        first = f"{self._place(ast.Name(name), element)} = {element.text};"
        count = array.shape[0]
        return self._for_loop(counter, ("0", str(count)), [first, *self._loop_body(body, count)])

    def _counted_loop(self, name: str, ends: tuple[str, str], most: int, body: list[ast.stmt]) -> list[str]:
        outside = dict(self.names)
        self.names[name] = Scalar(name, True)
        lines = self._loop_body(body, most)
        own = {name: outside[name]} if name in outside else {}
        self.names = {one: thing for one, thing in self.names.items() if one != name} | own
        return self._for_loop(name, ends, lines)

    def _for_loop(self, counter: str, ends: tuple[str, str], lines: Sequence[str]) -> list[str]:
        return [f"for (int {counter} = {ends[0]}; {counter} < {ends[1]}; ++{counter}) {{", *_indented(lines), "}"]

    def _loop_body(self, body: list[ast.stmt], most: int) -> list[str]:
        """Return a loop's body; its operations count as often as the body may run."""
        outer, self.counted = self.counted, Counter[str]()
        self.depth += 1
        lines = self.block(body)
        self.depth -= 1
        inner, self.counted = self.counted, outer
        self.counted.update({kind: most * count for kind, count in inner.items()})
        return lines

    def _return_statement(self, values: Sequence[ast.expr]) -> list[str]:
        found = [self.thing(value) for value in values]
        scalars = [one for one in found if isinstance(one, Scalar)]
        if len(scalars) != len(found):
            raise untranslated_error(values[0])
        self.results = tuple(one.whole for one in scalars)
        behind = [f"*result_{i} = {one.text};" for i, one in enumerate(scalars) if i > 0]
        return [*behind, f"return {scalars[0].text};"]

    def note_written(self, thing: Thing) -> None:
        """Note that elements of an array are written.

        Parameters
        ----------
        thing : Scalar, Block or tuple of them
            The thing that is written [any unit].
        """
        self.written.update(one.root for _, one in flat_parameters("", thing))


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]
