"""Complete Parquet, HDF5, MAT and MDF files whose columns contain what loggers and scripts write besides plain numbers.

Run it as ``python -m tests.fuzz.columns_held 2000``.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from tests.fuzz.files import inspect, read
from tests.fuzz.guard import limited
from tests.fuzz.seeds import small_log

Make = Callable[["np.ndarray[Any, Any]"], Any]


def halved(x: "np.ndarray[Any, Any]") -> "np.ndarray[Any, Any]":
    """Return numbers in half precision; pressures exceed its range and become infinite."""
    with np.errstate(over="ignore"):
        return x.astype("f2")


ARROW: Mapping[str, Make] = {
    "plain": pa.array,
    "dictionary": lambda x: pa.array(x).dictionary_encode(),
    "decimal": lambda x: pa.array([Decimal(f"{one:.9f}") for one in x], pa.decimal128(38, 9)),
    "lists": lambda x: pa.array([[one, one] for one in x]),
    "structs": lambda x: pa.array([{"a": one, "b": str(one)} for one in x]),
    "text": lambda x: pa.array([repr(float(one)) for one in x]),
    "half": lambda x: pa.array(halved(x)),
    "logical": lambda x: pa.array(x > 0.0),
    "null": lambda x: pa.nulls(len(x)),
    "some null": lambda x: pa.array([None if row % 60 == 7 else one for row, one in enumerate(x)]),
    "infinite": lambda x: pa.array([np.inf if row % 60 == 7 else one for row, one in enumerate(x)]),
    "durations": lambda x: pa.array(np.rint(1e9 * x).astype("i8"), pa.duration("ns")),
    "times of the day": lambda x: pa.array(np.abs(np.rint(x)).astype("i4"), pa.time32("ms")),
    "zoned": lambda x: pa.array(np.rint(1e6 * np.abs(x)).astype("i8"), pa.timestamp("us", tz="Europe/Berlin")),
    "before 1970": lambda x: pa.array(np.rint(1e9 * x).astype("i8") - 10**15, pa.timestamp("ns")),
    "far stamps": lambda x: pa.array([2**62 // 10**9] * len(x), pa.timestamp("s")),
    "bytes": lambda x: pa.array([b"x"] * len(x)),
    "huge": lambda x: pa.array(1e300 * x),
}
NUMPY: Mapping[str, Make] = {
    "plain": lambda x: x,
    "big endian": lambda x: x.astype(">f4"),
    "row": lambda x: x[None, :],
    "half as long": lambda x: x[::2],
    "longer": lambda x: np.r_[x, x],
    "empty": lambda x: x[:0],
    "one": lambda x: x[:1],
    "whole": lambda x: np.rint(x).astype("i8"),
    "unsigned": lambda x: np.full(len(x), 2**63, "u8"),
    "complex": lambda x: x + 1j * x,
    "real complex": lambda x: x.astype(complex),
    "cube": lambda x: x.reshape(-1, 2, 2),
    "matrix": lambda x: np.stack([x, x], axis=1),
    "logical": lambda x: x > 0.0,
    "NaN": lambda x: np.where(np.arange(len(x)) % 60 == 7, np.nan, x),
    "tiny": lambda x: np.full(len(x), 5e-324),
}


def parquet(log: Mapping[str, Any], kinds: Sequence[str], path: Path) -> None:
    import pyarrow.parquet as pq

    made = [ARROW[kind](values) for kind, values in zip(kinds, log.values(), strict=True)]
    pq.write_table(pa.table(made, names=list(log)), path)


def hdf5(log: Mapping[str, Any], kinds: Sequence[str], path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        for kind, (name, values) in zip(kinds, log.items(), strict=True):
            run.create_dataset(name, data=NUMPY[kind](values))
        file["run/loop"], file["run/nowhere"] = h5py.SoftLink("/run"), h5py.ExternalLink("nowhere.h5", "/x")
        run.create_dataset("references", data=np.array([file.ref] * 3, dtype=h5py.ref_dtype))
        run.create_dataset("nothing", data=h5py.Empty("f8"))


def mat(log: Mapping[str, Any], kinds: Sequence[str], path: Path) -> None:
    from scipy.io import savemat
    from scipy.sparse import eye_array

    held = {name: NUMPY[kind](values) for kind, (name, values) in zip(kinds, log.items(), strict=True)}
    cells = np.array(["a", 1.0, None], dtype=object)[:2]
    savemat(path, {"log": {**held, "cells": cells, "sparse": eye_array(3).tocsc(), "inner": {"text": "a"}}})


def mdf(log: Mapping[str, Any], kinds: Sequence[str], path: Path) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        time = np.asarray(log["time_s"])
        for kind, (name, values) in list(zip(kinds, log.items(), strict=True))[1:]:
            held = np.asarray(values)
            marks: dict[str, Any] = {"invalidation_bits": np.arange(len(held)) % 60 == 7} if kind == "NaN" else {}
            clock = {"half as long": time[::2], "empty": time[:0]}.get(kind, time)
            file.append([Signal(held[: len(clock)], clock, name=name, **marks)])
        file.save(path, overwrite=True)


WRITERS: Mapping[str, tuple[Callable[..., None], Sequence[str]]] = {
    "log.parquet": (parquet, list(ARROW)),
    "log.h5": (hdf5, list(NUMPY)),
    "log.mat": (mat, list(NUMPY)),
    "log.mf4": (mdf, list(NUMPY)),
}


def run(count: int, first: int = 0) -> list[str]:
    """Write a number of files, and return the failures with their seeds."""
    frame: pd.DataFrame = small_log()
    log, wrong = {str(name): frame[name].to_numpy() for name in frame}, list[str]()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            rng = np.random.default_rng(seed)
            name = list(WRITERS)[seed % len(WRITERS)]
            write, kinds = WRITERS[name]
            chosen = [str(rng.choice(kinds)) if rng.random() < 0.4 else "plain" for _ in log]
            path = Path(folder) / name
            path.unlink(missing_ok=True)
            write(log, chosen, path)
            said = [limited(lambda path=path, use=use: use(path)) for use in (read, inspect)]
            wrong += [f"{name} of {', '.join(chosen)}, seed {seed}: {one}" for one in said if one]
    return wrong


if __name__ == "__main__":
    found = run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    sys.stdout.write("\n".join([*found, f"{sys.argv[1]} files, {len(found)} wrong\n"]))
    sys.exit(bool(found))
