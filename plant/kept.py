"""State of long runs, kept across a restart: arrays in one file, which is either complete or does not exist."""

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from plant.arrays import Array
from plant.atomic import replacing
from plant.errors import HydrostateError


def write_kept(path: Path, kind: str, values: Mapping[str, Any]) -> None:
    """Write arrays to a file of a given kind.

    Parameters
    ----------
    path : Path
        The file to write.
    kind : str
        Name of the writer, with the number of its format: ``hydrostate watch 4``.
    values : Mapping[str, ndarray], each of its own shape
        Numbers or texts by name [any unit].

    Raises
    ------
    HydrostateError
        If the file cannot be written.
    """
    content = io.BytesIO()
    named: dict[str, Any] = {"format": np.array(kind), **values}
    np.savez(content, **named)
    try:
        with replacing(path) as file:
            file.write(content.getvalue())
    except OSError as error:
        raise HydrostateError(f"{path}: the state cannot be written: {error.strerror or error}") from error


def read_kept(path: Path, *kinds: str) -> dict[str, Array]:
    """Read arrays from a file of a given kind.

    Parameters
    ----------
    path : Path
        A file written by `write_kept`.
    *kinds : str
        Names of the writers whose files can be read, the newest first.

    Returns
    -------
    dict[str, ndarray]
        Its arrays by name.

    Raises
    ------
    HydrostateError
        If the file cannot be read or is of another kind.
    """
    wanted = f"a state of {kinds[0].rpartition(' ')[0]} is needed"
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:  # NumPy leaves a damaged file open
            values = {name: kept[name] for name in kept.files}
    except OSError as error:
        raise HydrostateError(f"{path}: {wanted}: {error.strerror or error}") from error
    except (ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:  # NumPy's own message is about pickles
        raise HydrostateError(f"{path}: {wanted}, the file holds none, or is damaged") from error
    found = str(values.pop("format", ""))
    if found not in kinds:
        of = f"the file is one of {found[:60]!r}" if found else "the file is no state"
        raise HydrostateError(f"{path}: {wanted}, {of}, which this version cannot continue; to begin again, delete it")
    return values
