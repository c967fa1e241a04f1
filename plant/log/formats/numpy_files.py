"""NumPy files: an array (.npy), or an archive of named arrays (.npz)."""

from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np

from plant.errors import LogError
from plant.log.formats.mat import columns_of_array
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.table import Table, table_of


def open_npz(path: Path) -> Table:
    """Open an archive of NumPy arrays.

    Raises
    ------
    LogError
        If it unpacks to more than a log does, or holds no column.
    ValueError
        If an array is of objects.
    """
    most = most_unpacked(path.stat().st_size)
    with ZipFile(path) as archive:
        if sum(one.file_size for one in archive.infolist()) > most:
            raise too_large(str(path), most)
    with np.load(path, allow_pickle=False) as held:
        named = {name: held[name] for name in held.files}
    return _table(path, {key: values for name, one in named.items() for key, values in _columns(name, one).items()})


def open_npy(path: Path) -> Table:
    """Open a NumPy array: a structured array with one column for each field, or rows of numbers.

    Raises
    ------
    LogError
        If it holds no column.
    ValueError
        If it is of objects.
    """
    return _table(path, _columns("column", np.load(path, allow_pickle=False)))


def _columns(name: str, values: "np.ndarray[Any, Any]") -> dict[str, Any]:
    if values.dtype.names:
        return {field: np.ravel(values[field]) for field in values.dtype.names}
    if values.dtype.kind not in "fiubcMmU":
        return {}
    if values.dtype.kind == "m":
        values = np.where(np.isnat(values), np.nan, values.astype("timedelta64[ns]").astype(np.int64) * 1e-9)
    return columns_of_array(name, values)


def _table(path: Path, columns: dict[str, Any]) -> Table:
    if not columns:
        raise LogError("it holds no vector of numbers", str(path))
    return table_of(str(path), columns)
