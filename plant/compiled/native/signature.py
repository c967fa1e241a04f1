"""Signature of a kernel, read from its documentation: kinds of its arguments, and their checked shapes.

The parameters section of a numpydoc text gives everything: ``drive : ndarray, shape (n,)``. So shapes are stated once.
"""

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, get_type_hints

from plant.compiled.native.kinds import BOOL, COMPLEX, FLOAT, INT, AnyKind, ArrayKind, ScalarKind, TupleKind

Length: TypeAlias = int | str | None
"""Length of an axis: a number, a name that has the same value in all arguments, or None for no check."""

_ENTRY = re.compile(r"^(\w[\w, ]*?) : (.+)$")
_SHAPED = re.compile(r"^ndarray(?: of (int|bool|complex))?, shapes? (\(.*\))")
_ELEMENTS = {"int": INT, "bool": BOOL, "complex": COMPLEX, None: FLOAT}
_NUMBERS = {"float": FLOAT, "int": INT, "bool": BOOL}
_HINTED: Mapping[object, ScalarKind] = {float: FLOAT, int: INT, bool: BOOL}


@dataclass(frozen=True)
class Argument:
    """One argument of a kernel.

    Parameters
    ----------
    lengths : tuple
        Lengths of an array's axes.
    items : tuple of Argument
        Items of a tuple.
    """

    name: str
    kind: AnyKind
    lengths: tuple[Length, ...] = ()
    items: "tuple[Argument, ...]" = ()


Signature: TypeAlias = tuple[Argument, ...]


def signature(documentation: str, known: Collection[str] = ()) -> Signature:
    r"""Read a kernel's arguments from the parameters of a numpydoc text.

    Parameters
    ----------
    documentation : str
        Entries such as ``drive : ndarray, shape (n, 2)``; a length that is an integer or a name is checked, any other
        text (``up to lanes``) is not. Lines that begin with white space are explanations.
    known : collection of str
        Arguments that are omitted because they are already known.

    Raises
    ------
    ValueError
        If an entry is neither a number nor an array with its shape.

    Examples
    --------
    >>> for argument in signature("rows : ndarray, shape (n, 2)\nsteps : int"):
    ...     print(argument.name, argument.kind.name, argument.lengths)
    rows array of float, 2-dimensional ('n', 2)
    steps int ()
    """
    found: list[Argument] = []
    for line in documentation.splitlines():
        match = _ENTRY.match(line)
        if match:
            names = match[1].split(", ")
            found += [_argument(name, match[2], place) for place, name in enumerate(names) if name not in known]
    return tuple(found)


def _argument(name: str, text: str, place: int = 0) -> Argument:
    """Read one argument; if several shapes are given, take the one at its position."""
    if text.startswith("tuple ("):
        items = tuple(_argument(f"{name}[{k}]", one) for k, one in enumerate(text[7:-1].split("; ")))
        return Argument(name, TupleKind(tuple(item.kind for item in items)), items=items)
    shaped = _SHAPED.match(text)
    if shaped:
        shapes = re.findall(r"\(([^()]*)\)", shaped[2])
        shape = shapes[place] if place < len(shapes) and len(shapes) > 1 else shapes[0]
        lengths = tuple(_length(one) for one in shape.split(",") if one.strip())
        return Argument(name, ArrayKind(_ELEMENTS[shaped[1]], len(lengths)), lengths)
    kind = _NUMBERS.get(text)
    if kind is None:
        raise ValueError(f"{name} must be a number or an array with its shape, got {text!r}")
    return Argument(name, kind)


def _length(text: str) -> Length:
    text = text.strip()
    if text.isdigit():
        return int(text)
    return text if text.isidentifier() else None


def signature_of(function: Callable[..., object], **lengths: int) -> Signature:
    """Return the signature of a documented function.

    Parameters
    ----------
    function : callable
        A function of a module, whose numpydoc text has all arrays; a parameter named ``kernel`` is omitted.
    **lengths : int
        Values of named lengths in it.

    Raises
    ------
    ValueError
        If the text and the function differ in their parameters.

    Examples
    --------
    >>> def mean(values: object, first: int) -> float:
    ...     '''Return a mean.
    ...
    ...     Parameters
    ...     ----------
    ...     values : ndarray, shape (n,)
    ...         Numbers.
    ...     first : int
    ...         Where to begin.
    ...     '''
    >>> [argument.name for argument in signature_of(mean)]
    ['values', 'first']
    """
    names = [
        name
        for name, one in inspect.signature(function).parameters.items()
        if name != "kernel" and one.kind is not one.KEYWORD_ONLY
    ]
    hints = {name: hint for name, hint in function.__annotations__.items() if name in names}
    hinted = {name: Argument(name, _HINTED[hint]) for name, hint in hints.items() if hint in _HINTED}
    named = {name: _named_tuple(name, hint) for name, hint in hints.items() if hasattr(hint, "_fields")}
    found = hinted | _documented(function, named) | named
    if set(names) != set(found):
        raise ValueError(f"{function.__qualname__} takes {names}, its documentation has {list(found)}")
    return tuple(_with_lengths(found[name], lengths) for name in names)


def _named_tuple(name: str, of: Any) -> Argument:
    """Return an argument that is a named tuple of numbers or of arrays whose shapes its documentation gives."""
    shown, hints = _documented(of), get_type_hints(of)
    items = [shown.get(field) or Argument(field, _HINTED[hints[field]]) for field in of._fields]
    kind = TupleKind(tuple(item.kind for item in items), of._fields)
    return Argument(name, kind, items=tuple(replace(item, name=f"{name}.{item.name}") for item in items))


def _documented(what: Any, known: Collection[str] = ()) -> dict[str, Argument]:
    """Return the documented arguments of a function or a named tuple that are not yet known, by name."""
    text = inspect.getdoc(what) or _documentation(what)
    section = text.partition("Parameters\n----------\n")[2]
    section = re.split(r"\n\n\w+\n-{3,}\n", section)[0]
    return {argument.name: argument for argument in signature(section, known)}


def _with_lengths(argument: Argument, lengths: dict[str, int]) -> Argument:
    known = tuple(lengths.get(one, one) if isinstance(one, str) else one for one in argument.lengths)
    return Argument(argument.name, argument.kind, known, tuple(_with_lengths(item, lengths) for item in argument.items))


def _documentation(what: Any) -> str:
    """Return the documentation of a function or a class if Python has discarded it (``python -OO``)."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(what)))
    node = tree.body[0]
    return (ast.get_docstring(node) if isinstance(node, ast.FunctionDef | ast.ClassDef) else None) or ""


def kind_as_json(kind: AnyKind) -> object:
    """Return the JSON form of a kind."""
    match kind:
        case ScalarKind():
            return kind.name
        case ArrayKind():
            return [kind.element.name, kind.rank]
        case _:
            return {"items": [kind_as_json(item) for item in kind.items]} if isinstance(kind, TupleKind) else kind.name
