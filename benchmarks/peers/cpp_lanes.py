"""Builds and runs `ekf_simd.cpp` through ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
from dataclasses import astuple
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.acceleration_form import Coefficients

Array = NDArray[np.float64]


def build() -> ctypes.CDLL | None:
    """Return the compiled library, or None where there is no C++ compiler."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return None
    library = Path(tempfile.mkdtemp(prefix="hydrostate-peer-")) / "ekf_simd.so"
    source = Path(__file__).with_name("ekf_simd.cpp")
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run(  # noqa: S603  the compiler is the one on the path, the source is ours
        [compiler, *flags, "-o", str(library), str(source)],
        check=True,
    )
    return ctypes.CDLL(str(library))


def run(
    library: ctypes.CDLL,
    steps: tuple[float, float, float],
    c: Coefficients,
    noise: Array,
    variances: Array,
    speed: Array,
    measured: Array,
    state: Array,
) -> None:
    """Run 32 filters in place: speed (n, 32), measured (n, 2, 32), state (16, 32), all scaled."""
    packed = np.array([*steps, *astuple(c), *noise, *variances])
    pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (packed, speed, measured, state)]
    library.run(ctypes.c_long(len(speed)), *pointers)
