"""Further checks of the diagnosis benchmark: the limit, unknowns, foreign logs, sticking, speed."""

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.diagnosis.population import (
    DRIVES,
    DURATION,
    OUT_OF_MODEL,
    SAMPLE_TIME,
    TEST,
    TRAINING,
    draw_logs,
    draw_parameters,
)
from benchmarks.targets import Check
from estimation.finding import Finding
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of, predicted_outputs
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.severity import severities_at
from faults.eha.inject import abrupt_fault
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate, simulate_each
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.sensors import RIG
from plant.solvers.steps import parameter_row

PRESSURE = "differential_pressure_pa"

WIDE_SPREAD = 0.2
"""Spread at which the limit is computed [dimensionless]."""

PAPER_RIG = Rig(EhaParameters())
"""The paper's rig, which a user without a rig file gets."""

CHUNK = 64
"""Number of draws simulated at a time."""


def coverage_by_severity(found: Finding, true: Mapping[str, float]) -> dict[str, bool]:
    """Return, for each severity with an interval, whether the interval covers the true value."""
    names = [name for name, one in found.severities.items() if name in true and one.ci95 is not None]
    return {name: found.severities[name].covers(true[name]) for name in names if name != "entrained_air"}


def limit_checks(seeds: int, draws: int) -> list[Check]:
    """Compare with the likelihood marginalised over drawn actuators, at a wide spread; one drive of each kind."""
    rights: dict[str, list[tuple[bool, bool]]] = {"with dp": [], "without dp": []}
    for which, drive in enumerate(DRIVES):
        rng = np.random.default_rng([TEST, which, 20])
        speed = make_drive(drive, DURATION, SAMPLE_TIME, EhaParameters(), rng)
        truths = [name for _ in range(seeds) for name in CONDITIONS]
        actuators = [draw_parameters(name, rng, WIDE_SPREAD) for name in truths]
        records = simulate_each(CIRCUIT, speed, SAMPLE_TIME, actuators, sensors=RIG, rngs=rng.spawn(len(truths)))
        logs = [blocks_of(record) for record in records]
        for name, found in marginal_choices(logs, speed, draws, np.random.default_rng([TRAINING, which])).items():
            for record, true, best in zip(records, truths, found, strict=True):
                seen = record if name == "with dp" else record.replace(**{PRESSURE: None})
                rights[name].append((diagnose_log(seen, PAPER_RIG).condition == true, best == true))
    checks: list[Check] = []
    for name, pairs in rights.items():
        ours, best = (100.0 * float(np.mean(each)) for each in zip(*pairs, strict=True))
        what = (
            f"{name}: points below the marginal likelihood of {draws} draws a class ({ours:.1f} against {best:.1f} %)"
        )
        checks.append(Check(f"{what}, spread 20 %, {len(pairs)} logs", best - ours, -100.0, 2.0))
    return checks


def marginal_choices(logs: list[Blocks], speed: Array, draws: int, rng: np.random.Generator) -> dict[str, list[str]]:
    """Return the class whose drawn actuators make each log most likely, with and without pressure."""
    noise = np.sqrt(np.mean([log.noise**2 for log in logs], axis=0))
    measured = np.array([log.outputs / noise for log in logs])
    driven = replace(logs[0], speed=np.ascontiguousarray(speed[: len(logs[0].speed)]))
    totals = np.full((2, len(CONDITIONS), len(logs)), -np.inf)
    for c, name in enumerate(CONDITIONS):
        for begin in range(0, draws, CHUNK):
            drawn = [draw_parameters(name, rng, WIDE_SPREAD) for _ in range(min(CHUNK, draws - begin))]
            runs = predicted_outputs(driven, np.array([parameter_row(p) for p in drawn])) / noise
            apart = np.array([_squares(measured[:, :, k], runs[:, :, k]) for k in range(2)])
            for row, squares in enumerate((apart[0] + apart[1], apart[0])):
                totals[row, c] = np.logaddexp(totals[row, c], np.logaddexp.reduce(-0.5 * squares, axis=1))
    names = list(CONDITIONS)
    found = [[names[int(i)] for i in np.argmax(total, axis=0)] for total in totals]
    return dict(zip(("with dp", "without dp"), found, strict=True))


