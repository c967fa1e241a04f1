"""A growing store of rows: Parquet parts, each complete or absent, a manifest, and the study's cases in order.

manifest.json the study, its hash, versions, commit, seeds cases.parquet the keys of the study's cases, in order
parts/<hash>.parquet rows; named by the keys that they hold, so that a part written twice is one part set-aside/ parts
that could not be read, whose cases are run again

A part is never changed. Rows from cases of an earlier version of the study are kept, and are used again if those cases
return. The store can be read while it is being written.
"""

import hashlib
import json
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from experiments.batch.folder import LOCK, TEMPORARY, Folder, open_folder
from experiments.batch.rows import SCHEMA
from experiments.page.folder import DESKTOP_FILES
from experiments.running.refusal import os_errors_as, reason_of
from plant.errors import HydrostateError

FORMAT = 1
"""Version of the layout above."""

MANIFEST, CASES, PARTS, SET_ASIDE = "manifest.json", "cases.parquet", "parts", "set-aside"


class PartStore:
    """A store of rows."""

    def __init__(self, folder: Folder) -> None:
        self.folder = folder

    @property
    def name(self) -> str:
        """The place as the user gave it."""
        return self.folder.name

    @contextmanager
    def writing(self) -> Generator[None]:
        """Hold the right to write; first remove files that a killed writer left behind.

        Raises
        ------
        HydrostateError
            If the folder holds what no batch wrote, cannot be written, or another process is writing.
        """
        with os_errors_as(f"store {self.name} cannot be written"):
            self._check()
            with self.folder.writer():
                self._tidy()
                yield

    def clear(self) -> None:
        """Remove every part."""
        with os_errors_as(f"store {self.name} cannot be written"):
            for name in self._parts():
                self.folder.remove(f"{PARTS}/{name}")

    def _tidy(self) -> None:
        """Remove files that a killed writer left; without a lock keep them, as another writer may be using them."""
        if self.folder.locks:
            for below in ("", f"{PARTS}/"):
                for name in self.folder.files(below):
                    if name.endswith(TEMPORARY):
                        self.folder.remove(below + name)

    def describe(self, manifest: Mapping[str, Any], keys: Sequence[str]) -> None:
        """Write the manifest and the study's cases.

        Parameters
        ----------
        manifest : Mapping[str, Any]
            The study, and everything needed to run it again.
        keys : sequence of str
            Keys of the study's cases, in order.

        Raises
        ------
        HydrostateError
            If it cannot be written.
        """
        with os_errors_as(f"store {self.name} cannot be written"):
            self.folder.write(CASES, _parquet(pa.table({"key": pa.array(keys, pa.string())})))
            text = json.dumps({"format": FORMAT, **manifest}, indent=2, allow_nan=False) + "\n"
            self.folder.write(MANIFEST, text.encode())

    def add(self, part: bytes, keys: Sequence[str]) -> None:
        """Add a part.

        Raises
        ------
        HydrostateError
            If it cannot be written.
        """
        digest = hashlib.sha256("".join(keys).encode()).hexdigest()[:24]
        with os_errors_as(f"store {self.name} cannot be written"):
            self.folder.write(f"{PARTS}/{digest}.parquet", part)

    def manifest(self) -> Mapping[str, Any] | None:
        """Return the last written manifest of the study, or None if there is none.

        Raises
        ------
        HydrostateError
            If it cannot be read, or is of a format that this version does not know.
        """
        try:
            content = json.loads(self.folder.read(MANIFEST))
            known = content["format"]
        except FileNotFoundError:
            return None
        except OSError as error:
            raise HydrostateError(f"store {self.name} cannot be read: {reason_of(error)}") from error
        except (ValueError, KeyError, TypeError) as error:
            way = "; delete it, and the same command goes on from the parts" if self._parts() else ""
            raise HydrostateError(f"store {self.name}: {MANIFEST} is not one of a batch study{way}") from error
        if known != FORMAT:
            raise HydrostateError(f"store {self.name} must be of format {FORMAT}, got {known!r}")
        return content

    def done(self, *, again: bool = False) -> tuple[set[str], list[str]]:
        """Return the keys in the store; parts that cannot be read are set aside.

        Parameters
        ----------
        again : bool
            Whether failed cases count as not done.

        Returns
        -------
        tuple of set and list of str
            Keys, and the names of parts that were set aside.
        """
        keys: set[str] = set()
        broken: list[str] = []
        for name in self._parts():
            try:
                table = self._read(name, None)
            except FileNotFoundError:
                continue
            except (pa.ArrowException, OSError, KeyError):
                with os_errors_as(f"store {self.name} cannot be written"):
                    self.folder.move(f"{PARTS}/{name}", f"{SET_ASIDE}/{name}")
                broken.append(name)
                continue
            if again:
                table = table.filter(pc.invert(_failed(table)))
            keys.update(_column_values(table, "key"))
        return keys, broken

    def rows(self, columns: Sequence[str] | None = None) -> pa.Table:
        """Return the rows of the study's finished cases, in the study's order, one row for each case.

        Parameters
        ----------
        columns : sequence of str, optional
            The columns wanted; all by default.

        Returns
        -------
        pyarrow.Table
            The rows. A part that cannot be read counts as absent.

        Raises
        ------
        HydrostateError
            If there is no store.
        """
        wanted = list(SCHEMA.names if columns is None else columns)
        read = list(dict.fromkeys([*wanted, "key", "outcome"]))
        try:
            order = _column_values(_table(self.folder.read(CASES)), "key")
        except (OSError, pa.ArrowException) as error:
            raise HydrostateError(f"store {self.name}: there is no batch study there, or it cannot be read") from error
        place = {key: number for number, key in enumerate(order)}
        tables = [_with_places(table, place) for table in self._readable_parts(read)]
        if not tables:
            return SCHEMA.empty_table().select(wanted)
        table = pa.concat_tables(tables).sort_by([("place", "ascending"), ("failed", "ascending")])
        kept = _first_places(_column_values(table, "place"))
        return table.take(kept).select(wanted).combine_chunks()

    def _readable_parts(self, columns: list[str]) -> Iterable[pa.Table]:
        for name in self._parts():
            try:
                yield self._read(name, columns)
            except (pa.ArrowException, OSError, KeyError):  # another process may have just set it aside
                continue

    def _read(self, name: str, columns: list[str] | None) -> pa.Table:
        schema = None if columns is None else SCHEMA  # a part older than a column has no values in it
        content = self.folder.read(f"{PARTS}/{name}")
        return _table(content, columns=columns, schema=schema, page_checksum_verification=True)

    def _parts(self) -> list[str]:
        return [name for name in self.folder.files(PARTS) if name.endswith(".parquet")]

    def _check(self) -> None:
        """Refuse a folder with other content; a store without a manifest is recognised by its cases and parts."""
        if self.manifest() is not None or (CASES in self.folder.files() and self._parts()):
            return
        strangers = [
            name
            for name in self.folder.files()
            if name not in (LOCK, CASES, *DESKTOP_FILES) and not name.endswith(TEMPORARY)
        ]
        if strangers:
            raise HydrostateError(
                f"store {self.name} must be new, empty, or a batch study's, and it holds {strangers[0]}: choose another"
            )


