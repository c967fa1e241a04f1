"""Detects the format of a log file by its first bytes, and opens it as tables."""

import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from plant.arrays import Array
from plant.errors import HydrostateError, LogError, NoMemoryError
from plant.log.columns import Column
from plant.log.formats.csv import open_csv
from plant.log.formats.packed import require_regular
from plant.log.formats.repeated_clocks import without_repeated_clocks
from plant.log.formats.split_seconds import with_joined_seconds
from plant.log.table import Table

SIGNS: Mapping[bytes, str] = {
    b"PAR1": "parquet",
    b"ARROW1": "feather",
    b"FEA1": "feather",
    b"TDSm": "tdms",
    b"MDF     ": "mdf",
    b"UnFinMF ": "mdf",
    b"\x89HDF\r\n\x1a\n": "hdf5",
    b"PK\x03\x04": "xlsx",
    b"\xd0\xcf\x11\xe0": "xls",
    b"\x1f\x8b": "csv",
    b"\x28\xb5\x2f\xfd": "csv",
    b"|CF,": "famos",
    b"#ROSBAG": "bag",
    b"\x89MCAP": "bag",
    b"LOGG": "blf",
    b"SQLite format 3": "sqlite",
    b"\x93NUMPY": "numpy",
    b"\x80\x03": "pickle",
    b"\x80\x04": "pickle",
    b"\x80\x05": "pickle",
}
"""First bytes of each format; what has none of them is text, or a MAT."""

READERS: Mapping[str, str] = {
    "parquet": "plant.log.formats.parquet:open_parquet",
    "feather": "plant.log.formats.parquet:open_feather",
    "tdms": "plant.log.formats.tdms:open_tdms",
    "mdf": "plant.log.formats.mdf:open_mdf",
    "hdf5": "plant.log.formats.hdf5:open_hdf5",
    "xlsx": "plant.log.formats.xlsx:open_xlsx",
    "mat": "plant.log.formats.mat:open_mat",
    "numpy": "plant.log.formats.numpy_files:open_npy",
    "npz": "plant.log.formats.numpy_files:open_npz",
    "json": "plant.log.formats.json_text:open_json",
}
"""What opens each; imported when a file of the kind comes."""

SUFFIXES: Mapping[str, str] = {
    **{f".{kind}": kind for kind in ("parquet", "mat", "feather", "tdms", "mdf", "hdf5", "xlsx", "xls")},
    ".mf4": "mdf",
    ".h5": "hdf5",
    ".xlsm": "xlsx",
}
"""Formats that a damaged file is taken for by its suffix; all others are text."""

OLD_EXCEL = "a workbook of Excel before 2007 (.xls), or one that is encrypted, cannot be read: save it as .xlsx or .csv"


REFUSED: Mapping[str, str] = {
    "xls": OLD_EXCEL,
    "pickle": "a pickle may run any program when it is read, so it is not read: save the log as .parquet or .csv",
    "famos": "a file of imc FAMOS cannot be read: export it as CSV, MAT, TDMS or MDF",
    "bag": "a bag of ROS cannot be read: write its topics as CSV or Parquet",
    "blf": "a log of a bus by Vector (.blf) cannot be read: convert its signals to MDF or CSV",
    "sqlite": "a database cannot be read: export the table that holds the log as CSV or Parquet",
    "markup": "a file of XML or HTML cannot be read: export the log as CSV, XLSX or TDMS",
    "frames": "raw frames of a bus cannot be read: decode them with the description of its signals (DBC, ARXML), and "
    "export these as CSV, MDF or Parquet",
    "ods": "a sheet of OpenDocument (.ods) cannot be read: save it as .xlsx or .csv",
}
"""Formats that are known and not read, and what to do."""


FRAMES = re.compile(
    rb";\$FILEVERSION=|date [^\r\n]*\r?\n\s*base\s+(?:hex|dec)\b|\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]{3,8}##?[0-9A-Fa-f]",
    re.IGNORECASE,
)
"""How traces of a bus begin as text: of PCAN-View, of Vector (.asc), and of candump."""


