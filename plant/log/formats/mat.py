"""MAT logs: structs whose fields are columns, or plain variables. Versions 4 to 7 are read here, 7.3 as HDF5."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from plant.arrays import Array
from plant.errors import LogError
from plant.log.formats.mat4_reader import is_version_4, read_variables_of_version_4
from plant.log.formats.mat_reader import DamagedMatError, MatValue, read_variables
from plant.log.formats.mat_structs import as_signal, each_struct, structs_of
from plant.log.formats.modelica import modelica_columns
from plant.log.table import Table, table_of

STRUCT = "record"
METADATA = "metadata_json"

MOST_COLUMNS = 64
"""Columns of the widest matrix that is read as columns."""

NO_VECTORS = (
    "it holds no vector of numbers; a table, timetable or timeseries can only be read by MATLAB: save its columns as "
    "the fields of a struct, s.time_s = seconds(t.Time); s.position_m = t.Position; save('log.mat', '-struct', 's')"
)


def open_mat(path: Path) -> tuple[Table, ...]:
    """Open a MAT file of version 4 to 7.

    Returns
    -------
    tuple of Table
        One a struct, and one of the plain variables; or the one of a simulation in Modelica.

    Raises
    ------
    LogError
        If it is of another version or damaged, or holds no numbers.
    """
    stored = path.read_bytes()
    try:
        if not is_version_4(stored):
            return tables_of(read_variables(stored, str(path)), str(path))
        content = read_variables_of_version_4(stored)
    except DamagedMatError as error:
        raise LogError(f"cannot be read as mat: {error}", str(path)) from error
    columns, units = modelica_columns(content)
    return (table_of(str(path), columns, units=units),) if columns else tables_of(content, str(path))


def tables_of(content: Mapping[str, MatValue], source: str) -> tuple[Table, ...]:
    """Return the tables of the variables of a MAT file.

    Parameters
    ----------
    content : Mapping[str, ndarray of any shape, str, Mapping or Sequence]
        Variables by name; structs are mappings.
    source : str
        What messages call the file.

    Raises
    ------
    LogError
        If there are no numbers.
    """
    if isinstance(record := content.get(STRUCT), Mapping):
        content = {STRUCT: record}
    made: list[Table] = []
    structs: dict[str, Mapping[str, MatValue]] = {}
    for name, value in content.items():
        structs |= structs_of(name, value)
    plain = {name: value for name, value in content.items() if not each_struct(value)}
    for name, value in {"": plain, **structs}.items():
        if recorded := _dspace_columns(value):
            made += [table_of(source, columns, units=units, label=name) for columns, units in recorded]
            continue
        columns, units = _columns(as_signal(name, value))
        text = value.get(METADATA)
        if columns:
            said = text if isinstance(text, str) else None
            made.append(table_of(source, columns, units=units, metadata=said, label=name))
    if not made:
        raise LogError(NO_VECTORS, source)
    return tuple(made)


def _columns(struct: Mapping[str, MatValue], above: str = "") -> tuple[dict[str, Any], dict[str, str | None]]:
    """Return a struct's columns by name, with nested fields as ``outer.inner``, and the units it gives."""
    columns: dict[str, Any] = {}
    units: dict[str, str | None] = {}
    if "time" in struct and "signals" in struct:
        return _simulink_columns(struct)
    for name, value in struct.items():
        if isinstance(value, Mapping):
            inner, said = _columns(value, f"{above}{name}.")
            columns |= inner
            units |= said
        elif isinstance(value, np.ndarray):
            columns |= columns_of_array(above + name, value)
    return columns, units


def _dspace_columns(struct: Mapping[str, MatValue]) -> list[tuple[dict[str, Any], dict[str, str | None]]]:
    """Return the columns of a dSPACE recording, one table for each raster: signals in Y refer to their times in X."""
    if not {"X", "Y"} <= struct.keys():
        return []
    times, signals = (
        [one for one in each_struct(struct[name]) if isinstance(one.get("Data"), np.ndarray)] for name in "XY"
    )
    rasters: dict[int, tuple[dict[str, Any], dict[str, str | None]]] = {}
    for one in signals:
        place = one.get("XIndex")
        raster = int(np.ravel(place)[0]) - 1 if isinstance(place, np.ndarray) and place.size else 0
        if isinstance(name := one.get("Name"), str) and 0 <= raster < len(times):
            time = times[raster]
            columns, units = rasters.setdefault(raster, ({"time": np.ravel(_data(time))}, {"time": _unit(time) or "s"}))
            columns[name], units[name] = np.ravel(_data(one)), _unit(one)
    return list(rasters.values())


def _data(struct: Mapping[str, Any]) -> Any:
    return struct["Data"]


def _unit(struct: Mapping[str, Any]) -> str | None:
    said = struct.get("Unit")
    return said if isinstance(said, str) and said.strip() else None


def _simulink_columns(struct: Mapping[str, MatValue]) -> tuple[dict[str, Any], dict[str, str | None]]:
    """Return the columns of Simulink's "structure with time"; its time is in seconds."""
    columns: dict[str, Any] = {"time": struct["time"]}
    signals = struct["signals"]
    many: Sequence[Any] = signals if isinstance(signals, Sequence) and not isinstance(signals, str) else [signals]
    for number, one in enumerate(many, start=1):
        if isinstance(one, Mapping) and isinstance(one.get("values"), np.ndarray):
            label = one.get("label")
            columns |= columns_of_array(
                label if isinstance(label, str) and label.strip() else f"signal {number}", one["values"]
            )
    return columns, {"time": "s"}


def columns_of_array(name: str, values: Any) -> dict[str, Any]:
    """Return a vector under its name, or each column of a matrix, which is taken along its longer side.

    Parameters
    ----------
    name : str
        What it is called.
    values : ndarray
        Any array.

    Returns
    -------
    dict[str, ndarray]
        Columns by name; none for a single number.

    Examples
    --------
    >>> list(columns_of_array("data", np.zeros((9, 2)))), list(columns_of_array("ans", np.zeros((2, 9))))
    (['data 1', 'data 2'], ['ans 1', 'ans 2'])
    >>> list(columns_of_array("gain", np.array(1.0)))
    []
    """
    if values.size < 2:
        return {}
    if values.ndim == 2 and 1 < values.shape[0] < values.shape[1]:  # as the block To File writes its signals
        values = values.T
    if values.ndim == 2 and values.shape[1] < values.shape[0] and values.shape[1] <= MOST_COLUMNS:
        return {f"{name} {place + 1}": values[:, place] for place in range(values.shape[1])}
    return {name: values}


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
            raise LogError(f"a MATLAB field name is needed (63 letters, digits, _), got {name!r}", source)
    struct = {STRUCT: {**columns, METADATA: metadata}}
    savemat(cast(Any, file), struct, long_field_names=True, oned_as="column", do_compression=True)
