"""JSON logs: rows as objects, one on a line or in a list; rows as lists below their names; or an object of columns."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from plant.errors import LogError
from plant.log.formats.packed import open_unpacked
from plant.log.table import Table, table_of

MOST_PARTS = 8_000_000
"""Lists and objects of the largest file that is read: each takes some hundred bytes, however few its letters."""

DEEPEST = 5
"""How many objects within each other are read as columns [count]."""

READABLE_FORMS = (
    "JSON is read as one object a row (a list of them, or one a line), or as one object with a list a column; "
    "save the log as .csv or .parquet"
)


def open_json(path: Path) -> Table:
    """Open a log in JSON.

    Raises
    ------
    LogError
        If it is no table, no JSON, or has more parts than a log.
    """
    with open_unpacked(path) as file:
        content = file.read()
    if content.count(b"[") + content.count(b"{") > MOST_PARTS:
        raise LogError(f"it has more than {MOST_PARTS} lists and objects; save the log as .csv or .parquet", str(path))
    text = content.decode("utf-8-sig", errors="replace")
    del content
    columns = _columns(_document(text, str(path)))
    if not columns:
        raise LogError(READABLE_FORMS, str(path))
    return table_of(str(path), {name: _array(values) for name, values in columns.items()})


def _document(text: str, source: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        pass
    rows: list[Any] = []
    lines = [line for line in text.splitlines() if line.strip()]
    for place, line in enumerate(lines):
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError as error:
            if place == len(lines) - 1 > 0:  # a logger that is switched off leaves an incomplete last line
                break
            raise LogError(f"{READABLE_FORMS} (line {place + 1} is no JSON: {error.msg})", source) from error
    return rows


def _columns(document: Any) -> dict[str, list[Any]]:
    if isinstance(document, Mapping):
        lists = {str(name): values for name, values in document.items() if isinstance(values, list)}
        lengths = {len(values) for values in lists.values()}
        if {"columns", "data"} <= lists.keys():  # as pandas splits a table
            return _columns([lists["columns"], *lists["data"]])
        if not lists and document and all(isinstance(one, Mapping) for one in document.values()):
            return _columns_of_objects(document)
        if len(lists) == 1 and (inner := _columns(next(iter(lists.values())))):
            return inner
        return lists if len(lengths) == 1 else {}
    if not isinstance(document, Sequence) or isinstance(document, str) or not document:
        return {}
    if all(isinstance(row, Mapping) for row in document):
        rows = [_flat(row) for row in document]
        names = dict.fromkeys(name for row in rows for name in row)
        return {name: [row.get(name) for row in rows] for name in names}
    first = document[0]
    if isinstance(first, list) and all(isinstance(row, list) and len(row) == len(first) for row in document):
        named = all(isinstance(cell, str) for cell in first)
        names = [str(cell) for cell in first] if named else [f"column {place + 1}" for place in range(len(first))]
        rows = document[1:] if named else document
        return {name: [row[place] for row in rows] for place, name in enumerate(names)}
    return {}


def _columns_of_objects(document: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return the columns of an object of objects, as pandas writes tables: rows have numbers, columns have names."""
    inner = dict.fromkeys(str(name) for one in document.values() for name in one)
    if inner and all(name.lstrip("-").isdigit() for name in inner):
        return {str(name): [one.get(row) for row in inner] for name, one in document.items()}
    return _columns(list(document.values())) if all(str(name).lstrip("-").isdigit() for name in document) else {}


def _flat(row: Mapping[str, Any], above: str = "", depth: int = 0) -> dict[str, Any]:
    """Return an object with the members of those within it, as ``outer.inner``."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        deeper = isinstance(value, Mapping) and depth < DEEPEST
        found |= _flat(value, f"{above}{name}.", depth + 1) if deeper else {f"{above}{name}": value}
    return found


def _array(values: list[Any]) -> Any:
    """Return a column as numbers, with NaN for null; unchanged if it holds other values."""
    if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
        return np.array([np.nan if value is None else float(value) for value in values])
    made = np.empty(len(values), dtype=object)
    made[:] = values
    return made
