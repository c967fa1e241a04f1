"""Writes sets of logs as folders: one file for each log, `truth.csv`, and a rig file if the kind provides one."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from experiments.open_benchmark.kinds import VERSION, MadeLog, make, seed_of
from experiments.open_benchmark.machine import Machine
from faults.conditions import CONDITIONS
from plant.atomic import replacing
from plant.errors import HydrostateError

TRUTH = "truth.csv"

RIG = "rig.toml"


def truth_of(made: MadeLog, split: str, index: int) -> dict[str, Any]:
    """Return the row of `truth.csv` for a log, with the coefficients at the middle of the log.

    Returns
    -------
    dict[str, Any]
        SI values by name, and text.
    """
    kind, setup, m, change = made.kind, made.setup, made.setup.machine, made.setup.change
    condition, states = CONDITIONS[setup.condition], made.states
    low, high = made.bulk_modulus
    accept, named, difference = (
        kind.right_verdicts(setup.condition),
        kind.named,
        np.max(np.abs(states[:, 4] - states[:, 5])),
    )
    if difference < m.relief < Machine().relief:  # a low-set valve that never opened leaves no trace
        accept, named = tuple(dict.fromkeys((*accept, setup.condition))), ""
    return {
        "file": f"run{index:03d}.csv",
        "set": kind.name,
        "note": kind.strange,
        "input": setup.drive,
        "sample_time_s": setup.logger.sample_time,
        "leakage": condition.leakage,
        "friction": condition.friction,
        "leak_coeff": m.leakage * np.sqrt(change.wear / change.viscosity),
        "flow_bias": m.flow_bias,
        "a1": m.quadratic,
        "a2": m.linear * np.sqrt(change.viscosity),
        "a3": m.coulomb,
        "bulk_modulus_pa": np.sqrt(low * high),
        "beta_lo": low,
        "beta_hi": high,
        "accept": ";".join(accept),
        "rig": RIG if setup.rig else "",
        "columns": "",
        "sev": int(kind.severity and setup.condition in kind.right_verdicts(setup.condition)),
        "vmax": np.max(np.abs(states[:, 3])),
        "dpmax": difference,
        "xmin": np.min(states[:, 2]),
        "xmax": np.max(states[:, 2]),
        "version": VERSION,
        "split": split,
        "index": index,
        "condition": setup.condition,
        "named": named,
        "steady": change.steady,
        "since_s": "" if change.late_wear == 1.0 else setup.begins(change.late_from),
    }


def _rig_text(name: str, note: str, entries: Mapping[str, float]) -> str:
    """Return a rig file with only the given entries."""
    lines = [f"# {note}", f'name = "{name}"', "", "[parameters]"]
    return "\n".join([*lines, *(f"{entry} = {value!r}" for entry, value in entries.items())]) + "\n"


def write_set(kind: str, split: str, count: int, out: Path, first: int = 0) -> Path:
    """Write the first logs of a kind and split as a folder of the kind's name.

    Parameters
    ----------
    kind : str
        One of `KINDS`, or two with a plus sign between them.
    split : str
        One of `SPLITS`.
    count : int
        Number of logs.
    out : Path
        Folder in which the set's folder is created.
    first : int
        Index of the first log.

    Returns
    -------
    Path
        The folder's `truth.csv`.

    Raises
    ------
    HydrostateError
        If there is no such kind or split, or the folder cannot be written.
    """
    if count < 1:
        raise HydrostateError(f"count must be at least 1, got {count!r}")
    seed_of(kind, split, first)
    folder, rows = out / kind, list[dict[str, Any]]()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for index in range(first, first + count):
            made = make(kind, split, index)
            row = truth_of(made, split, index)
            made.log.to_csv(folder / str(row["file"]), index=False, float_format="%.9g", lineterminator="\n")
            if made.setup.rig:
                (folder / RIG).write_text(_rig_text(kind, made.kind.strange, made.setup.rig), "utf-8")
            rows.append(row)
        with replacing(folder / TRUTH) as file:  # written last, so a folder with this file is complete
            file.write(pd.DataFrame(rows).to_csv(index=False, lineterminator="\n").encode())
    except OSError as error:
        raise HydrostateError(f"{folder}: cannot be written: {error.strerror or error}") from error
    return folder / TRUTH
