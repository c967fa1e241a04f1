"""Logs that this project did not make: bulk modulus and class against the truth that came with them.

Reads ``$HYDROSTATE_SHARED/bench`` (default ``../shared/bench``).
"""

import os
from pathlib import Path

import pandas as pd

from estimation.bulk_modulus import estimate_bulk_modulus
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
        found = [estimate_bulk_modulus(record, p, start=start, start_std=1e8) for start in STARTS]
        errors = [100.0 * (f.value / float(truth.bulk_modulus_pa) - 1.0) for f in found if f.value is not None]
        scores = score_mathematical(record, bank)
        rows.append(
            {
                "file": truth.file,
                "condition": condition,
                "found": scores.condition,
                "class_right": scores.condition == condition,
                "worst_error_percent": max(map(abs, errors)) if len(errors) == len(STARTS) else float("inf"),
                "gate_passed": all(f.gate.passed for f in found),
            }
        )
    table = pd.DataFrame(rows)
    print(table.to_string(index=False, float_format="%.2f"))
    close = int((table["worst_error_percent"] <= 10.0).sum())
    right = int(table["class_right"].sum())
    print(f"\nwithin 10 %: {close} of {len(table)} (14 wanted); class right: {right} of {len(table)} (15 wanted)")
    return max(0, 14 - close) + max(0, 15 - right)