def format_of(path: Path) -> str:
    """Return the format of a file.

    Raises
    ------
    LogError
        If it is empty, or no regular file.
    OSError
        If it cannot be read.
    """
    require_regular(path)
    with path.open("rb") as file:
        start = file.read(520)
    if not start:
        raise LogError("a header line is needed, but the file is empty", str(path))
    for sign, kind in SIGNS.items():
        if start.startswith(sign):
            return _format_in_zip(path) if kind == "xlsx" else kind
    if start[512:].startswith(b"\x89HDF"):
        return "hdf5"
    if start[126:128] in (b"IM", b"MI") and (start.startswith(b"MATLAB") or start[124:125] in (b"\x00", b"\x01")):
        return "mat"
    if b"\0" in start[:4]:  # as in the first integer of a MAT of version 4
        from plant.log.formats.mat4_reader import is_version_4

        if is_version_4(start):
            return "mat"
    return _by_suffix(path, start)


def _format_in_zip(path: Path) -> str:
    """Return the format of a zip archive: NumPy arrays, an OpenDocument sheet, or otherwise Excel."""
    try:
        with ZipFile(path) as archive:
            names = archive.namelist()
            if "mimetype" in names and b"opendocument" in archive.open("mimetype").read(200):
                return "ods"
    except (BadZipFile, OSError, NotImplementedError, RuntimeError, ValueError, KeyError, zlib.error, EOFError):
        return "xlsx"
    return "npz" if names and all(name.endswith(".npy") for name in names) else "xlsx"


def _by_suffix(path: Path, start: bytes) -> str:
    """Return the format of a file by its suffix, if its first bytes do not identify it and it is not text."""
    kind = SUFFIXES.get(path.suffix.lower(), "csv")
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    if kind == "csv" and re.match(rb"<(?:\?xml|!doctype|html|table)\b", text, re.IGNORECASE):
        return "markup"
    if kind == "csv" and FRAMES.match(text):
        return "frames"
    if kind == "csv" and re.match(rb'\{\s*"|\[\s*[\[{]', text):
        return "json"
    return kind if b"\0" in start or kind in ("mat", "xls") else "csv"


def open_tables(path: Path, metadata: str | None = None) -> tuple[Table, ...]:
    """Open a log file.

    Parameters
    ----------
    metadata : str or None
        What stands in a file beside it.

    Returns
    -------
    tuple of Table
        One a clock in the file.

    Raises
    ------
    LogError
        If it is of no format that is read, damaged, or larger than a log is.
    """
    kind = "log"
    try:
        kind = format_of(path)
        if kind in REFUSED:
            raise LogError(REFUSED[kind], str(path))
        if kind == "csv":
            return (_with_one_clock(_with_clear_errors(open_csv(path, metadata), kind, path)),)
        module, _, name = READERS[kind].partition(":")
        reader: Callable[[Path], Table | tuple[Table, ...]] = getattr(import_module(module), name)
        made = reader(path)
        opened = made if isinstance(made, tuple) else (made,)
        return tuple(_with_one_clock(_with_clear_errors(one, kind, path)) for one in opened)
    except BaseException as error:
        raise refusal(error, kind, path) from error


def _with_one_clock(table: Table) -> Table:
    return without_repeated_clocks(with_joined_seconds(table))


def _with_clear_errors(table: Table, kind: str, path: Path) -> Table:
    """Return a table that refuses damaged columns with a clear error."""

    def read(columns: Sequence[Column]) -> dict[Column, Array]:
        try:
            return table.read(columns)
        except BaseException as error:
            raise refusal(error, kind, path) from error

    return replace(table, read=read)


def refusal(error: BaseException, kind: str, path: Path) -> BaseException:
    """Return the error that a user sees for an exception of a file reader. A damaged file may raise any exception.

    Parameters
    ----------
    kind : str
        The format.
    """
    if isinstance(error, HydrostateError) or not isinstance(error, Exception | MemoryError):
        panicked = type(error).__name__ == "PanicException"  # raised by a library in Rust for a damaged file
        return LogError(f"cannot be read as {kind}", str(path)) if panicked else error
    if isinstance(error, PermissionError):
        return LogError("there is no permission to read it", str(path))
    lacking = "it lacks " if isinstance(error, LookupError) else ""
    said = lacking + (" ".join(re.sub(r" at 0x[0-9a-f]+", "", str(error)).split())[:200] or type(error).__name__)
    if isinstance(error, MemoryError):
        return NoMemoryError(f"reading it as {kind} needs more memory than there is ({said})", str(path))
    return LogError(f"cannot be read as {kind}: {said}", str(path))
