"""Bulk modulus and its interval against the Cramér-Rao bound, along a run of the lumped plant.

Nine steps and PRBS, 10 s at 1 kHz. The bound is the posterior one (Tichavský, Muravchik and Nehorai 1998) for the same
sensors, at the truth, with all known quantities known. It assumes Gaussian noise, so the sensors here are the bench's
with noise of 1 um in place of the encoder's quantum: an encoder at rest repeats one rounding error, which no number of
samples averages away and which could beat a bound of 0.001 %.

- `stated`: the pressure form's EKF with known condition and noise levels, against the bound for the same knowledge;
- `smoothed`: the iterated smoother in its place, which `hydrostate estimate --form pressure` uses if pressure is not
  logged;
- `tuned`: noise levels estimated from the log, as by `hydrostate estimate --form pressure --tune`;
- `unknown`, the default: `hydrostate estimate` on a log without options, by the flow form or, without pressure, by the
  motion form; condition, friction and noise are unknown. Its bound is for a model with known friction structure that
  estimates leakage, flow bias and friction along with bulk modulus.

A target that may have been met or missed by chance alone counts as not met: more seeds decide it.
"""

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.stats import beta, chi2

from benchmarks.targets import Check, keep_figure
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.eha.by_filter import GROUPS
from estimation.eha.result import LARGEST_BOUND
from estimation.filters.ekf import ekf
from estimation.filters.iterated_smoother import iterated_smoother
from estimation.filters.run import run_filter
from estimation.finding import NORMAL_95
from estimation.log_checks.first_belief import START_STD, first_belief
from estimation.models.augment import augmented, augmented_prior
from estimation.models.eha_forms import BULK_MODULUS, PRESSURE_FORM
from estimation.trust.bounds import bulk_modulus_bound
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, noise_variances

SAMPLE_TIME, DURATION = 1e-3, 10.0
FIRST_GUESS = 3e8
DRIVES = ("steps", "prbs")
ESTIMATORS = ("stated", "smoothed", "tuned", "unknown")
SENSORS = replace(BENCH, position_noise=1e-6, position_quantum=0.0, pressure_quantum=0.0)
PRESSURE = "differential_pressure_pa"
MOTION = ("position_m", "velocity_m_s")

MODEL = replace(PRESSURE_FORM, longest_step=1e-4 / LUMPED.substeps)
"""The form at the simulator's own step: relative to a bound of 0.001 %, steps of 0.1 ms show a bias of 0.0013 %."""

NOISE_FACTORS = {True: (1.0, 1.0), False: (1e4, 1e2, 1.0, 1.0)}
"""Factor on the process noise in each pass of the filter, with and without pressure; each pass begins at the bulk
modulus that the previous one found."""

WANTED_RATIO = {True: 1.2, False: 1.5}
"""Ratio of RMSE to bound, with and without pressure."""

WANTED_POOLED = (93.5, 96.5)
WANTED_CELL = (90.0, 99.0)
"""Coverage of the 95 % intervals, over all runs and in one cell [percent]."""


@dataclass(frozen=True)
class Case:
    """One run, its estimator, and whether pressure is logged."""

    drive: str
    condition: str
    seed: int
    estimator: str
    pressure: bool

    @property
    def channels(self) -> tuple[str, ...]:
        """Measured channels."""
        return (*MOTION, PRESSURE) if self.pressure else MOTION


def speed_noise(p: EhaParameters) -> Mapping[str, float]:
    """Return the process noise due to noise in measured speed, by state: white flow noise at the log's rate."""
    stiffness = p.bulk_modulus / p.chamber_volume
    density = (stiffness * p.pump_displacement * SENSORS.speed_noise) ** 2 * SAMPLE_TIME
    return {**{state.name: 0.0 for state in MODEL.states}, PRESSURE: density}


def bound_of(case: Case, record: Record, p: EhaParameters) -> float:
    """Return the posterior bound [Pa]."""
    unknown = (*GROUPS["leakage"], *GROUPS["friction"]) if case.estimator == "unknown" else ()
    model = augmented(MODEL, unknown)
    prior = augmented_prior(model, first_belief(MODEL, record, p.bulk_modulus, START_STD), p)
    noise = {**{state.name: 0.0 for state in model.states}, **speed_noise(p)}
    variances = noise_variances(SENSORS)
    return bulk_modulus_bound(model, prior, record, p, channels=case.channels, variances=variances, noise=noise)