def _squares(measured: Array, runs: Array) -> Array:
    """Return squared distances, shape (logs, draws)."""
    return np.sum(measured**2, axis=1)[:, None] - 2.0 * measured @ runs.T + np.sum(runs**2, axis=1)


def unknown_checks(seeds: int) -> list[Check]:
    """Count the out-of-model logs that are flagged, by kind."""
    flagged: Counter[str] = Counter()
    count = 0
    for log in draw_logs(range(TEST + 500, TEST + 500 + seeds)):
        count += 1
        for kind, changed in OUT_OF_MODEL.items():
            flagged[kind] += diagnose_log(changed(log), PAPER_RIG).unknown
    print(f"\nout of the model, flagged of {count} logs each")
    for kind in OUT_OF_MODEL:
        print(f"  {kind}: {100.0 * flagged[kind] / count:.0f} %")
    share = 100.0 * flagged.total() / (count * len(OUT_OF_MODEL))
    return [Check(f"out-of-model logs flagged, %, {len(OUT_OF_MODEL)} kinds", share, 90.0, 100.0)]


def foreign_logs(folder: Path) -> Iterator[tuple[str, EhaParameters, Record]]:
    """Yield condition, true actuator and log of a bench that is not ours."""
    wanted = {(c.leakage, c.friction): name for name, c in CONDITIONS.items()}
    columns = {"leakage_coefficient": "leak_coeff", "flow_bias": "flow_bias", "bulk_modulus": "bulk_modulus_pa"}
    columns |= {"friction_quadratic": "a1", "friction_linear": "a2", "friction_coulomb": "a3"}
    for _, row in pd.read_csv(folder / "truth.csv", keep_default_na=False).iterrows():
        name = wanted[str(row["leakage"]), str(row["friction"])]
        true = replace(
            parameters_for(CONDITIONS[name]), **{ours: float(row[theirs]) for ours, theirs in columns.items()}
        )
        yield name, true, read_record(folder / str(row["file"]))


