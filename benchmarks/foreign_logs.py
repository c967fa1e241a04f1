"""Logs that this project did not make: bulk modulus and class against the truth that came with them.

The flow form is given the healthy actuator and no condition; the filter is given the condition.

Reads ``$HYDROSTATE_SHARED/bench`` (default ``../shared/bench``).
"""

import os
from pathlib import Path

import pandas as pd

from estimation.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from faults.bank import mathematical_bank
from faults.classify import score_mathematical
from faults.conditions import CONDITIONS, parameters_for
from plant.eha import EhaParameters
from plant.record_files import read_record

STARTS = (0.5e8, 4e8)


def main(arguments: list[str]) -> int:
    """Print one line a log; return how far the counts fall short."""
    del arguments
    folder = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "bench"
    if not (folder / "truth.csv").exists():
        print(f"skipped: no logs in {folder}")
        return 0
    names = {(c.leakage, c.friction): name for name, c in CONDITIONS.items()}
    bank = mathematical_bank(EhaParameters())
    rows: list[dict[str, object]] = []
    for truth in pd.read_csv(folder / "truth.csv", keep_default_na=False).itertuples():
        record = read_record(folder / str(truth.file))
        condition = names[str(truth.leakage), str(truth.friction)]
        p = parameters_for(CONDITIONS[condition])
        flow = [estimate_bulk_modulus(record, EhaParameters(), form="flow", start=start) for start in STARTS]
        online = [estimate_bulk_modulus(record, p, form="pressure", start=start, start_std=1e8) for start in STARTS]
        scores = score_mathematical(record, bank)
        true = float(truth.bulk_modulus_pa)
        rows.append(
            {
                "file": truth.file,
                "condition": condition,
                "found": scores.condition,
                "class_right": scores.condition == condition,
                "flow_percent": worst_error(flow, true),
                "flow_covers": all(f.interval is not None and f.interval[0] < true < f.interval[1] for f in flow),
                "flow_gate": all(f.gate.passed for f in flow),
                "filter_percent": worst_error(online, true),
                "filter_gate": all(f.gate.passed for f in online),
            }
        )
    table = pd.DataFrame(rows)
    print(table.to_string(index=False, float_format="%.2f"))
    count = len(table)
    print(
        f"\nflow form, condition unknown: within 1 % {(table['flow_percent'] <= 1.0).sum()} of {count}, median "
        f"{table['flow_percent'].median():.2f} %, 95 % intervals cover {table['flow_covers'].sum()}, gate passed "
        f"{table['flow_gate'].sum()}"
    )
    close = int((table["filter_percent"] <= 10.0).sum())
    right = int(table["class_right"].sum())
    print(f"pressure form (filter), condition given: within 10 % {close} of {count} (14 wanted)")
    print(f"class right: {right} of {count} (15 wanted)")
    return max(0, 14 - close) + max(0, 15 - right)


def worst_error(found: list[BulkModulusEstimate], true: float) -> float:
    """Return the largest error in percent; infinite where a start gave no number."""
    return max(float("inf") if f.value is None else 100.0 * abs(f.value / true - 1.0) for f in found)