def open_store(place: str | Path) -> PartStore:
    """Return the store at a path or a URL; nothing is created yet.

    Parameters
    ----------
    place : str or Path
        A local path, or a URL such as ``s3://bucket/study``.

    Raises
    ------
    HydrostateError
        If the URL cannot be used.
    """
    return PartStore(open_folder(place))


def _parquet(table: pa.Table) -> bytes:
    buffer = BytesIO()
    pq.write_table(table, buffer, compression="zstd", write_page_checksum=True)
    return buffer.getvalue()


def _with_places(table: pa.Table, place: Mapping[str, int]) -> pa.Table:
    """Return the rows of a part that belong to the study, with their place in it."""
    places = pa.array([place.get(key) for key in _column_values(table, "key")], pa.int64())
    table = table.append_column("place", places).append_column("failed", _failed(table))
    return table.filter(pc.is_valid(table["place"]))


def _table(content: bytes, **how: Any) -> pa.Table:
    # with threads, one may still hold the bytes when the process ends, and Python then aborts (apache/arrow#33975)
    return pq.read_table(BytesIO(content), use_threads=False, **how)


def _column_values(table: pa.Table, column: str) -> list[Any]:
    return table[column].to_pylist()


def _failed(table: pa.Table) -> "pa.ChunkedArray[Any]":
    return pc.equal(table["outcome"], pa.scalar("failed"))  # pyright: ignore -- its stubs know no scalar


def _first_places(places: Sequence[int]) -> list[int]:
    """Return the first place of each number in a sorted list."""
    return [i for i, place in enumerate(places) if i == 0 or place != places[i - 1]]
