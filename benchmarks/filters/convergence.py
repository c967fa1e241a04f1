"""The published experiment, Figure 11: bulk modulus from first guesses of 0 to 5e8 Pa, in nine conditions.

Acceleration form and pressure form side by side, by every filter, on the reduced, the lumped and the circuit plant, at
10 kHz with the bench's sensors. A row is one plant, drive, form and filter over conditions and first guesses: final
value (median of the means over the last 20 % of the runs), settling time (median time from which the estimate stays
within 5 % of the truth, for the runs that do), RMSE of the final values, and the Cramér-Rao bound (median).
"""

import argparse
from collections.abc import Sequence
from itertools import product

import numpy as np
import pandas as pd

from estimation.filters.run import METHODS, available_channels, run_filter
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, START_STD, first_belief
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from estimation.trust.bounds import at_bulk_modulus, bulk_modulus_bound
from experiments.running.executors import side_by_side
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

SAMPLE_TIME = 1e-4
SECONDS = 10.0
STARTS = tuple(0.5e8 * k for k in range(11))
SETTLED = 0.05
BY_DEFAULT = ("ekf", "ukf", "svsf")

Case = tuple[str, str, str, str, bool, Sequence[str], Sequence[float]]


def measured(plant: str, drive: str, condition: str) -> tuple[EhaParameters, Record]:
    """Return one noisy run, and the parameters that a filter knows of it."""
    rng = stream(1, "convergence", plant, drive, condition)
    p = parameters_for(CONDITIONS[condition])
    actual = circuit_of(parameters_for(CONDITIONS[condition], CircuitParameters())) if plant == "circuit" else p
    speed = make_drive(drive, SECONDS, SAMPLE_TIME, actual, rng)
    return p, simulate(PLANTS[plant], speed, SAMPLE_TIME, actual, sensors=BENCH, rng=rng)


def settling_time(time: Array, track: Array, truth: float) -> float:
    """Return when the estimate came within 5 % for good, infinite where it never did [s]."""
    outside = np.flatnonzero(~(np.abs(track / truth - 1.0) <= SETTLED))
    if not len(outside):
        return 0.0
    return float(time[outside[-1] + 1]) if outside[-1] + 1 < len(time) else float("inf")


def run_case(case: Case) -> list[dict[str, object]]:
    """Filter one run by every method from every first guess."""
    plant, drive, condition, form, logged, methods, starts = case
    p, record = measured(plant, drive, condition)
    seen = record if logged else record.replace(differential_pressure_pa=None)
    model = FORMS[form]
    channels = available_channels(model, seen)
    variances = measurement_variances(seen, channels)
    noise = {"differential_pressure_pa": PRESSURE_NOISE_LOGGED} if logged else {}
    truth = p.bulk_modulus
    bound = bulk_modulus_bound(
        model,
        first_belief(model, seen, truth, START_STD),
        seen,
        at_bulk_modulus(p, truth),
        channels=channels,
        variances=variances,
        noise=noise,
    )
    rows: list[dict[str, object]] = []
    for method, start in product(methods, starts):
        estimate = run_filter(
            METHODS[method],
            model,
            first_belief(model, seen, start, START_STD),
            seen,
            p,
            channels=channels,
            variances=variances,
            noise=noise,
        )
        track, _ = estimate.track(BULK_MODULUS)
        rows.append(
            {
                "plant": plant,
                "drive": drive,
                "form": form,
                "dp": "yes" if logged else "no",
                "method": method,
                "final": estimate.settled(BULK_MODULUS)[0],
                "settling_s": settling_time(estimate.time - estimate.time[0], track, truth),
                "truth": truth,
                "bound": bound,
            }
        )
    return rows


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row a plant, drive, form and filter."""
    table = table.assign(error=table["final"] / table["truth"] - 1.0, bound=table["bound"] / table["truth"])
    groups = table.groupby(["plant", "drive", "form", "dp", "method"], sort=False)
    return pd.DataFrame(
        {
            "final [1e8 Pa]": groups["final"].median() / 1e8,
            "RMSE [%]": 100.0 * groups["error"].apply(lambda e: float(np.sqrt(np.mean(e**2)))),
            "within 5 %": groups["settling_s"].apply(lambda s: float(np.mean(np.isfinite(s)))),
            "settling [s]": groups["settling_s"].apply(
                lambda s: float(np.median(s[np.isfinite(s)])) if np.any(np.isfinite(s)) else float("nan")
            ),
            "diverged": groups["final"].apply(lambda f: int(np.sum(~np.isfinite(f)))),
            "bound [%]": 100.0 * groups["bound"].median(),
        }
    ).reset_index()


def main(arguments: list[str]) -> int:
    """Print the table; there is no pass or fail, the table is the result."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--methods", default=",".join(BY_DEFAULT), help=f"of {', '.join(METHODS)}")
    parser.add_argument("--quick", action="store_true", help="three conditions and three first guesses")
    parser.add_argument("--csv", help="write every run to this file")
    options = parser.parse_args(arguments)
    conditions = ["normal", "major_leakage", "major_friction"] if options.quick else list(CONDITIONS)
    starts = STARTS[::5] if options.quick else STARTS
    methods = options.methods.split(",")
    forms = (("acceleration", False), ("pressure", False), ("pressure", True))
    cases = [
        (plant, drive, condition, form, logged, methods, starts)
        for plant, drive, (form, logged), condition in product(PLANTS, ("sine", "steps"), forms, conditions)
        if not (plant == "reduced" and logged)
    ]
    rows: list[dict[str, object]] = []
    for found in side_by_side(run_case, cases):
        rows += found
    table = pd.DataFrame(rows)
    if options.csv:
        table.to_csv(options.csv, index=False)
    print(summary(table).to_string(index=False, float_format=lambda value: f"{value:.3g}"))
    return 0
