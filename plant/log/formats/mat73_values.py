"""Variables of a MAT file of version 7.3, which is HDF5: parts of arrays of structs and cells stand elsewhere in it."""

from collections.abc import Mapping
from itertools import islice
from typing import Any

import numpy as np

from plant.errors import LogError
from plant.log.formats.mat_reader import MatValue
from plant.log.formats.packed import too_large

PARTS = "#refs#"
"""The group that holds what references lead to."""

OBJECT = "MATLAB_object_decode"
"""The attribute of an object of a class, of which only MATLAB knows what its numbers mean."""

DEEPEST, MOST_PARTS = 12, 20_000
"""How deep structs may be nested, and how many parts of them are read [count]; a file may refer to itself."""


def has_parts(h5py: Any, file: Any) -> bool:
    """Return whether variables of a file hold references to their parts.

    Parameters
    ----------
    h5py : module
        The library.
    file : h5py.File
        The file.
    """
    if PARTS not in file:
        return False
    seen: list[str] = []

    def visit(name: str, one: Any) -> bool | None:
        if _refers(h5py, one) and OBJECT not in one.attrs:
            return True
        seen.append(name)
        return False if len(seen) > MOST_PARTS else None

    held = _held(h5py, file)
    return any(
        visit(name, one) is True or (isinstance(one, h5py.Group) and one.visititems(visit) is True)
        for name, one in held.items()
        if not name.startswith("#")
    )


def _held(h5py: Any, group: Any) -> dict[str, Any]:
    """Return what a group itself holds: links may lead to other files."""
    names = list(islice(group, MOST_PARTS))
    return {name: group[name] for name in names if isinstance(group.get(name, getlink=True), h5py.HardLink)}


def _refers(h5py: Any, one: Any) -> bool:
    """Return whether an object is a data set of references."""
    return isinstance(one, h5py.Dataset) and h5py.check_ref_dtype(one.dtype) is h5py.Reference


def variables_with_parts(h5py: Any, file: Any, most: int, source: str) -> dict[str, MatValue]:
    """Return the variables of a file, as `plant.log.formats.mat_reader.read_variables` does.

    Parameters
    ----------
    h5py : module
        The library.
    file : h5py.File
        The file.
    most : int
        What its numbers may take at most [bytes].
    source : str
        What messages call it.

    Returns
    -------
    dict[str, MatValue]
        Variables by name; structs are mappings.

    Raises
    ------
    LogError
        If it has more numbers, or more parts.
    """
    reader = _Reader(h5py, file, most, source)
    found = {name: reader.value(one) for name, one in _held(h5py, file).items() if not name.startswith("#")}
    return {name: value for name, value in found.items() if value is not None}


class _Reader:
    def __init__(self, h5py: Any, file: Any, most: int, source: str) -> None:
        self.h5py, self.file, self.most, self.left, self.parts, self.source = h5py, file, most, most, 0, source

    def value(self, one: Any, depth: int = 0) -> Any:
        """Return a struct as a mapping, an array of structs or cells as a list, text, or numbers; None for others."""
        self.parts += 1
        if self.parts > MOST_PARTS:
            raise LogError(f"structs and cells of more than {MOST_PARTS:,} parts are not read", self.source)
        if depth > DEEPEST:
            return None
        if isinstance(one, self.h5py.Group):
            return self._struct(one, depth)
        if not isinstance(one, self.h5py.Dataset) or OBJECT in one.attrs or one.is_virtual or one.external:
            return None
        if _refers(self.h5py, one):
            return self._each(one, depth)
        if one.shape is None or one.dtype.kind not in "fiub" or "MATLAB_empty" in one.attrs:
            return None
        self.left -= one.size * one.dtype.itemsize
        if self.left < 0:
            raise too_large(self.source, self.most)
        values = np.asarray(one[()]).T
        if one.attrs.get("MATLAB_class") in (b"char", "char"):
            return "".join(chr(letter) for letter in values.ravel(order="F")) if values.dtype.kind in "iu" else None
        return values.ravel() if values.size == max(values.shape, default=0) else values

    def _each(self, one: Any, depth: int) -> list[Any]:
        """Return what the references of a data set lead to."""
        self.left -= one.size * one.dtype.itemsize
        if one.size > MOST_PARTS or self.left < 0:
            raise LogError(f"structs and cells of more than {MOST_PARTS:,} parts are not read", self.source)
        return [self.value(self.file[each] if each else None, depth + 1) for each in np.asarray(one[()]).T.ravel()]

    def _struct(self, group: Any, depth: int) -> Any:
        """Return a struct, or an array of them, of which each field holds a reference to each struct's value."""
        fields = _held(self.h5py, group)
        of_array = [one.size for one in fields.values() if _refers(self.h5py, one) and "MATLAB_class" not in one.attrs]
        values: Mapping[str, Any] = {name: self.value(one, depth + 1) for name, one in fields.items()}
        if len(of_array) == len(fields) and len(set(of_array)) == 1:
            return [{name: many[k] for name, many in values.items() if many[k] is not None} for k in range(of_array[0])]
        return {name: value for name, value in values.items() if value is not None}
