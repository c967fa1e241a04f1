"""HDF5 logs, including MAT 7.3: vectors in groups, columns of a matrix, or fields of a table."""

from collections import defaultdict
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import LogError
from plant.log.formats.extras import library
from plant.log.formats.mat import METADATA, NO_VECTORS, STRUCT, columns_of_array, tables_of
from plant.log.formats.mat73_values import OBJECT, has_parts, variables_with_parts
from plant.log.formats.packed import most_unpacked, too_large
from plant.log.table import Table, table_of

UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "UNIT")
LONGEST_NAME = 1000
"""Bytes of the longest name that stands beside a data set."""

NAME_ATTRIBUTES = ("columns", "names", "column_names", "channels")

PACKING_ATTRIBUTES = ("_FillValue", "missing_value", "scale_factor", "add_offset")
"""How netCDF says that numbers are packed: what stands for none, and what they are multiplied by and added to."""

SCALE_ATTRIBUTES = ("scale", "scaling", "factor", "slope", "multiplier", "gain", "conversion", "resolution", "lsb")
OFFSET_ATTRIBUTES = ("offset", "intercept")
"""How programs state the scale of counts, in lower case; none of them says whether it is applied already."""

IN_OTHER_FILES = (
    "its numbers are stored in other files (as virtual or external data sets), which are not read; copy them into it"
)
"""A file may name any other one, also one that its sender may not read, or itself, which crashes the library."""

MOST_OBJECTS = 10_000
"""Groups and vectors of the largest file that is read."""


def open_hdf5(path: Path) -> tuple[Table, ...]:
    """Open an HDF5 file, or a MAT of version 7.3.

    Returns
    -------
    tuple of Table
        One a group.

    Raises
    ------
    LogError
        If h5py is not installed, or there is no vector of numbers.
    """
    h5py = library("h5py", "HDF5 and MAT 7.3", str(path))
    most = left = most_unpacked(path.stat().st_size)
    groups: dict[str, dict[str, Any]] = defaultdict(dict)
    units: dict[str, dict[str, str | None]] = defaultdict(dict)
    scales: dict[str, dict[str, tuple[float, float]]] = defaultdict(dict)
    texts: dict[str, str] = {}
    elsewhere = False
    with h5py.File(path, "r") as file:
        if has_parts(h5py, file):
            return tables_of(variables_with_parts(h5py, file, most, str(path)), str(path))
        for name, one in _data_sets(h5py, file):
            if OBJECT in one.attrs:
                continue
            group, _, leaf = name.rpartition("/")
            if one.is_virtual or one.external:
                elsewhere = True
                continue
            if _attribute(one, "MATLAB_class") == "char":
                if leaf == METADATA:
                    texts[group] = _text(one, most, str(path))
                continue
            if not _holds_numbers(one):
                continue
            left -= one.size * one.dtype.itemsize
            if left < 0:
                raise too_large(str(path), most)
            for column, values in _columns(one, leaf).items():
                groups[group][column] = values
                if (scale := _stated_scale(one)) is not None:
                    scales[group][column] = scale
                said = next((said for key in UNIT_ATTRIBUTES if (said := _attribute(one, key))), None)
                units[group][column] = said.split(" since ")[0] if said else None  # netCDF clocks: "s since 1970"
    if STRUCT in groups and STRUCT in texts:
        groups = defaultdict(dict, {STRUCT: groups[STRUCT]})
    if not any(groups.values()):
        if elsewhere:
            raise LogError(IN_OTHER_FILES, str(path))
        raise LogError(NO_VECTORS if path.suffix.lower() == ".mat" else "it holds no vector of numbers", str(path))
    return tuple(
        table_of(str(path), columns, units=units[group], scales=scales[group], metadata=texts.get(group), label=group)
        for group, columns in groups.items()
    )


def _data_sets(h5py: Any, file: Any) -> Iterator[tuple[str, Any]]:
    """Return each data set under each of its names. It may have several, and groups may be nested."""
    waiting, entered, count = [("", file)], set[int](), 0
    while waiting:
        name, one = waiting.pop()
        count += 1
        if isinstance(one, h5py.Dataset):
            yield name, one
        elif isinstance(one, h5py.Group) and (place := h5py.h5o.get_info(one.id).addr) not in entered:
            entered.add(place)
            within = [each for each in islice(one, MOST_OBJECTS) if not (one is file and each.startswith("#"))]
            hard = [each for each in sorted(within) if isinstance(one.get(each, getlink=True), h5py.HardLink)]
            waiting += [(f"{name}/{each}".lstrip("/"), one[each]) for each in reversed(hard)]
        if count == MOST_OBJECTS:
            return


