"""Faults planted in source text: signs, operators, comparisons, constants and connectives, one at a time.

The operators are our own, because the tests of interest are of formulas: mutmut skips decorated functions and module
constants, and cosmic-ray changes the tree that it runs in.
"""

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Pow: ast.Mult,
}
"""Replacement of each arithmetic operator."""

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
"""Replacement of each comparison."""

FACTORS = (2, 100)
"""Factors by which constants are multiplied [dimensionless]; zero becomes one."""

INFERRING_METHOD = "reshape"
"""Method that treats all negative lengths alike: NumPy then infers the length. Changing the magnitude of such a length
is no fault; changing its sign is."""

WITHOUT_FORMULAS = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)
"""Statements and expressions without formulas: messages, imports."""


@dataclass(frozen=True)
class Mutant:
    """One planted fault.

    Parameters
    ----------
    path : str
        File, relative to the project's folder.
    line : int
        Line of the fault.
    change : str
        The change, as text before and after.
    source : str
        The whole file with the fault.
    """

    path: str
    line: int
    change: str
    source: str


@dataclass(frozen=True)
class _Edit:
    """One reversible change of a tree: an attribute, or an entry of a list."""

    node: ast.expr
    owner: Any
    key: str | int
    value: Any

    def swap(self) -> Any:
        """Put the value in its place and return the previous one."""
        if isinstance(self.key, int):
            old, self.owner[self.key] = self.owner[self.key], self.value
        else:
            old = getattr(self.owner, self.key)
            setattr(self.owner, self.key, self.value)
        return old


def count_mutants(text: str) -> int:
    """Return how many faults can be planted in a file."""
    return sum(1 for _ in _edits(ast.parse(text)))


def mutants_of(path: str, text: str, chosen: Sequence[int]) -> Iterator[Mutant]:
    """Plant faults in a file, one at a time.

    Parameters
    ----------
    text : str
        Source text of the file.
    chosen : sequence of int
        Indices of faults, from 0 to `count_mutants` - 1.
    """
    tree = ast.parse(text)
    edits = list(_edits(tree))
    for number in chosen:
        edit = edits[number]
        before = ast.unparse(edit.node)
        old = edit.swap()
        after = ast.unparse(edit.node) if isinstance(edit.key, str) and edit.owner is edit.node else None
        source = ast.unparse(ast.fix_missing_locations(tree))
        change = f"{before}  ->  {after if after is not None else _edit_text(edit, before)}"
        _Edit(edit.node, edit.owner, edit.key, old).swap()
        yield Mutant(path, edit.node.lineno, change, source)


def _edit_text(edit: _Edit, before: str) -> str:
    if isinstance(edit.value, ast.expr):
        return ast.unparse(edit.value)
    return f"{before} with {type(edit.value).__name__}"


def _edits(tree: ast.Module) -> Iterator[_Edit]:
    yield from _edits_below(tree)


def _edits_below(node: ast.AST) -> Iterator[_Edit]:
    if isinstance(node, WITHOUT_FORMULAS) or _is_type_checking(node):
        return
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "slice", "decorator_list"} and not isinstance(value, ast.BinOp):
            continue
        entries = list(enumerate(value)) if isinstance(value, list) else [(name, value)]
        for key, child in entries:
            if isinstance(child, ast.expr):
                yield from _edits_of(child, value if isinstance(value, list) else node, key)
            if isinstance(child, ast.AST) and not (_is_negative(child) and _is_length(node, name)):
                yield from _edits_below(child)


def _is_length(call: ast.AST, name: str) -> bool:
    """Return whether a field of a node is a length passed to an array's method."""
    match call:
        case ast.Call(func=ast.Attribute(attr=method)):
            return name == "args" and method == INFERRING_METHOD
        case _:
            return False


def _is_negative(node: ast.AST) -> bool:
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int())):
            return True
        case _:
            return False


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def _edits_of(node: ast.expr, owner: Any, key: str | int) -> Iterator[_Edit]:
    match node:
        case ast.BinOp(op=op) if type(op) in OPERATORS and not _is_text(node):
            yield _Edit(node, node, "op", OPERATORS[type(op)]())
        case ast.Compare(ops=ops):
            yield from (_Edit(node, ops, i, COMPARISONS[type(op)]()) for i, op in enumerate(ops))
        case ast.BoolOp(op=op):
            yield _Edit(node, node, "op", ast.And() if isinstance(op, ast.Or) else ast.Or())
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield _Edit(node, owner, key, operand)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield _Edit(node, owner, key, operand)
        case ast.Constant(value=value) if isinstance(value, int | float) and not isinstance(value, bool):
            yield from (_Edit(node, node, "value", value * by if value else 1) for by in (FACTORS if value else (1,)))
        case _:
            return


def _is_text(node: ast.BinOp) -> bool:
    return any(
        isinstance(side, ast.Constant | ast.JoinedStr) and not _is_number(side) for side in (node.left, node.right)
    )


def _is_number(side: ast.expr) -> bool:
    return isinstance(side, ast.Constant) and isinstance(side.value, int | float | complex)


def mirrored_tests(root: Path, path: str) -> list[str]:
    """Return the tests that mirror a file: its folder's kept numbers, its own test, its docstrings, its folder's.

    Kept numbers come first, because they run all formulas of a folder in seconds.

    Parameters
    ----------
    path : str
        A file, relative to the root.

    Returns
    -------
    list of str
        Paths relative to the project's folder; the nearest existing folder of tests.
    """
    own = Path("tests") / Path(path).parent / f"test_{Path(path).name}"
    folder = own.parent
    while not (root / folder).is_dir() or not list((root / folder).glob("test_*.py")):
        folder = folder.parent
    numbers = sorted(str(test.relative_to(root)) for test in (root / folder).glob("test_numbers*.py"))
    return [*numbers, *([str(own)] if (root / own).is_file() else []), path, str(folder)]
