"""Bulk modulus and its interval against the Cramér-Rao bound: pressure is logged, the condition unknown.

Lumped plant, nine steps and PRBS, 10 s at 1 kHz, sensors of the bench; flow form by least squares. Two bounds stand
beside the error: the mean variance that the fits report, and the posterior bound of a model that knows the structure of
the friction and measures position, velocity and pressure, with leakage, flow bias and friction unknown.
"""

import argparse
from collections.abc import Iterable

import numpy as np
import pandas as pd
from scipy.stats import beta, chi2

from estimation.augment import augmented, augmented_prior
from estimation.bounds import bulk_modulus_bound
from estimation.bulk_modulus import estimate_bulk_modulus
from estimation.eha import PRESSURE_FORM
from estimation.filter_estimate import GROUPS
from estimation.first_belief import START_STD, first_belief
from experiments.executors import side_by_side
from experiments.streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha import EhaParameters
from plant.record import Record
from plant.sensors import BENCH, noise_variances
from plant.signals import make_drive
from plant.simulate import LUMPED, simulate

SAMPLE_TIME, DURATION = 1e-3, 10.0
FIRST_GUESS = 3e8
DRIVES = ("steps", "prbs")
UNKNOWN = (*GROUPS["leakage"], *GROUPS["friction"])
CHANNELS = ("position_m", "velocity_m_s", "differential_pressure_pa")

WANTED_RATIO = 1.2
WANTED_POOLED = (93.5, 96.5)
WANTED_CELL = (90.0, 99.0)
"""Coverage of the 95 % intervals, over all runs and in one cell [percent]."""


def full_bound(record: Record, p: EhaParameters) -> float:
    """Return the relative posterior bound where all sensors are used and the friction's structure is known [percent].

    Noise of measured speed is what drives the pressure unknown: white flow noise at the log's rate.
    """
    model = augmented(PRESSURE_FORM, UNKNOWN)
    prior = augmented_prior(model, first_belief(PRESSURE_FORM, record, p.bulk_modulus, START_STD), p)
    stiffness = p.bulk_modulus / p.chamber_volume
    speed_noise = (stiffness * p.pump_displacement * BENCH.speed_noise) ** 2 * record.sample_time
    noise = {state.name: 0.0 for state in model.states} | {"differential_pressure_pa": speed_noise}
    variances = noise_variances(BENCH)
    std = bulk_modulus_bound(model, prior, record, p, channels=CHANNELS, variances=variances, noise=noise)
    return 100.0 * std / p.bulk_modulus


def run_case(case: tuple[str, str, int]) -> dict[str, object]:
    """Fit one noisy run and take its bound."""
    drive_name, condition, seed = case
    rng = stream(seed, "efficiency benchmark", drive_name, condition)
    p = parameters_for(CONDITIONS[condition])
    drive = make_drive(drive_name, DURATION, SAMPLE_TIME, p, rng)
    record = simulate(LUMPED, drive, SAMPLE_TIME, p, sensors=BENCH, rng=rng)
    found = estimate_bulk_modulus(record, EhaParameters(), form="flow", method="least-squares", start=FIRST_GUESS)
    value, std = found.value or float("nan"), found.std or float("nan")
    return {
        "drive": drive_name,
        "condition": condition,
        "seed": seed,
        "outcome": found.outcome.value,
        "gate": found.gate.passed,
        "error_percent": 100.0 * (value / p.bulk_modulus - 1.0),
        "std_percent": 100.0 * std / p.bulk_modulus,
        "bound_percent": full_bound(record, p),
        "z": (value - p.bulk_modulus) / std,
        "covered": found.interval is not None and found.interval[0] <= p.bulk_modulus <= found.interval[1],
    }


def _rms(values: Iterable[float]) -> float:
    return float(np.sqrt(np.nanmean(np.square(np.asarray(values, dtype=np.float64)))))


