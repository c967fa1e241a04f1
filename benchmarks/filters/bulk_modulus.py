"""Effective bulk modulus over conditions, first guesses and noise seeds: every cell against its tolerance.

Cells: the paper's sine and the nine steps, 10 s at 10 kHz, sensors of the bench. The final value is the mean over the
last 20 % of the run. ``--seeds`` sets the number of noise seeds (8 for acceptance).
"""

import argparse
from itertools import product

import pandas as pd

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.finding import Outcome
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import PLANTS, simulate
from plant.sensors.sensors import BENCH

FIRST_GUESSES = (0.0, 0.5e8, 1e8, 2e8, 3e8, 4e8, 5e8)

CELLS = (
    ("reduced", "acceleration", "sine", False, 3.0),
    ("lumped", "pressure", "sine", True, 1.0),
    ("lumped", "pressure", "steps", True, 1.0),
    ("lumped", "pressure", "steps", False, 3.0),
    ("lumped", "pressure", "sine", False, None),
)
"""Plant, form, drive, pressure logged, tolerance in percent; no tolerance if "not observable" is the right answer."""

Cell = tuple[str, str, str, bool, float | None]


def run_case(case: tuple[Cell, str, int]) -> list[dict[str, object]]:
    """Estimate from every first guess on one noisy run."""
    (plant, form, drive_name, logged, tolerance), condition, seed = case
    rng = stream(seed, "bulk modulus benchmark", plant, drive_name, condition)
    p = parameters_for(CONDITIONS[condition])
    record = simulate(PLANTS[plant], make_drive(drive_name, 10.0, 1e-4, p, rng), 1e-4, p, sensors=BENCH, rng=rng)
    seen = record if logged else record.replace(differential_pressure_pa=None)
    rows: list[dict[str, object]] = []
    for start in FIRST_GUESSES:
        found = estimate_bulk_modulus(seen, p, form=form, start=start)
        error = float("nan") if found.value is None else 100.0 * (found.value / p.bulk_modulus - 1.0)
        right = found.outcome is Outcome.NOT_OBSERVABLE if tolerance is None else abs(error) <= tolerance
        rows.append(
            {
                "cell": f"{form} form, {plant} plant, {drive_name}, {'dp' if logged else 'no dp'}",
                "tolerance_percent": tolerance,
                "condition": condition,
                "seed": seed,
                "start_pa": start,
                "outcome": found.outcome.value,
                "error_percent": error,
                "z": float("nan") if found.value is None else (found.value - p.bulk_modulus) / (found.std or 1.0),
                "gate": found.gate.passed,
                "right": right,
            }
        )
    return rows


def main(arguments: list[str]) -> int:
    """Print one line for each cell, then every miss; return the number of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--csv", help="write every estimate to this file")
    options = parser.parse_args(arguments)
    rows: list[dict[str, object]] = []
    for found in map_in_parallel(run_case, product(CELLS, CONDITIONS, range(options.seeds))):
        rows += found
    table = pd.DataFrame(rows)
    if options.csv:
        table.to_csv(options.csv, index=False)
    summary = table.groupby("cell", sort=False).agg(
        runs=("right", "size"),
        right=("right", "sum"),
        worst_percent=("error_percent", lambda e: e.abs().max()),
        median_percent=("error_percent", lambda e: e.abs().median()),
        rms_z=("z", lambda z: (z**2).mean() ** 0.5),
        gate_passed=("gate", "mean"),
    )
    print(summary.to_string(float_format="%.3f"))
    misses = table[~table["right"]]
    print(f"\nmisses: {len(misses)} of {len(table)}")
    if len(misses):
        print(misses.drop(columns=["right"]).to_string(index=False))
    return len(misses)
