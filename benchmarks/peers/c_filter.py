"""An exported filter, compiled and loaded, for comparison with Python's kernel."""

import ctypes
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.engine.contract import FilterProblem
from estimation.export.c_filter import filter_in_c
from plant.arrays import Array

SOURCE = Path(__file__).with_suffix(".c")
STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")
FUSED_FLAGS = ("-mfma", "-mavx2")
"""Instructions that Python's kernels use too, if the processor supports them."""


@dataclass(frozen=True)
class CFilter:
    """An exported filter as a library.

    Parameters
    ----------
    kind : type
        Type of its real numbers.
    """

    library: ctypes.CDLL
    problem: FilterProblem
    kind: type[np.float64] | type[np.float32]

    def logs(self) -> tuple[Any, Any]:
        """Return the log's drives and measurements in the filter's precision."""
        return tuple(np.ascontiguousarray(one, self.kind) for one in (self.problem.drives, self.problem.measured))

    def run(self) -> tuple[Array, Array, Array, float, int]:
        """Filter the log.

        Returns
        -------
        tuple of (ndarray, ndarray, ndarray, float, int)
            Estimates and their standard deviations (samples, states), mean NIS of each channel, log-likelihood, gate.
        """
        drives, measured = self.logs()
        values, deviations = (np.empty((len(drives), self.problem.model.width), self.kind) for _ in range(2))
        sums = np.empty(len(self.problem.channels) + 1, self.kind)
        places = [ctypes.c_void_p(one.ctypes.data) for one in (drives, measured, values, deviations, sums)]
        gate = self.library.run(ctypes.c_long(len(drives)), *places)
        return values.astype(float), deviations.astype(float), sums[:-1].astype(float), float(sums[-1]), gate

    def filter_without_results(self) -> None:
        """Filter the log and discard the results."""
        drives, measured = self.logs()
        places = (ctypes.c_void_p(one.ctypes.data) for one in (drives, measured))
        self.library.work(ctypes.c_long(len(drives)), *places)

    def clocked(self) -> NDArray[np.int64]:
        """Return the duration of each step, shape (samples,) [ns]."""
        drives, measured = self.logs()
        times = np.empty(len(drives), np.int64)
        places = (ctypes.c_void_p(one.ctypes.data) for one in (drives, measured, times))
        self.library.clocked(ctypes.c_long(len(drives)), *places)
        return times

    def paced(self, period: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Process one sample in every period.

        Parameters
        ----------
        period : int
            Time between samples [ns].

        Returns
        -------
        tuple of ndarray, each shape (samples,)
            Lateness of each wake-up, and duration of its step [ns].
        """
        drives, measured = self.logs()
        late, times = np.empty(len(drives), np.int64), np.empty(len(drives), np.int64)
        places = (ctypes.c_void_p(one.ctypes.data) for one in (drives, measured, late, times))
        self.library.paced(ctypes.c_long(len(drives)), ctypes.c_long(period), *places)
        return late, times


def build_filter(
    problem: FilterProblem,
    method: str,
    folder: Path,
    *,
    compiler: str = "gcc",
    flags: Sequence[str] = FUSED_FLAGS,
    precision: str = "double",
) -> CFilter:
    """Export a filter, compile it and load it.

    Parameters
    ----------
    folder : Path
        Folder for its files.
    compiler : str
        ``gcc`` or ``clang``.
    flags : sequence of str
        Flags in addition to the strict ones.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in filter_in_c(problem, method, name="exported", precision=precision).items():
        (folder / file).write_text(text, encoding="utf-8")
    sizes = {"STATES": problem.model.width, "DRIVES": len(problem.model.drives), "CHANNELS": len(problem.channels)}
    named = {"NAME": "exported", "HEADER": '"exported.h"', "REAL": precision, **sizes}
    target = folder / "exported.so"
    command = [compiler, *STRICT, *flags, *(f"-D{name}={value}" for name, value in named.items()), "-I", str(folder)]
    sources = [str(SOURCE), str(folder / "exported.c"), "-lm"]
    subprocess.run([*command, "-shared", "-fPIC", "-o", str(target), *sources], check=True)  # noqa: S603  our own
    library = ctypes.CDLL(str(target))
    library.run.restype = ctypes.c_uint
    return CFilter(library, problem, np.float64 if precision == "double" else np.float32)
