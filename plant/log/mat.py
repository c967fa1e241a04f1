"""MAT logs, to version 7: one struct whose fields are columns, or plain variables."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from plant.arrays import Array
from plant.errors import LogError
from plant.log.cells import each_read, numbers
from plant.log.columns import Column
from plant.log.csv import Choose
from plant.log.mat_reader import DamagedMatError, Value, read_variables

STRUCT = "record"
METADATA = "metadata_json"
NEWER = (b"\x00\x02IM", b"\x02\x00MI")
"""Version and byte order of a MAT 7.3, which is an HDF5 file."""


def read_mat(path: Path, choose: Choose) -> tuple[dict[Column, Array], str | None]:
    """Return the columns of a MAT log that ``choose`` picks by name, and the metadata text it carries.

    Parameters
    ----------
    path : Path
        A MAT file of version 5 to 7.

    Returns
    -------
    columns : dict[Column, ndarray, shape (n,)]
        Values as logged.
    metadata : str or None
        The JSON text that `write_mat` put there.

    Raises
    ------
    LogError
        If it is of another version or damaged, or a column is no vector of real numbers.
    """
    content = path.read_bytes()
    if content[124:128] in NEWER:
        raise LogError("MAT files to version 7 are read, got 7.3; save it with '-v7'", str(path))
    try:
        table = _table(read_variables(content))
    except DamagedMatError as error:
        raise LogError(f"cannot be read as mat: {error}", str(path)) from error
    names = [name for name in table if name != METADATA]

    def read(column: Column) -> Array:
        return numbers(np.atleast_1d(np.asarray(table[names[column.position]])), column.name, str(path))

    text = table.get(METADATA)
    return each_read(choose(names), read), text if isinstance(text, str) else None


def _table(content: Mapping[str, Value]) -> Mapping[str, Value]:
    """Return the struct that holds the columns: the one named record, the only one, or the file itself."""
    structs = {name: value for name, value in content.items() if isinstance(value, Mapping)}
    if STRUCT in structs:
        return structs[STRUCT]
    return next(iter(structs.values())) if len(structs) == 1 and len(content) == 1 else content


def write_mat(columns: Mapping[str, Array], metadata: str, file: BinaryIO, source: str) -> None:
    """Write columns as the fields of one struct named ``record``.

    Parameters
    ----------
    columns : Mapping[str, ndarray, shape (n,)]
        Values by column name.
    metadata : str
        JSON text, kept in the field ``metadata_json``.
    file : BinaryIO
        Where to, open for writing.

    Raises
    ------
    LogError
        If a column's name cannot be a MATLAB field name.
    """
    from scipy.io import savemat

    for name in columns:
        if re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", name) is None:
            raise LogError(f"a MATLAB field name is wanted (63 letters, digits, _), got {name!r}", source)
    struct = {STRUCT: {**columns, METADATA: metadata}}
    savemat(cast(Any, file), struct, long_field_names=True, oned_as="column", do_compression=True)