def by_filter_passes(case: Case, record: Record, p: EhaParameters) -> tuple[float, float]:
    """Return bulk modulus and its standard deviation [Pa] by a filter with known noise levels."""
    variances = {name: noise_variances(SENSORS)[name] for name in case.channels}
    value, std = FIRST_GUESS, START_STD
    for factor in NOISE_FACTORS[case.pressure]:
        noise = {name: factor * density for name, density in speed_noise(p).items()}
        prior = first_belief(MODEL, record, value, START_STD)
        found = run_filter(ekf, MODEL, prior, record, p, channels=case.channels, variances=variances, noise=noise)
        value, std = float(found.track(BULK_MODULUS)[0][-1]), float(found.track(BULK_MODULUS)[1][-1])
    return value, std


def by_smoother(case: Case, record: Record, p: EhaParameters) -> tuple[float, float]:
    """Return bulk modulus and its standard deviation [Pa] by the iterated smoother with known noise levels."""
    variances = {name: noise_variances(SENSORS)[name] for name in case.channels}
    prior, noise = first_belief(MODEL, record, FIRST_GUESS, START_STD), speed_noise(p)
    found = run_filter(
        iterated_smoother, MODEL, prior, record, p, channels=case.channels, variances=variances, noise=noise
    )
    return float(found.track(BULK_MODULUS)[0][-1]), float(found.track(BULK_MODULUS)[1][-1])


def by_estimate_verb(case: Case, record: Record, p: EhaParameters) -> tuple[float, float]:
    """Return bulk modulus and its standard deviation [Pa] as `hydrostate estimate` does; NaN if it gives none."""
    log = Record(record.sample_time, {name: record[name] for name in ("motor_speed_rad_s", *case.channels)})
    if case.estimator == "unknown":
        found = estimate_bulk_modulus(log, EhaParameters(), start=FIRST_GUESS)
    else:
        found = estimate_bulk_modulus(log, p, form="pressure", start=FIRST_GUESS, tuned=True)
    return found.value or float("nan"), found.std or float("nan")


ESTIMATE: Mapping[str, Callable[[Case, Record, EhaParameters], tuple[float, float]]] = {
    "stated": by_filter_passes,
    "smoothed": by_smoother,
}
"""Estimators with known noise levels; the others use the verb."""


def run_case(case: Case) -> dict[str, object]:
    """Estimate from one noisy run and take its bound."""
    rng = stream(case.seed, "efficiency benchmark", case.drive, case.condition)
    p = parameters_for(CONDITIONS[case.condition])
    drive = make_drive(case.drive, DURATION, SAMPLE_TIME, p, rng)
    record = simulate(LUMPED, drive, SAMPLE_TIME, p, sensors=SENSORS, rng=rng)
    value, std = ESTIMATE.get(case.estimator, by_estimate_verb)(case, record, p)
    bound = bound_of(case, record, p) / p.bulk_modulus
    z = (value - p.bulk_modulus) / std
    return {
        "drive": case.drive,
        "condition": case.condition,
        "seed": case.seed,
        "error_percent": 100.0 * (value / p.bulk_modulus - 1.0),
        "std_percent": 100.0 * std / p.bulk_modulus,
        "bound_percent": 100.0 * bound if bound < LARGEST_BOUND else float("nan"),
        "z": z,
        "covered": abs(z) < NORMAL_95,
    }


def _rms(values: Iterable[float]) -> float:
    return float(np.sqrt(np.nanmean(np.square(np.asarray(values, dtype=np.float64)))))


def summary_of_runs(rows: pd.DataFrame) -> dict[str, float]:
    """Return error, bound, coverage and NEES of some runs, with the 95 % range of NEES by chance."""
    n = len(rows)
    low, high = (float(chi2.ppf(level, n)) / n for level in (0.025, 0.975))
    return {
        "runs": n,
        "rmse_percent": _rms(rows["error_percent"]),
        "reported_percent": _rms(rows["std_percent"]),
        "bound_percent": _rms(rows["bound_percent"]),
        # each error is divided by its own run's bound, so that runs with different drives weigh alike
        "over_bound": _rms(rows["error_percent"] / rows["bound_percent"]),
        "coverage": 100.0 * float(rows["covered"].mean()),
        "nees": float(np.nanmean(np.square(rows["z"]))),
        "nees_low": low,
        "nees_high": high,
    }


