"""Builds and runs `ekf_simd.cpp` and `arithmetic_peak.cpp` through ctypes."""

import ctypes
import shutil
import subprocess
import tempfile
import time
from collections.abc import Mapping
from dataclasses import astuple
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.acceleration_form import Coefficients

Array = NDArray[np.float64]

PROCESSORS: Mapping[str, str] = MappingProxyType({"own": "native", "avx2": "haswell"})
"""Names for g++ of the instruction sets: this machine's, or those of one with AVX2 and without AVX-512."""

VECTORS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "as it comes": (),
        "any vectors": ("-fno-math-errno", "-fno-trapping-math"),
        "wide vectors": ("-fno-math-errno", "-fno-trapping-math", "-mprefer-vector-width=512"),
    }
)
"""Options that an expert tries. With AVX2, g++ vectorises only if comparisons may not trap; with AVX-512, it uses
half-width vectors by default."""

CHAINS, ROUNDS = 12, 10_000_000
"""Fused multiply-adds in a round, and number of rounds, of `arithmetic_peak.cpp` [count]."""


def build(source: str, *flags: str) -> ctypes.CDLL | None:
    """Return a compiled library, or None without a C++ compiler."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return None
    library = Path(tempfile.mkdtemp(prefix="hydrostate-peer-")) / "peer.so"
    subprocess.run(  # noqa: S603  the compiler is the one on the path, the source is ours
        [
            *(compiler, "-std=c++17", "-O3", "-shared", "-fPIC", *flags),
            *("-o", str(library), str(Path(__file__).with_name(source))),
        ],
        check=True,
    )
    return ctypes.CDLL(str(library))


def builds(processor: str) -> dict[str, ctypes.CDLL]:
    """Return the filter built in each way that an expert tries; empty without a C++ compiler."""
    march = f"-march={PROCESSORS[processor]}"
    found = {name: build("ekf_simd.cpp", march, *flags) for name, flags in VECTORS.items()}
    return {name: library for name, library in found.items() if library is not None}


def peak_arithmetic(processor: str) -> float | None:
    """Return the additions and multiplications of a core, the best of three tries [1/s]; None without C++."""
    march, best = PROCESSORS[processor], 0.0
    wide = processor == "own" and "avx512f" in Path("/proc/cpuinfo").read_text(encoding="utf-8")
    size = 64 if wide else 32
    library = build("arithmetic_peak.cpp", f"-march={march}", f"-DBYTES={size}", "-mprefer-vector-width=512")
    if library is None:
        return None
    library.peak.restype = ctypes.c_double
    for _ in range(3):
        begin = time.process_time()
        library.peak(ctypes.c_long(ROUNDS), ctypes.c_double(0.5))
        best = max(best, 2.0 * (size / 8) * CHAINS * ROUNDS / (time.process_time() - begin))
    return best


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
