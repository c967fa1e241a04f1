"""Names of a package that are imported when they are first asked for, so that importing the package costs nothing."""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def lazily(package: str, file: str) -> Callable[[str], Any]:
    """Return a package's ``__getattr__`` (PEP 562) by the imports that it makes for type checkers alone.

    Its ``__all__`` is found the same way: the names of those imports.

    Parameters
    ----------
    file : str
        Its ``__file__``, in which every such import reads ``from package.module import name as name``, or as another.
    """

    @cache
    def places() -> Mapping[str, tuple[str, str]]:
        imports = [one for one in ast.walk(ast.parse(Path(file).read_bytes())) if isinstance(one, ast.ImportFrom)]
        return {alias.asname: (str(one.module), alias.name) for one in imports for alias in one.names if alias.asname}

    def found(name: str) -> Any:
        if name == "__all__":
            return sorted(places())
        if name not in places():
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, there = places()[name]
        return getattr(import_module(module), there)

    return found