def coverage_range(covered: int, runs: int) -> tuple[float, float]:
    """Return the 95 % Clopper-Pearson range of a coverage [percent]."""
    low = float(beta.ppf(0.025, covered, runs - covered + 1)) if covered else 0.0
    high = float(beta.ppf(0.975, covered + 1, runs - covered)) if covered < runs else 1.0
    return 100.0 * low, 100.0 * high


def coverage_verdict(covered: int, runs: int, wanted: tuple[float, float]) -> str:
    """Return whether the coverage is met, missed, or undecided because chance could explain the miss."""
    if wanted[0] <= 100.0 * covered / runs <= wanted[1]:
        return "met"
    low, high = coverage_range(covered, runs)
    return "missed" if high < wanted[0] or low > wanted[1] else "undecided"


def verdict_word(met: bool) -> str:
    """Return the word for a met or missed target."""
    return "met" if met else "missed"


def main(arguments: list[str]) -> int:
    """Print one line for each cell, and the pooled figures; return how many targets are not shown to be met."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--conditions", nargs="+", choices=list(CONDITIONS), default=list(CONDITIONS))
    parser.add_argument("--estimator", choices=ESTIMATORS, default="unknown")
    parser.add_argument("--without-pressure", action="store_true", help="position and velocity are all that is logged")
    parser.add_argument("--csv", help="write every estimate to this file")
    options = parser.parse_args(arguments)
    pressure = not options.without_pressure
    cases = [
        Case(drive, condition, seed, options.estimator, pressure)
        for drive in DRIVES
        for condition in options.conditions
        for seed in range(options.seeds)
    ]
    rows = pd.DataFrame(list(map_in_parallel(run_case, cases)))
    if options.csv:
        rows.to_csv(options.csv, index=False)
    cells = pd.DataFrame(
        [
            {"drive": drive, "condition": condition} | summary_of_runs(cell)
            for (drive, condition), cell in rows.groupby(["drive", "condition"], sort=False)
        ]
    )
    cells["in_cell"] = [
        coverage_verdict(round(c / 100.0 * n), n, WANTED_CELL)
        for c, n in zip(cells["coverage"], cells["runs"], strict=True)
    ]
    print(cells.to_string(index=False, float_format="%.4f"))
    pooled, covered, wanted = summary_of_runs(rows), int(rows["covered"].sum()), WANTED_RATIO[pressure]
    low, high = coverage_range(covered, len(rows))
    worst = float(cells["over_bound"].max())
    verdicts = {
        f"coverage of {len(rows)} intervals {pooled['coverage']:.1f} % (95 % range {low:.1f} to {high:.1f}), wanted "
        f"{WANTED_POOLED[0]} to {WANTED_POOLED[1]}": coverage_verdict(covered, len(rows), WANTED_POOLED),
        f"cells whose coverage is out of {WANTED_CELL[0]} to {WANTED_CELL[1]} % by more than chance: "
        f"{(cells['in_cell'] == 'missed').sum()} of {len(cells)}": verdict_word(
            not (cells["in_cell"] == "missed").any()
        ),
        f"NEES {pooled['nees']:.3f}, wanted {pooled['nees_low']:.3f} to {pooled['nees_high']:.3f}": verdict_word(
            pooled["nees_low"] <= pooled["nees"] <= pooled["nees_high"]
        ),
        f"RMSE over the bound {pooled['over_bound']:.3f} pooled, {worst:.3f} in the worst cell, wanted at most {wanted}"
        " in each": verdict_word(worst <= wanted),
    }
    which = f"{options.estimator}, {'with' if pressure else 'without'} pressure"
    keep_figure(Check(f"{which}: RMSE over the bound, worst cell", worst, most=wanted))
    keep_figure(Check(f"{which}: coverage [%]", pooled["coverage"], *WANTED_POOLED))
    print("\npooled")
    print("\n".join(f"  {line}: {verdict}" for line, verdict in verdicts.items()))
    return len(verdicts) - list(verdicts.values()).count("met")