def _holds_numbers(one: Any) -> bool:
    return one.shape is not None and one.size > 0 and (one.dtype.kind in "fiub" or one.dtype.names is not None)


def _columns(one: Any, leaf: str) -> dict[str, Any]:
    """Return the columns of a numeric data set."""
    kind, values = one.dtype, _with_netcdf_scaling(one, np.asarray(one[()]))
    if kind.names is not None:
        if values.ndim != 1:
            return {}
        found: dict[str, Any] = {}
        for name in kind.names:
            if kind[name].base.kind in "fiub":
                found |= columns_of_array(name, values[name]) if kind[name].shape else {name: values[name]}
        return found
    values = values.squeeze()
    if values.ndim == 2 and _attribute(one, "MATLAB_class"):
        values = values.T  # MATLAB stores arrays in column order
    named = columns_of_array(leaf, values)
    names = _names(one)
    return dict(zip(names, named.values(), strict=True)) if len(names) == len(named) > 1 else named


def _with_netcdf_scaling(one: Any, values: Any) -> Any:
    """Return values with the netCDF conventions applied: missing value, scale and offset."""
    told = {name: _number(one, name) for name in PACKING_ATTRIBUTES}
    if values.dtype.names is not None or not any(number is not None for number in told.values()):
        return values
    missing = [number for name in PACKING_ATTRIBUTES[:2] if (number := told[name]) is not None]
    scale, offset = (
        (1.0 if told[PACKING_ATTRIBUTES[2]] is None else told[PACKING_ATTRIBUTES[2]]),
        told[PACKING_ATTRIBUTES[3]] or 0.0,
    )
    return np.where(np.isin(values, missing), np.nan, scale * values.astype(float) + offset)


def _stated_scale(one: Any) -> tuple[float, float] | None:
    """Return factor and offset that attributes of whole numbers state; None if they state none, or none but 1 and 0."""
    if one.dtype.kind not in "iu":
        return None
    names = {name.lower(): name for name in one.attrs}
    found = [
        next((said for key in keys if key in names and (said := _number(one, names[key])) is not None), neutral)
        for keys, neutral in ((SCALE_ATTRIBUTES, 1.0), (OFFSET_ATTRIBUTES, 0.0))
    ]
    return None if found == [1.0, 0.0] else (found[0], found[1])


def _number(one: Any, name: str) -> float | None:
    """Return an attribute that is one finite number; None for others."""
    try:
        value = np.asarray(one.attrs.get(name))
    except (OSError, KeyError, TypeError, ValueError):
        return None
    if value.size != 1 or value.dtype.kind not in "fiu" or not np.isfinite(value.reshape(-1)[0]):
        return None
    return float(value.reshape(-1)[0])


def _attribute(one: Any, name: str) -> str:
    """Return an attribute as text; empty if there is none."""
    try:
        value = one.attrs.get(name)
    except (OSError, KeyError, TypeError):
        return ""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if isinstance(value, bytes):
        return value.decode(errors="replace").strip()
    return value.strip() if isinstance(value, str) else ""


def _names(one: Any) -> list[str]:
    """Return the names that a data set, or pandas beside it, gives its columns; empty if there are none."""
    leaf = str(one.name).rpartition("/")[2]
    beside = leaf.removesuffix("_values") + "_items"
    if leaf.endswith("_values") and type(one.parent.get(beside, getlink=True)).__name__ == "HardLink":
        items = one.parent[beside]
        kind, shape = getattr(items, "dtype", None), getattr(items, "shape", None)
        if kind is not None and kind.kind == "S" and kind.itemsize <= LONGEST_NAME and shape == one.shape[-1:]:
            return [each.decode(errors="replace") for each in np.asarray(items[()])]
    for name in NAME_ATTRIBUTES:
        value = one.attrs.get(name)
        if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "OSU":
            return [each.decode(errors="replace") if isinstance(each, bytes) else str(each) for each in value]
    return []


def _text(one: Any, most: int, source: str) -> str:
    if 2 * one.size > most:
        raise too_large(source, most)
    letters = np.asarray(one[()]).reshape(-1)
    return letters.astype("<u2").tobytes().decode("utf-16-le", errors="replace") if letters.dtype.kind in "iu" else ""
