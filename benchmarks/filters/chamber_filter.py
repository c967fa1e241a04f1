"""The modelled-chamber filter on the circuit plant, condition unknown: errors, standard deviations, and the gate.

Nine conditions, several seeds each: ten seconds of nine steps at 1 kHz with the bench's sensors. This is the filter of
`hydrostate estimate --method chamber-ekf`.
"""

import argparse
from collections.abc import Sequence
from itertools import product

import numpy as np
import pandas as pd

from benchmarks.targets import check_target, misses
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from experiments.running.executors import map_in_parallel
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()


def circuit_log(condition: str, seed: int, drive: str = "steps", duration: float = 10.0) -> Record:
    """Return a log of the circuit plant in a condition."""
    p, rng = circuit_of(parameters_for(CONDITIONS[condition], CircuitParameters())), np.random.default_rng([seed, 7])
    return simulate(CIRCUIT, make_drive(drive, duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def filter_figures(case: tuple[str, int]) -> dict[str, object]:
    """Return error [%], z and gate of the filter on one log."""
    condition, seed = case
    found = estimate_bulk_modulus(circuit_log(condition, seed), HEALTHY, method="chamber-ekf")
    error = (found.value or np.nan) - HEALTHY.bulk_modulus
    return {
        "condition": condition,
        "error_percent": 100.0 * error / HEALTHY.bulk_modulus,
        "z": error / (found.std or np.nan),
        "passed": found.gate.passed,
    }


def main(arguments: Sequence[str]) -> int:
    """Print one row for each condition, and the counts with their targets; return how many fall short."""
    parser = argparse.ArgumentParser(prog="chamber_filter", description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="logs of each condition (default: %(default)s)")
    options = parser.parse_args(arguments)
    misses.clear()
    cases = list(product(CONDITIONS, range(options.seeds)))
    table = pd.DataFrame(list(map_in_parallel(filter_figures, cases)))
    rows = table.groupby("condition", sort=False).agg(
        worst_percent=("error_percent", lambda errors: float(errors.abs().max())),
        z_rms=("z", lambda z: float(np.sqrt(np.mean(z**2)))),
        passed=("passed", "sum"),
    )
    print(rows.to_string(float_format="%.3f"))
    z_rms = float(np.sqrt(np.mean(table["z"].to_numpy(dtype=np.float64) ** 2)))
    check_target("logs within 1 %, %", 100.0 * float((table["error_percent"].abs() < 1.0).mean()), 100.0, most=False)
    check_target("gates that pass, %", 100.0 * float(table["passed"].mean()), 100.0, most=False)
    check_target("z of bulk modulus, rms, at most", z_rms, 1.3)
    check_target("z of bulk modulus, rms, at least", z_rms, 0.8, most=False)
    return len(misses)
