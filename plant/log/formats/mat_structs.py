"""Structs of a MAT file as tables: nested structs with their own time, and arrays of structs."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from plant.log.columns import TIME, TIME_NAMES
from plant.log.formats.mat_reader import MatValue
from plant.log.headings import Heading

NAMES, DATA, UNITS = ("name", "label", "channel"), ("data", "values", "value", "samples", "y"), ("unit", "units")
"""Fields of a struct that is one signal, in lower case: what it is called, its samples, and its unit."""

Struct = Mapping[str, Any]


def structs_of(name: str, value: MatValue) -> dict[str, Struct]:
    """Return a variable as structs by name, one for each table; empty for other variables.

    A nested struct with its own time is a table of its own. An array of structs has one struct for each sample, with
    numeric fields; or one for each signal, with its name and samples; or one for each test.

    Parameters
    ----------
    name : str
        The variable.
    value : ndarray of any shape, str, Mapping or Sequence
        As `plant.log.formats.mat_reader.read_variables` returns it.

    Examples
    --------
    >>> list(structs_of("log", {"fast": {"time_s": np.arange(9.0)}, "bench": "2"}))
    ['log', 'log.fast']
    """
    if isinstance(value, Mapping):
        apart = {f"{name}.{field}": one for field, one in value.items() if isinstance(one, Mapping) and _has_time(one)}
        return {name: {field: one for field, one in value.items() if f"{name}.{field}" not in apart}, **apart}
    each = each_struct(value)
    if not each:
        return {}
    return (
        _from_sample_structs(name, each)
        or _from_signal_structs(name, each)
        or {f"{name}({k})": one for k, one in enumerate(each, 1)}
    )


def as_signal(name: str, struct: Struct) -> Struct:
    """Return a struct that holds the time and the samples of one signal under the signal's name; others as they are.

    Structs of MATLAB's time series, and of programs that copy them, call the samples of each signal ``Data``.

    Parameters
    ----------
    name : str
        What the struct is called, with those around it: ``log.position``.
    struct : Mapping[str, Any]
        The struct.

    Examples
    --------
    >>> list(as_signal("log.position", {"Time": np.arange(9.0), "Data": np.ones(9), "Name": ""}))
    ['Time', 'position']
    """
    vectors = {field: value for field, value in struct.items() if _is_vector(value)}
    times = [field for field in vectors if _has_time({field: vectors[field]})]
    samples = [field for field in vectors if field.lower() in DATA[:-1]]  # y beside t is a name of its own
    if len(vectors) != 2 or len(times) != 1 or len(samples) != 1 or not name:
        return struct
    said = _first_field(struct, NAMES)
    called = said if isinstance(said, str) and said.strip() else name.rpartition(".")[2]
    time, unit = (_unit_in(_first_field(struct, (info,))) for info in ("timeinfo", "datainfo"))
    labels = _with_unit(times[0], time), _with_unit(called, _unit_in(struct) or unit)
    return {label: np.ravel(vectors[one]) for label, one in zip(labels, (*times, *samples), strict=True)}


def _unit_in(struct: Any) -> str:
    """Return the unit that a struct states; empty if it states none."""
    said = _first_field(struct, UNITS) if isinstance(struct, Mapping) else None
    return said.strip() if isinstance(said, str) else ""


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def each_struct(value: MatValue) -> list[Struct]:
    """Return the structs of an array, or a single struct; empty for anything else.

    Parameters
    ----------
    value : ndarray of any shape, str, Mapping or Sequence
        A variable.
    """
    many: Any = [value] if isinstance(value, Mapping) else value if isinstance(value, Sequence) else []
    return [one for one in many if isinstance(one, Mapping)]


def _has_time(struct: Struct) -> bool:
    return any(_is_vector(value) and Heading(name).stem in (*TIME_NAMES, TIME) for name, value in struct.items())


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.size > 1


def _from_sample_structs(name: str, each: Sequence[Struct]) -> dict[str, Struct]:
    """Return an array with one struct for each sample as one struct of columns; empty for other arrays."""
    numbers = [key for key, value in each[0].items() if isinstance(value, np.ndarray) and value.size == 1]
    if not numbers or any(key not in one or np.size(one[key]) != 1 for one in each for key in numbers):
        return {}
    if any(_is_vector(value) for one in each for value in one.values()):
        return {}
    return {name: {key: np.array([np.ravel(one[key])[0] for one in each]) for key in numbers}}


def _from_signal_structs(name: str, each: Sequence[Struct]) -> dict[str, Struct]:
    """Return an array with one struct for each signal as tables, split by time; empty for other arrays."""
    found: dict[str, Struct] = {}
    together: dict[str, Any] = {}
    for place, one in enumerate(each, start=1):
        said = {kind: _first_field(one, names) for kind, names in (("name", NAMES), ("data", DATA), ("unit", UNITS))}
        if not isinstance(said["name"], str) or not _is_vector(said["data"]):
            return {}
        unit = said["unit"]
        label = f"{said['name']} [{unit}]" if isinstance(unit, str) and unit.strip() else said["name"]
        times = {field: np.ravel(value) for field, value in one.items() if _has_time({field: value})}
        # a repeated name gets a table of its own, and the reader of the log chooses between them
        if times or label in together:
            found[f"{name}({place})"] = {**times, label: np.ravel(said["data"])}
        else:
            together[label] = np.ravel(said["data"])
    return {name: together, **found} if together else found


def _first_field(struct: Struct, names: Sequence[str]) -> Any:
    return next((value for field, value in struct.items() if field.lower() in names), None)