def foreign_checks(actuator: Actuator) -> list[Check]:
    """Check class, severity and flags on the foreign logs."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "bench"
    if not (folder / "truth.csv").exists():
        print(f"skipped: no logs in {folder}")
        return []
    checks: list[Check] = []
    for pressure in (True, False):
        right, flagged, covered = 0, 0, []
        for name, true, record in foreign_logs(folder):
            found = diagnose_log(record if pressure else record.replace(**{PRESSURE: None}), PAPER_RIG)
            right, flagged = right + (found.condition == name), flagged + found.unknown
            truth = severities_at(coordinates_of(true, actuator.rated), actuator)
            covered += coverage_by_severity(found, truth).values()
        with_or_without = "with dp" if pressure else "without dp"
        share = 100.0 * float(np.mean(covered))
        checks.append(Check(f"foreign logs {with_or_without}: class right, of 18", right, 18, 18))
        checks.append(Check(f"foreign logs {with_or_without}: flagged unknown, of 18", flagged, 0, 0))
        checks.append(Check(f"foreign logs {with_or_without}: 95 % intervals that cover, %", share, 85.0, 100.0))
    return checks


def onset_checks(seeds: int) -> list[Check]:
    """Diagnose logs of an actuator whose fault begins within the log."""
    names = [name for name in CONDITIONS if name != "normal"]
    checks: list[Check] = []
    logs: list[tuple[str, float, Record]] = []
    for seed in range(seeds):
        for which, drive in enumerate(DRIVES):
            rng = np.random.default_rng([TEST + 700 + seed, which])
            speed = make_drive(drive, DURATION, SAMPLE_TIME, EhaParameters(), rng)
            for name in names:
                at = float(rng.uniform(0.2, 0.8)) * DURATION
                path = abrupt_fault(draw_parameters("normal", rng, 0.1), draw_parameters(name, rng, 0.1), at)
                logs.append((name, at, simulate(CIRCUIT, speed, SAMPLE_TIME, path, sensors=RIG, rng=rng)))
    for pressure in (True, False):
        right, dated, held = 0, 0, 0
        late: list[float] = []
        for name, at, record in logs:
            found = diagnose_log(record if pressure else record.replace(**{PRESSURE: None}), PAPER_RIG)
            onset = found.since
            right += found.condition == name
            if onset is not None:
                dated, held = dated + 1, held + (onset.ci95[0] <= at <= onset.ci95[1])
                late.append(abs(onset.since - at))
        said = f"{len(logs)} logs that change {'with' if pressure else 'without'} dp"
        error = f"median error {1e3 * float(np.median(late)):.0f} ms" if late else "none"
        checks.append(Check(f"{said}: condition after it right, %", 100.0 * right / len(logs), 94.0, 100.0))
        checks.append(Check(f"{said}: dated, %, {error}", 100.0 * dated / len(logs), 90.0, 100.0))
        checks.append(Check(f"{said}: interval of the time covers, %", 100.0 * held / max(dated, 1), 85.0, 100.0))
    return checks


def stuck_checks() -> list[Check]:
    """Diagnose a 10 Hz sine that leaves the piston stuck: leakage is found, friction stays undecided."""
    right, widest = 0, 0.0
    for seed, (name, condition) in enumerate(CONDITIONS.items()):
        p = draw_parameters(name, np.random.default_rng([TEST, seed]), 0.0)
        drive = make_drive("sine", DURATION, SAMPLE_TIME, p, np.random.default_rng(seed))
        record = simulate(CIRCUIT, drive, SAMPLE_TIME, p, sensors=RIG, rng=np.random.default_rng(seed))
        found = diagnose_log(record, PAPER_RIG)
        shares = found.probabilities
        level = {c: sum(v for n, v in shares.items() if CONDITIONS[n].leakage == c) for c in ("none", "minor", "major")}
        alike = [v for n, v in shares.items() if CONDITIONS[n].leakage == condition.leakage]
        travel = float(np.ptp(record["position_m"]))
        untold = "; ".join(str(note) for note in found.not_told)
        print(
            f"sine, {name}: piston travels {1e3 * travel:.2f} mm; leakage {level[condition.leakage]:.2f}, "
            f"friction none, minor, major {', '.join(f'{v:.2f}' for v in alike)}; {untold}"
        )
        right += max(level, key=lambda c: level[c]) == condition.leakage
        widest = max(widest, max(alike))
    return [
        Check("10 Hz sine, piston stuck: leakage right, of 9", right, 9, 9),
        Check("10 Hz sine, piston stuck: largest probability of one friction level", widest, 0.0, 0.8),
    ]


def speed_checks() -> list[Check]:
    """Time one diagnosis with all four kinds of evidence, after start-up."""
    checks: list[Check] = []
    for duration, sample_time, most in ((20.0, 1e-3, 0.5), (10.0, 1e-4, 2.0)):
        taken: list[float] = []
        for log in draw_logs([TEST + 900], duration=duration, sample_time=sample_time):
            diagnose_log(log.record, PAPER_RIG)
            began = time.process_time()
            diagnose_log(log.record, PAPER_RIG)
            taken.append(time.process_time() - began)
        what = f"one log of {duration:g} s at {1e-3 / sample_time:g} kHz, CPU s: median {np.median(taken):.2f}"
        checks.append(Check(f"{what}, slowest of {len(taken)}", max(taken), 0.0, most))
    return checks
