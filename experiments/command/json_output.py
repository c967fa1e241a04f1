"""Results as one JSON document and one table: the contract for other programs.

Every command prints a list with one object per log, in which an unknown number is null. Later versions add entries and
never rename them.
"""

import csv
import io
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, TypeAlias

from experiments.command.output_paths import FILE_ENDINGS, require_no_log
from experiments.running.refusal import os_errors_as
from plant.atomic import replacing
from plant.errors import HydrostateError

Result: TypeAlias = Mapping[str, Any]
"""Results of one log, by entry of the JSON contract."""


def plain(value: object) -> Any:
    """Return a value as a JSON value; a number that is not finite becomes None.

    Returns
    -------
    object
        None, bool, int, float, str, list or dict.

    Examples
    --------
    >>> plain({"value": float("nan"), "ci95": (1.0, float("inf"))})
    {'value': None, 'ci95': [1.0, None]}
    """
    if isinstance(value, Enum):
        return plain(value.value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, Sequence | set | frozenset):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # a NumPy array or scalar; help texts need not import NumPy
        return plain(value.tolist())  # pyright: ignore[reportAttributeAccessIssue] -- asked for above
    return str(value)


def json_text(results: Sequence[Result]) -> str:
    """Return results as one JSON document, in ASCII so that any terminal or pipe can carry it."""
    return json.dumps(plain(list(results)), indent=2, allow_nan=False)


def flat(result: Result, prefix: str = "") -> dict[str, Any]:
    """Return nested entries as one row of a table; a nested value is named like ``bulk_modulus_pa.value``.

    Returns
    -------
    dict[str, Any]
        Numbers, text and None by dotted name; a list is written as JSON.

    Examples
    --------
    >>> flat({"gate": {"passed": True, "reasons": ["a"]}})
    {'gate.passed': True, 'gate.reasons': '["a"]'}
    """
    row: dict[str, Any] = {}
    for name, value in plain(result).items():
        if isinstance(value, dict):
            row |= flat(value, f"{prefix}{name}.")
        else:
            row[prefix + name] = json.dumps(value) if isinstance(value, list) else value
    return row


def csv_text(results: Iterable[Result]) -> str:
    """Return results as a CSV table, one row per log.

    Returns
    -------
    str
        The table; an entry that a log does not have is empty.
    """
    rows = [{name: _harmless(value) for name, value in flat(result).items()} for result in results]
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _harmless(value: Any) -> Any:
    """Return a cell that no spreadsheet interprets as a formula: text that starts like one gets an apostrophe."""
    return f"'{value}" if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")) else value


_IN_FOLDER = ("results.json", "results.csv")
"""Files written into a results folder."""


def prepare_output(out: Path | None, logs: Iterable[Path] = ()) -> None:
    """Create the folder for the results before any work is done.

    Parameters
    ----------
    out : Path or None
        A folder, or a file that ends in ``.json``; None writes nothing.
    logs : iterable of Path
        Files to read, which must not be overwritten.

    Raises
    ------
    HydrostateError
        If the name belongs to another file or to a log, or the folder cannot be created or written.
    """
    if out is None:
        return
    if out.suffix.lower() in FILE_ENDINGS and not out.is_dir():
        raise HydrostateError(f"--out must be a folder, or a file that ends in .json, got {str(out)!r}")
    folder = _folder(out)
    with os_errors_as(f"--out {out}: the folder cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise HydrostateError(f"--out {out}: there is no permission to write there")
    if out != folder and out.is_dir():
        raise HydrostateError(f"--out {out}: a file is needed, got a folder")
    require_no_log(f"--out {out}", [out] if out != folder else [out / name for name in _IN_FOLDER], logs)


def write_results(results: Sequence[Result], out: Path) -> list[Path]:
    """Write results; a reader sees the old file or the complete new one, never a part.

    Parameters
    ----------
    out : Path
        A folder, which receives ``results.json`` and ``results.csv``; or a file that ends in ``.json``.

    Raises
    ------
    HydrostateError
        If they cannot be written.
    """
    texts = {out: json_text(results) + "\n"}
    if out == _folder(out):
        texts = dict(zip((out / name for name in _IN_FOLDER), (texts[out], csv_text(results)), strict=True))
    for path, text in texts.items():
        write_whole(path, text)
    return list(texts)


def write_whole(path: Path, text: str, option: str = "", *, parents: bool = False) -> None:
    """Write a file; no partial file is left behind.

    Raises
    ------
    HydrostateError
        If it cannot be written.
    """
    with os_errors_as(f"{option} {path}: cannot be written".lstrip()):
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(text.encode(errors="replace"))


def _folder(out: Path) -> Path:
    return out.parent if out.suffix.lower() == ".json" else out
