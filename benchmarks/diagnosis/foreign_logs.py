"""Logs that this project did not make: bulk modulus and class against the truth supplied with them.

Every form gets the healthy actuator and no condition. Reads ``$HYDROSTATE_SHARED/bench`` (default ``../shared/bench``).
The online filter is one of `ONLINE`, if the project has one; ``--class`` also scores the nine conditions.
"""

import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from estimation.eha.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from faults.conditions import CONDITIONS
from faults.diagnosis.rmse import score_mathematical
from faults.eha.bank import mathematical_bank
from plant.eha.model import EhaParameters
from plant.log.files import read_record
from plant.log.record import Record

HEALTHY = EhaParameters()

SAFE_PERCENT = 10.0
"""Error above which the gate must reject the estimate [%]."""

OnlineFilter = Callable[[Record], float]
"""Final effective bulk modulus [Pa] of an online filter, condition unknown."""

ONLINE: Mapping[str, OnlineFilter] = {}
"""Online filters by name; each adds a column and a count. The flow form's filter belongs here."""


def main(arguments: list[str]) -> int:
    """Print one line for each log, and the counts with their targets; return how many counts fall short."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "bench"
    if not (folder / "truth.csv").exists():
        print(f"skipped: no logs in {folder}")
        return 0
    bank = mathematical_bank(HEALTHY) if "--class" in arguments else None
    compile_kernels(read_record(folder / "run000.csv").slice(0, 300))
    rows: list[dict[str, object]] = []
    for truth in pd.read_csv(folder / "truth.csv", keep_default_na=False).itertuples():
        record, true = read_record(folder / str(truth.file)), float(str(truth.bulk_modulus_pa))
        row: dict[str, object] = {"file": truth.file, "leakage": truth.leakage, "friction": truth.friction}
        row |= estimate_row(record, true, "with")
        row |= estimate_row(record.replace(differential_pressure_pa=None), true, "without")
        row |= {name: 100.0 * (online(record) / true - 1.0) for name, online in ONLINE.items()}
        if bank is not None:
            wanted = {(c.leakage, c.friction): name for name, c in CONDITIONS.items()}
            row["class"] = score_mathematical(record, bank).condition == wanted[str(truth.leakage), str(truth.friction)]
        rows.append(row)
    table = pd.DataFrame(rows)
    print(table.to_string(index=False, float_format="%.2f"))
    return print_counts(table)


def compile_kernels(record: Record) -> None:
    """Compile every kernel, so that no timing includes compilation."""
    for log in (record, record.replace(differential_pressure_pa=None)):
        estimate_bulk_modulus(log, HEALTHY)


def estimate_row(record: Record, true: float, which: str) -> dict[str, object]:
    """Return error, half-width, coverage, gate and time of one estimate, in percent and seconds."""
    began = time.process_time()
    found = estimate_bulk_modulus(record, HEALTHY)
    seconds = time.process_time() - began
    interval = found.interval
    return {
        f"{which}_dp_%": error(found, true),
        f"{which}_+-%": np.nan if interval is None else 50.0 * (interval[1] - interval[0]) / true,
        f"{which}_covers": interval is not None and interval[0] < true < interval[1],
        f"{which}_gate": found.gate.passed,
        f"{which}_s": seconds,
    }


def error(found: BulkModulusEstimate, true: float) -> float:
    """Return the error in percent; infinite if there is no estimate."""
    return float("inf") if found.value is None else 100.0 * (found.value / true - 1.0)


def print_counts(table: pd.DataFrame) -> int:
    """Print every count with its target; return how many fall short."""
    pressure, motion = table["with_dp_%"].abs(), table["without_dp_%"].abs()
    believed = motion[table["without_gate"] & np.isfinite(motion)]
    slowest = max(table["with_s"].max(), table["without_s"].max())
    counts = [
        ("with dp, within 2 %", int((pressure <= 2.0).sum()), 18),
        ("with dp, within 1 %", int((pressure <= 1.0).sum()), 16),
        ("with dp, 95 % intervals cover", int(table["with_covers"].sum()), 16),
        ("without dp, within 5 %", int((motion <= 5.0).sum()), 15),
        *((f"{name}, within 5 %", int((table[name].abs() <= 5.0).sum()), 18) for name in ONLINE),
        *([("class right", int(table["class"].sum()), 15)] if "class" in table else []),
    ]
    for what, count, wanted in counts:
        print(f"{what}: {count} of {len(table)} ({wanted} wanted)")
    limits = [
        ("with dp, median error, %", float(pressure.median()), 0.5),
        ("without dp, largest error that the gate lets pass, %", float(believed.max()), SAFE_PERCENT),
        ("slowest log, CPU s", float(slowest), 5.0),
    ]
    for what, value, limit in limits:
        print(f"{what}: {value:.2f} (under {limit:g} wanted)")
    short = sum(count < wanted for _, count, wanted in counts)
    return short + sum(not value < limit for _, value, limit in limits)
