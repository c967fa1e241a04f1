"""The library of nine transfer functions that ships: one file, read by the study, by `library` and by `diagnose`."""

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from estimation.identification.model.linear_model import LinearModel
from plant.errors import HydrostateError

FORMAT = "hydrostate transfer-function library"
"""Format name in the file."""

VERSION = 2
"""Version of the format; a reader refuses other versions."""


def library_models(library: Mapping[str, Any], which: str = "model") -> dict[str, LinearModel]:
    """Return the models of a library by condition, bit for bit as they were stored.

    Parameters
    ----------
    library : Mapping
        The values of a library file.
    which : str
        ``model``, or ``around_mean`` for the models of a test around an input mean.

    Returns
    -------
    dict[str, LinearModel]
        Motor speed [rad/s] to velocity [m/s].
    """
    return {name: LinearModel.from_dict(entry[which]) for name, entry in library["conditions"].items()}


def read_library(path: Path | None = None, which: str = "model") -> dict[str, LinearModel]:
    """Return the models of a library file.

    Parameters
    ----------
    path : Path, optional
        The file; by default the library that ships with the package.
    which : str
        As for `library_models`.

    Returns
    -------
    dict[str, LinearModel]
        As `library_models`.

    Raises
    ------
    HydrostateError
        If the file is no library, or of another version.
    """
    if path is None:
        return dict(_shipped(which))
    return _read(path, which)


@cache
def _shipped(which: str) -> dict[str, LinearModel]:
    """Return the models that ship with the package, read at the first log of a process."""
    return _read(files("experiments.published") / "transfer_function_library.json", which)


def _read(source: Traversable, which: str) -> dict[str, LinearModel]:
    try:
        library = json.loads(source.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise HydrostateError(f"library {source} cannot be read: {why}") from error
    if not isinstance(library, dict) or library.get("format") != FORMAT or library.get("version") != VERSION:
        raise HydrostateError(f"library {source} must say format {FORMAT!r} and version {VERSION}")
    try:
        return library_models(library, which)
    except (KeyError, TypeError, AttributeError) as error:
        raise HydrostateError(f"library {source} must hold conditions with a model each, got {error!r}") from error
