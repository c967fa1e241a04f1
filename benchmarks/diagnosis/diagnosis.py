"""Diagnosis against its targets: accuracy, calibration, severity, unknowns, foreign logs, speed.

The population is `benchmarks.diagnosis.population`: the circuit plant, rig sensors, nine steps and a random binary
signal of 10 s, test seeds only. ``--seeds`` and ``--draws`` make it smaller; zero draws skip the limit. Foreign logs
are read from ``$HYDROSTATE_SHARED/bench``.
"""

import argparse
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from benchmarks.diagnosis.diagnosis_checks import (
    PAPER_RIG,
    coverage_by_severity,
    foreign_checks,
    limit_checks,
    onset_checks,
    speed_checks,
    stuck_checks,
    unknown_checks,
)
from benchmarks.diagnosis.population import TEST, DrawnLog, draw_logs
from benchmarks.diagnosis.scores import calibration_error, share_interval
from benchmarks.targets import Check, print_and_keep
from estimation.finding import Finding
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.rmse import score_mathematical
from faults.diagnosis.severity import severities_at
from faults.eha.bank import mathematical_bank
from plant.eha.model import EhaParameters

PRESSURE = "differential_pressure_pa"

SHIPPED = ("models", "innovations", "parameters")
"""Kinds of evidence that a diagnosis weighs."""

LUMPED_SEEDS = 5
"""Seeds on which the paper's lumped models are also scored."""


@dataclass(frozen=True, eq=False)
class DiagnosedLog:
    """One log of the population, diagnosed."""

    log: DrawnLog
    found: Finding
    covered: Mapping[str, bool]


def main(arguments: list[str]) -> int:
    """Print every figure with its target; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--draws", type=int, default=2000)
    options = parser.parse_args(arguments)
    actuator = actuator_of(EhaParameters())
    checks: list[Check] = []

    for pressure, wanted in ((True, 98.0), (False, 94.0)):
        began = time.process_time()
        judged = list(diagnose_logs(draw_logs(range(TEST, TEST + options.seeds)), actuator, pressure=pressure))
        seconds = (time.process_time() - began) / len(judged)
        print(f"\n{len(judged)} logs {log_set_name(pressure)}, {seconds:.3f} CPU s each")
        print(confusions(judged).to_string())
        checks += print_and_keep(population_checks(judged, log_set_name(pressure), wanted))
    for pressure in (True, False):
        checks += print_and_keep(other_circuits(actuator, seeds=max(1, options.seeds // 5), pressure=pressure))
    if options.draws:
        checks += print_and_keep(limit_checks(seeds=max(2, options.seeds // 4), draws=options.draws))
    checks += print_and_keep(onset_checks(seeds=max(1, options.seeds // 10)))
    checks += print_and_keep(unknown_checks(seeds=max(1, options.seeds // 25)))
    checks += print_and_keep(foreign_checks(actuator))
    checks += print_and_keep(stuck_checks())
    checks += print_and_keep(speed_checks())
    short = sum(not check.met for check in checks)
    print(f"{short} of {len(checks)} fall short")
    return short


def log_set_name(pressure: bool) -> str:
    """Return the name of a set of logs."""
    return "with dp" if pressure else "without dp"


def diagnose_logs(logs: Iterable[DrawnLog], actuator: Actuator, *, pressure: bool) -> Iterable[DiagnosedLog]:
    """Diagnose logs and compare the results with the truth."""
    for log in logs:
        record = log.record if pressure else log.record.replace(**{PRESSURE: None})
        found = diagnose_log(record, PAPER_RIG)
        true = severities_at(coordinates_of(log.parameters, actuator.rated), actuator)
        yield DiagnosedLog(log, found, coverage_by_severity(found, true))


def other_circuits(actuator: Actuator, seeds: int, *, pressure: bool) -> list[Check]:
    """Return accuracy and coverage on circuits of a different kind from the fitted one."""
    judged = list(
        diagnose_logs(draw_logs(range(TEST + 300, TEST + 300 + seeds), like=False), actuator, pressure=pressure)
    )
    name = f"{len(judged)} logs of other circuits {log_set_name(pressure)}"
    right = 100.0 * float(np.mean([one.found.condition == one.log.condition for one in judged]))
    covered = 100.0 * float(np.mean([list(one.covered.values()) for one in judged]))
    dated = sum(one.found.since is not None for one in judged)
    return [
        Check(f"{name}: class right, %", right, 94.0, 100.0),
        Check(f"{name}: 95 % intervals that cover, %", covered, 85.0, 100.0),
        Check(f"{name}: taken to have changed", dated, 0, 0.01 * len(judged)),
    ]


def confusions(judged: list[DiagnosedLog]) -> pd.DataFrame:
    """Return the confused pairs, true against found."""
    wrong = [(one.log.condition, one.found.condition) for one in judged if one.log.condition != one.found.condition]
    return pd.DataFrame(wrong, columns=["true", "found"]).value_counts().rename("count").reset_index()


def population_checks(judged: list[DiagnosedLog], name: str, wanted: float) -> list[Check]:
    """Return accuracy, calibration, coverage and false flags of the population."""
    truths = [one.log.condition for one in judged]
    right = np.array([one.found.condition == true for one, true in zip(judged, truths, strict=True)])
    sure = np.array([one.found.probabilities[one.found.condition] for one in judged])
    low, high = (100.0 * end for end in share_interval(int(right.sum()), len(right)))
    each = {
        e: [one.found.evidence.diagnosis.scoreboard.choice(e) == one.log.condition for one in judged] for e in SHIPPED
    }
    print("each evidence alone, % right:", {e: round(100.0 * float(np.mean(hits)), 1) for e, hits in each.items()})
    brier = np.mean(
        [
            sum((p - (c == t)) ** 2 for c, p in o.found.probabilities.items())
            for o, t in zip(judged, truths, strict=True)
        ]
    )
    print(f"Brier score {brier:.4f}; accuracy's 95 % interval {low:.1f} to {high:.1f} %")
    print("the paper's way (b), lumped models, % right:", round(100.0 * lumped_accuracy(judged, name), 1))
    checks = [
        Check(f"{name}: accuracy, %", 100.0 * float(np.mean(right)), wanted, 100.0),
        Check(f"{name}: calibration error (ECE, 15 bins)", calibration_error(sure, right), 0.0, 0.03),
        Check(f"{name}: in-model logs flagged, %", 100.0 * float(np.mean([o.found.unknown for o in judged])), 0.0, 3.0),
    ]
    for severity in judged[0].covered:
        share = 100.0 * float(np.mean([one.covered[severity] for one in judged]))
        checks.append(Check(f"{name}: 95 % intervals of {severity} that cover, %", share, 90.0, 99.0))
    return checks


def lumped_accuracy(judged: list[DiagnosedLog], name: str) -> float:
    """Return the share of logs for which the true condition's lumped model has the smallest error."""
    bank = mathematical_bank(EhaParameters())
    some = [one.log for one in judged if int(one.log.record.metadata["seed"]) < TEST + LUMPED_SEEDS]
    hits = [score_mathematical(log.record, bank, pressure=name == "with dp").condition == log.condition for log in some]
    return float(np.mean(hits))
