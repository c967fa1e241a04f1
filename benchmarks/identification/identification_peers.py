"""Output error against SIPPY, jax-sysid, pysid and pysib: time and success on the same records, in one run.

Each peer runs as a subprocess in a Python environment of its own, ``.peers/NAME`` (`make peers`), or in the folder
given by ``HYDROSTATE_PEERS``, since they need different versions. Signals are scaled to order one. A fit succeeds if
its simulated cost is within 0.1 % of that of a fit started at the truth; the chance share of that cost due to the
fitted values is 0.03 %. Processor seconds are compared, with one thread for linear algebra each.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter
from threadpoolctl import threadpool_limits

from benchmarks.identification.identification import cost_from_truth, report
from benchmarks.identification.identification_data import TABLE_6, Case, table6_case
from estimation.identification import fit_output_error

WANTED = {"sippy": 100.0, "jax-sysid": 30.0, "pysib": 20.0, "pysid": 100.0}
"""Required speed-up over each peer."""

SUCCESS = 1e-3
"""Relative excess of the cost up to which a fit succeeds."""

NOISE = 0.1


def main(arguments: list[str]) -> int:
    """Print times, ratios and success rates; return how many ratios are missed."""
    parser = argparse.ArgumentParser(prog="identification_peers", description=__doc__)
    parser.add_argument("--records", type=int, default=len(TABLE_6), help="records, one a condition")
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--peers", nargs="*", default=list(WANTED), choices=list(WANTED))
    parser.add_argument("--timeout", type=float, default=3600.0, help="for each peer [s]")
    options = parser.parse_args(arguments)
    root = Path(os.environ.get("HYDROSTATE_PEERS", ".peers"))
    cases = [_unit(table6_case(name, NOISE, 0, options.samples)) for name in list(TABLE_6)[: options.records]]
    best = [cost_from_truth(case) for case in cases]
    with threadpool_limits(1):
        ours = [_own_fit(case) for case in cases]
        ours = [_own_fit(case) for case in cases]  # the first round compiles
    mean = float(np.mean([row["cpu_seconds"] for row in ours]))
    right = sum(_succeeds(row, case, least) for row, case, least in zip(ours, cases, best, strict=True))
    print(f"{'hydrostate':12s} {1e3 * mean:10.0f} ms            right {right} of {len(cases)}")
    lines: list[tuple[str, bool]] = [(f"hydrostate right {right} of {len(cases)}", right == len(cases))]
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "records.npz"
        signals = {f"{key}{index}": getattr(case, key) for index, case in enumerate(cases) for key in ("u", "y")}
        np.savez(data, count=len(cases), **signals)
        for name in options.peers:
            python = root / name / "bin" / "python"
            if not python.exists():
                print(f"{name:12s} skipped: no {python} (make peers)")
                continue
            rows = _run_peer(name, python, data, Path(folder) / f"{name}.json", options.timeout)
            if not rows:
                lines.append((f"{name}: nothing came back", False))
                continue
            theirs = float(np.mean([row["cpu_seconds"] for row in rows]))
            own = float(np.mean([row["cpu_seconds"] for row in ours[: len(rows)]]))
            good = sum(_succeeds(row, case, least) for row, case, least in zip(rows, cases, best, strict=False))
            failed = [row["error"] for row in rows if row["error"]]
            note = f"; first error {failed[0]}" if failed else ""
            print(f"{name:12s} {1e3 * theirs:10.0f} ms {theirs / own:8.0f} x right {good} of {len(rows)}{note}")
            lines.append(
                (f"{theirs / own:.0f} times faster than {name} ({WANTED[name]:.0f})", theirs / own >= WANTED[name])
            )
    return report(lines)


def _unit(case: Case) -> Case:
    """Return a record scaled to order one, since the peers do not scale."""
    size_u, size_y = float(np.abs(case.u).max()), float(np.std(case.y))
    truth = type(case.truth)(
        case.truth.numerator * size_u / size_y, case.truth.denominator, case.truth.sample_time, "u", "y"
    )
    return Case(truth, case.u / size_u, case.y / size_y, case.noise_std / size_y)


def _own_fit(case: Case) -> dict[str, Any]:
    begun = time.process_time()
    model = fit_output_error(case.u, case.y, 1e-3, n_numerator=3, n_denominator=2)
    spent = time.process_time() - begun
    return {"b": model.numerator.tolist(), "f": model.denominator.tolist(), "error": "", "cpu_seconds": spent}


def _run_peer(name: str, python: Path, data: Path, result: Path, timeout: float) -> list[dict[str, Any]]:
    worker = Path(__file__).with_name("identification_peer_worker.py")
    one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        subprocess.run(  # noqa: S603 - our own worker, in an environment that the user made
            [str(python), str(worker), name, str(data), str(result)],
            env={**os.environ, **one, "JAX_PLATFORMS": "cpu", "MPLBACKEND": "Agg"},
            check=True,
            timeout=timeout,
            capture_output=True,
        )
    except subprocess.TimeoutExpired:
        print(f"{name}: stopped after {timeout:.0f} s; what it finished counts")
    except subprocess.CalledProcessError as error:
        print(f"{name}: {error.stderr.decode(errors='replace')[-300:]}", file=sys.stderr)
    return json.loads(result.read_text()) if result.exists() else []


def _succeeds(row: dict[str, Any], case: Case, least: float) -> bool:
    """Return whether a model started from rest has the optimal cost, up to chance."""
    f = np.array(row["f"])
    if row["error"] or f.size == 0 or not np.isfinite(f).all() or (np.abs(np.roots(f)) >= 1.0).any():
        return False
    residual = case.y - np.asarray(lfilter(row["b"], row["f"], case.u))
    return bool(residual @ residual <= (1.0 + SUCCESS) * least)