def summarised(rows: pd.DataFrame) -> dict[str, float]:
    """Return error, bounds, coverage and NEES of some runs, with the 95 % ranges that chance allows."""
    n = len(rows)
    rmse, reported, bound = _rms(rows["error_percent"]), _rms(rows["std_percent"]), _rms(rows["bound_percent"])
    nees = float(np.nanmean(np.square(rows["z"])))
    low, high = (float(chi2.ppf(level, n)) / n for level in (0.025, 0.975))
    return {
        "runs": n,
        "gate_passed": rows["gate"].sum(),
        "rmse_percent": rmse,
        "reported_percent": reported,
        "bound_percent": bound,
        "over_reported": rmse / reported,
        "over_bound": rmse / bound,
        "least_over_reported": rmse / reported / high**0.5,
        "coverage": 100.0 * float(rows["covered"].mean()),
        "nees": nees,
        "nees_low": low,
        "nees_high": high,
    }


def coverage_range(covered: int, runs: int) -> tuple[float, float]:
    """Return the 95 % Clopper-Pearson range of a coverage [percent]."""
    low = float(beta.ppf(0.025, covered, runs - covered + 1)) if covered else 0.0
    high = float(beta.ppf(0.975, covered + 1, runs - covered)) if covered < runs else 1.0
    return 100.0 * low, 100.0 * high


def coverage_verdict(covered: int, runs: int, wanted: tuple[float, float]) -> str:
    """Return whether the coverage is within what is wanted, out of it, or out of it by no more than chance."""
    if wanted[0] <= 100.0 * covered / runs <= wanted[1]:
        return "met"
    low, high = coverage_range(covered, runs)
    return "missed" if high < wanted[0] or low > wanted[1] else "undecided"


def judged(met: bool) -> str:
    """Return the word for a wish."""
    return "met" if met else "missed"


def main(arguments: list[str]) -> int:
    """Print one line a cell and the pooled figures; return how many wishes are missed by more than chance explains."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--conditions", nargs="+", choices=list(CONDITIONS), default=list(CONDITIONS))
    parser.add_argument("--csv", help="write every estimate to this file")
    options = parser.parse_args(arguments)
    seeds = range(options.seeds)
    cases = [(drive, condition, seed) for drive in DRIVES for condition in options.conditions for seed in seeds]
    rows = pd.DataFrame(list(side_by_side(run_case, cases)))
    if options.csv:
        rows.to_csv(options.csv, index=False)
    cells = pd.DataFrame(
        [
            {"drive": drive, "condition": condition} | summarised(cell)
            for (drive, condition), cell in rows.groupby(["drive", "condition"], sort=False)
        ]
    )
    cells["in_cell"] = [
        coverage_verdict(round(c / 100.0 * n), n, WANTED_CELL)
        for c, n in zip(cells["coverage"], cells["runs"], strict=True)
    ]
    print(cells.to_string(index=False, float_format="%.3f"))
    pooled = summarised(rows)
    covered = int(rows["covered"].sum())
    low, high = coverage_range(covered, len(rows))
    verdicts = {
        f"coverage of {len(rows)} intervals {pooled['coverage']:.1f} % (95 % range {low:.1f} to {high:.1f}), wanted "
        f"{WANTED_POOLED[0]} to {WANTED_POOLED[1]}": coverage_verdict(covered, len(rows), WANTED_POOLED),
        f"NEES {pooled['nees']:.3f}, wanted {pooled['nees_low']:.3f} to {pooled['nees_high']:.3f}": judged(
            pooled["nees_low"] <= pooled["nees"] <= pooled["nees_high"]
        ),
        f"RMSE over the reported deviation {pooled['over_reported']:.3f}, wanted at most {WANTED_RATIO}": judged(
            pooled["over_reported"] <= WANTED_RATIO
        ),
        f"RMSE over the bound with all sensors {pooled['over_bound']:.3f}, wanted at most {WANTED_RATIO}": judged(
            pooled["over_bound"] <= WANTED_RATIO
        ),
    }
    print("\npooled")
    print("\n".join(f"  {line}: {verdict}" for line, verdict in verdicts.items()))
    # a ratio from a few runs scatters: a cell misses only where chance does not explain it
    misses = (cells["least_over_reported"] > WANTED_RATIO) | (cells["in_cell"] == "missed")
    print(f"cells that miss by more than chance explains: {misses.sum()} of {len(cells)}")
    return int(misses.sum()) + list(verdicts.values()).count("missed")
