"""Complete files that are valid but unusual: each is read as it was written, or refused in a sentence.

Run it as ``python -m tests.fuzz.legal_files 2000 [FIRST]``; a file read wrongly is reported with its format and seed.
"""

import gzip
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from decimal import Decimal
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from plant.log.files import read_record
from tests.fuzz.guard import limited
from tests.fuzz.legal_signals import TIME, Channels, Written, heading, spelt, truth, wrong

Later = Mapping[str, int]
Make = Callable[[Channels, np.random.Generator, Path], tuple[Path, Later]]

KEPT = (32, 42, 217)
"""Seeds of TDMS files in which the first channel of a group has an offset, which was once applied to the others."""


def drawn(rng: np.random.Generator, *choices: Any) -> Any:
    """Return one of several values at random."""
    return choices[int(rng.integers(len(choices)))]


def text(log: Channels, rng: np.random.Generator, folder: Path) -> tuple[Path, Later]:
    """Write text: delimiters and decimal signs, number formats, quotes, preambles, encodings, compression."""
    cell, decimal = drawn(rng, (",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ","), ("|", "."))
    form, style = drawn(rng, "{!r}", "{:.12e}", "{:.9f}", "{:+.12e}", "{:18.9f}"), drawn(rng, "[", "(", "suffix")
    columns = spelt(log, rng)
    table = zip(*(one.values for one in columns), strict=True)
    rows = [[form.format(float(x)).replace(".", decimal) for x in row] for row in table]
    names = [heading(one, style) for one in columns]
    if rng.random() < 0.4:
        place = int(rng.integers(len(names) + 1))
        names.insert(place, "Comment")
        for row in rows:
            row.insert(place, drawn(rng, "ok", f'"says ""hi""{cell} x"', ""))
    if rng.random() < 0.2:
        rows = [[one if one.startswith('"') else f'"{one}"' for one in row] for row in rows]
    lines = [cell.join(row) for row in (names, *rows)]
    middle = int(rng.integers(1, len(lines)))
    for odd in ("# somebody opened the door", "", lines[0]):
        lines[middle:middle] = [odd] if rng.random() < 0.1 else []
    if rng.random() < 0.3:
        lines = ["Bench 7", f"Date{cell}2026-03-01", "", *lines]
    end = drawn(rng, "\n", "\r\n", "\r")
    content = (end.join(lines) + drawn(rng, end, "")).encode(drawn(rng, "utf-8", "utf-8-sig", "utf-16", "latin-1"))
    packed = rng.random() < 0.25
    if packed:  # two gzip members, sometimes followed by zeros as on a tape
        half = len(content) // 3
        content = gzip.compress(content[:half]) + gzip.compress(content[half:]) + drawn(rng, b"", bytes(100))
    path = folder / ("log.csv.gz" if packed else "log.csv")
    path.write_bytes(content)
    return path, {}


def arrow(log: Channels, rng: np.random.Generator, folder: Path) -> tuple[Path, Later]:
    """Write Parquet or Feather: timestamps, durations, decimals, texts and dictionaries, beside nested columns."""
    import pyarrow as pa
    from pyarrow.feather import write_feather
    from pyarrow.parquet import write_table

    kinds: Mapping[str, Callable[[Any], Any]] = {
        "plain": pa.array,
        "dictionary": lambda x: pa.array(x).dictionary_encode(),
        "decimal": lambda x: pa.array([Decimal(f"{one:.9f}") for one in x], pa.decimal128(38, 9)),
        "text": lambda x: pa.array([repr(float(one)) for one in x], pa.large_string()),
        "holes": lambda x: pa.array([None if row % 97 == 5 else one for row, one in enumerate(x)]),
    }
    style, columns = drawn(rng, "[", "(", "suffix"), list[tuple[str, Any]]()
    for one in spelt(log, rng):
        name = heading(one, style)
        if one.channel == TIME:
            count = np.rint(1e9 * log[TIME]).astype("i8")
            zone = drawn(rng, "Europe/Berlin", "+05:30", None)
            name, values = drawn(
                rng,
                (name, pa.array(one.values)),
                (name, pa.array(count, pa.duration("ns"))),
                ("timestamp", pa.array(count // 1000 + 1_700_000_000_000_000, pa.timestamp("us", tz=zone))),
                ("time [ns]", pa.array(count)),
            )
        else:
            values = kinds[str(rng.choice(list(kinds)))](one.values)
        columns.append((name, values))
    rows, first = len(log[TIME]), columns[1][0]
    noise = rng.normal(size=rows)
    for odd in (
        (f"{first}.raw", pa.array(noise)),
        ("raw", pa.array([{first: float(x)} for x in noise])),
        ("spectrum", pa.array([[float(x)] * 2 for x in noise])),
        ("nothing", pa.nulls(rows)),
        ("enabled", pa.array(noise > 0.0)),
    ):
        columns[:0] = [odd] if rng.random() < 0.2 else []
    table = pa.Table.from_arrays([one for _, one in columns], names=[name for name, _ in columns])
    if rng.random() < 0.5:
        write_table(
            table,
            path := folder / "log.parquet",
            row_group_size=drawn(rng, 7, 100, 10**6),
            compression=drawn(rng, "none", "gzip", "zstd", "brotli"),
            version=drawn(rng, "1.0", "2.6"),
            data_page_version=drawn(rng, "1.0", "2.0"),
        )
    else:
        write_feather(table, path := folder / "log.feather", chunksize=drawn(rng, 13, 10**6))
    return path, {}


def tdms(log: Channels, rng: np.random.Generator, folder: Path) -> tuple[Path, Later]:
    """Write TDMS: clocks of each kind, one channel that begins later, two groups, several segments."""
    from nptdms import ChannelObject, TdmsWriter

    clock, groups = drawn(rng, "channel", "step", "date", "offset", "later offset", "later date"), drawn(rng, 1, 1, 2)
    start, step, later = np.datetime64("2026-03-01T12:00:00", "us"), float(log[TIME][1]), dict[str, int]()
    objects: list[tuple[str, Written, Any, dict[str, Any]]] = []
    for place, one in enumerate(spelt(log, rng)):
        said: dict[str, Any] = {drawn(rng, "unit_string", "NI_UnitDescription"): one.unit}
        if one.channel == TIME:
            objects += [("g0", one, one.values, said)] if clock == "channel" else []
            continue
        delay = 10 if place == 2 and clock.startswith("later") else 0
        later[one.channel] = delay
        if clock != "channel":
            said |= {"wf_increment": step, "wf_samples": len(one.values)}
        if clock.endswith("date"):
            said["wf_start_time"] = start + np.timedelta64(round(1e6 * delay * step), "us")
        if clock == "offset" or (delay and clock == "later offset"):
            said["wf_start_offset"] = 0.25 if clock == "offset" else delay * step
        group = f"g{place % groups}" if clock != "channel" else "g0"
        objects.append((group, one, one.values, said))
    edges = np.linspace(0, len(log[TIME]), drawn(rng, 1, 3) + 1).astype(int)
    with TdmsWriter(path := folder / "log.tdms") as writer:
        for a, b in pairwise(edges):
            writer.write_segment([ChannelObject(g, one.words, values[a:b], said) for g, one, values, said in objects])
    return path, later


def hdf5(log: Channels, rng: np.random.Generator, folder: Path) -> tuple[Path, Later]:
    """Write HDF5: scaled integers, byte order, links, references, and other types beside."""
    import h5py

    with h5py.File(path := folder / "log.h5", "w") as file:
        group = drawn(rng, file, file.create_group("run/1"))
        for one in spelt(log, rng):
            scaled = one.channel != TIME and rng.random() < 0.3
            scale, offset = np.ptp(one.values) / 60000.0, float(one.values.min() + 0.5 * np.ptp(one.values))
            counts = np.rint((one.values - offset) / scale)
            raw = counts.astype("i2") if scaled else one.values.astype(drawn(rng, "f8", ">f8"))
            held = group.create_dataset(heading(one, "suffix"), data=raw, chunks=True, shuffle=bool(rng.integers(2)))
            held.attrs.update({"scale_factor": scale, "add_offset": offset} if scaled else {})
        if rng.random() < 0.4:
            file["link"] = h5py.SoftLink(group.name)
        if rng.random() < 0.4:
            group["a_first"] = group[next(iter(group))]
        file.create_dataset("references", data=np.array([file.ref], dtype=h5py.ref_dtype))
        file.create_dataset("complex", data=np.ones(len(log[TIME])) + 1j)
    return path, {}


def numbers(log: Channels, rng: np.random.Generator, folder: Path) -> tuple[Path, Later]:
    """Write JSON of three kinds, a NumPy archive, or MAT with structs and other variables beside."""
    from scipy.io import savemat

    held = {heading(one, "suffix"): one.values for one in spelt(log, rng)}
    kind = drawn(rng, "rows", "lines", "columns", "npz", "mat")
    path = folder / {"npz": "log.npz", "mat": "log.mat"}.get(kind, "log.json")
    rows = [dict(zip(held, map(float, row), strict=True)) for row in zip(*held.values(), strict=True)]
    if kind == "npz":
        more: Mapping[str, Any] = {"fs": np.array(1000.0), "note": np.array("hi"), **held}
        np.savez(path, **more)
    elif kind == "mat":
        beside = {"cells": np.array(["a", 1.0], dtype=object), "z": np.ones(9) * 1j, "text": "hello"}
        values = {name: drawn(rng, one[None, :], one[:, None], one.astype(">f8")) for name, one in log.items()}
        savemat(path, drawn(rng, {**beside, **values}, {"log": {**beside, **values}}, {"test": {"run": values}}))
    elif kind == "lines":
        path.write_text("\n".join(map(json.dumps, rows)), encoding="utf-8")
    else:
        whole = rows if kind == "rows" else {name: values.tolist() for name, values in held.items()}
        path.write_text(json.dumps(whole), encoding="utf-8")
    return path, {}


WRITERS: tuple[Make, ...] = (text, arrow, tdms, hdf5, numbers)


def check(make: Make, seed: int, folder: Path, ends: Counter[str] | None = None) -> str:
    """Write a file and read it; return what is wrong, or an empty string if it is right or refused."""
    rng = np.random.default_rng(seed)
    log = truth(rng)
    path, later = make(log, rng, folder)
    ended = ["refused"]

    def use() -> None:
        said = wrong(log, read_record(path), later)
        ended[0] = "read"
        if said:
            raise AssertionError(said)

    found = limited(use)
    if ends is not None:
        ends[f"{make.__name__} {'wrong' if found else ended[0]}"] += 1
    path.unlink()
    return f"{make.__name__}, seed {seed}: {found}" if found else ""


def run(count: int, first: int = 0, ends: Counter[str] | None = None) -> list[str]:
    """Write a number of files, and return those read wrongly, with format and seed."""
    with tempfile.TemporaryDirectory() as folder:
        cases = [(WRITERS[seed % len(WRITERS)], seed) for seed in range(first, first + count)]
        found = [check(make, seed, Path(folder), ends) for make, seed in cases]
    return [one for one in found if one]


if __name__ == "__main__":
    counted: Counter[str] = Counter()
    told = run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0, counted)
    sys.stdout.write("\n".join([*told, f"{dict(sorted(counted.items()))}, {len(told)} wrong\n"]))
    sys.exit(bool(told))
