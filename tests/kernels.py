"""Captures the source text of kernels before it is compiled, so that tests can run its parts in Python."""

import ast
import ctypes
import inspect
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from fractions import Fraction
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from plant.compiled.expression import Expression
from plant.compiled.native.load import load_native
from plant.compiled.native.loops import Loop
from plant.compiled.native.recipes import PACKAGES
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import bare_text, functions_text, kernel_text
from plant.compiled.source import lines_source


class _Caught(Exception):  # noqa: N818  nothing is wrong
    """Raised instead of compiling, once the text is captured."""


def text_of(monkeypatch: pytest.MonkeyPatch, module: ModuleType, compile_it: Callable[[], object]) -> str:
    """Return the text that a module passes to the compiler, without compiling it."""
    texts: list[str] = []

    def caught(name: str, text: Any, entries: Any, made_of: object = None) -> Any:  # noqa: ARG001  as `load_native`
        texts.append(text if isinstance(text, str) else text())
        raise _Caught

    with monkeypatch.context() as patch, suppress(_Caught):
        patch.setattr(module, "load_native", caught)
        compile_it()
    (text,) = texts
    return text


@contextmanager
def loops_in_python() -> Iterator[None]:
    """Run compiled loops as plain Python, so that coverage sees them; it is fast enough for short series."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Loop, "__call__", lambda loop, *args: loop.__wrapped__(*args))
        yield


def functions_of(text: str) -> SimpleNamespace:
    """Return a kernel's constants and functions as Python; pasted functions keep their files' lines for coverage."""
    tree = ast.parse(text)
    names: dict[str, Any] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = []
        if not _is_made(node):
            file = _as_in_its_file(node) if isinstance(node, ast.FunctionDef) else None
            exec(compile(ast.Module([node], []), file or "kernel", "exec"), names)  # noqa: S102  our own text
    for node in tree.body:
        match node:
            case ast.Assign([ast.Name(made)], ast.Call(ast.Name("function_of"), [ast.Name(lines), _])):
                names[made] = _of_a_tuple(names[lines])
            case _:
                pass
    return SimpleNamespace(**names)


def _as_in_its_file(pasted: ast.FunctionDef) -> str | None:
    """Renumber the statements of a pasted function as in its own file, and return that file."""
    text = ast.unparse(pasted)
    for name, module in list(sys.modules.items()):
        ours = name.partition(".")[0] in PACKAGES  # other modules may warn if asked for a name
        function = vars(module).get(pasted.name) if ours else None
        if not isinstance(function, FunctionType) or function.__module__ != module.__name__ or _bare(function) != text:
            continue
        lines, first = inspect.getsourcelines(function)
        written = ast.parse("".join(lines)).body[0]
        assert isinstance(written, ast.FunctionDef)
        if ast.get_docstring(written) is not None:
            written.body = written.body[1:]
        here, there = ([n for n in ast.walk(tree) if isinstance(n, ast.stmt)] for tree in (pasted, written))
        for mine, origin in zip(here, there, strict=True):
            _onto(mine, origin.lineno + first - 1)
        return inspect.getsourcefile(function)
    return None


def _bare(function: FunctionType) -> str | None:
    try:
        return bare_text(function)
    except (OSError, TypeError, SyntaxError):
        return None


def _onto(statement: ast.stmt, line: int) -> None:
    """Set the line number of a statement and its expressions, but not of nested statements."""
    waiting: list[ast.AST] = [statement]
    while waiting:
        node = waiting.pop()
        if hasattr(node, "lineno"):
            node.lineno = node.end_lineno = line  # type: ignore[attr-defined]
        waiting += [child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.stmt)]


def _of_a_tuple(lines: FunctionType) -> Callable[[tuple[float, ...]], tuple[float, ...]]:
    """Return lines of a kernel as a function from a tuple to a tuple."""
    return lambda given: tuple(in_python(lines)(*given).values())


def _is_made(node: ast.stmt) -> bool:
    return isinstance(node, ast.Assign) and isinstance(node.value, ast.Call)


def fma(a: float, b: float, c: float) -> float:
    """Return a b + c, rounded once."""
    if not all(map(math.isfinite, (a, b, c))):
        return a * b + c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    return float(exact) if exact else a * b + c


def where(condition: bool, a: float, b: float) -> float:
    """Return one of two values, both of which have been computed."""
    return a if condition else b


OPERATIONS: Mapping[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("sqrt", "exp", "log", "tanh", "sin", "cos", "atan")},
    "fma": fma,
    "where": where,
    "sign": lambda x: where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0)),
    "present": lambda x: x == x,
    "ratios": lambda a, b: [x / y for x, y in zip(a, b, strict=True)],
    "roots": lambda values: [math.sqrt(x) for x in values],
}
"""The operations that lines may call (`plant.compiled.source.CALLED_OPERATIONS`), on floats."""


def in_python(lines: FunctionType) -> Callable[..., Any]:
    """Return lines of a kernel as a function of floats."""
    return FunctionType(lines.__code__, dict(OPERATIONS))


def computed(outputs: Mapping[str, Expression], **inputs: float) -> dict[str, float]:
    """Return the values of outputs, from the lines generated for them, on floats."""
    names: dict[str, Any] = {}
    exec(lines_source("lines", outputs), names)  # noqa: S102  our own text
    lines = names["lines"]
    return in_python(lines)(*(inputs[name] for name in inspect.signature(lines).parameters))


def every_lane(work: NDArray[np.float64], *, step: Callable[[int, float], None], WIDTH: int) -> None:
    """Call a step for all slots of 8 numbers in memory.

    Parameters
    ----------
    work : ndarray, shape (numbers,)
        The slots.
    """
    for lane in range(0, 8, WIDTH):
        step(work.ctypes.data + 8 * lane, 0.0)


def stepped(
    text: str, name: str, given: Mapping[str, NDArray[np.float64]], results: str, width: int
) -> dict[str, NDArray[np.float64]]:
    """Return what named lines compute for 8 numbers each, ``width`` at a time, without outputs that are all NaN."""
    slots = {one: 8 * i for i, one in enumerate((*given, *results))}
    step = f"SLOTS = {slots}\n\nstep = stepping(SLOTS, {width}, {name})"
    whole = kernel_text(
        f"{name}, {width} at a time", text, step, functions_text(every_lane, constants={"WIDTH": width})
    )
    kernel = load_native(f"stepped_{name}", whole, {"every_lane": signature_of(every_lane)})
    work = np.concatenate([*given.values(), np.full(8 * len(results), np.nan)])
    kernel.every_lane(work)
    found = {one: work[slots[one] : slots[one] + 8] for one in results}
    return {one: values for one, values in found.items() if not np.all(np.isnan(values))}


def on_memory(file: SimpleNamespace, *lines: FunctionType) -> Callable[..., None]:
    """Return successive lines of a kernel as an operation on numbers in memory, one number at a time."""

    def operation(address: int, j: float, *others: int) -> None:
        def at(name: str) -> ctypes.c_double:
            slot = file.SLOTS[name]
            place = address + 8 * slot if isinstance(slot, int) else others[slot[0]] + 8 * slot[1]
            return ctypes.c_double.from_address(place)

        known, results = {"j": j}, dict[str, float]()
        for part in lines:
            names = inspect.signature(part).parameters
            known |= {name: at(name).value for name in names if name not in known}
            results |= in_python(part)(*(known[name] for name in names))
            known |= results
        for name, value in results.items():
            if name in file.SLOTS:
                at(name).value = value

    return operation
