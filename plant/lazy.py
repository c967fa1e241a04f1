"""Package names that are imported at first use, so that importing the package itself is cheap."""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def lazy_getattr(package: str, file: str) -> Callable[[str], Any]:
    """Return a package's ``__getattr__`` (PEP 562), built from the imports that it makes only for type checkers.

    Its ``__all__`` comes from the same imports: their names.

    Parameters
    ----------
    file : str
        Its ``__file__``; every such import in it reads ``from package.module import name as name``, or uses another
        alias.
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
