"""Scores what ships on sets of logs: every log is read, estimated and diagnosed as a user would, with its rig file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any

import pandas as pd

from experiments.open_benchmark.judge import judge_bulk_modulus, judge_class, named
from experiments.open_benchmark.loaders import read_truth, rows_of
from experiments.python_user.log import Log
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.severity import severities_at
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError

FAILED: Mapping[str, Any] = {"outcome": "failed"}

OF_PRESSURE = "pressure_"
"""What the names of kinds begin with of which the pressure sensor alone is strange: without pressure they are plain."""

COEFFICIENTS: Mapping[str, str] = {
    "leakage_coefficient": "leak_coeff",
    "flow_bias": "flow_bias",
    "bulk_modulus": "bulk_modulus_pa",
    "friction_quadratic": "a1",
    "friction_linear": "a2",
    "friction_coulomb": "a3",
}
"""Parameters that a truth gives, by its column."""


def score_set(folder: Path, count: int, *, pressure: bool) -> Iterator[dict[str, Any]]:
    """Yield a row for each of the first logs of a set.

    Parameters
    ----------
    folder : Path
        With `truth.csv`.
    count : int
        Of logs, at most.
    pressure : bool
        Whether pressure may be used.

    Yields
    ------
    dict[str, Any]
        What `judge_bulk_modulus` and `judge_class` give, severities covered of how many, and processor time [s].
    """
    for told in rows_of(read_truth(folder).head(count)):
        truth, began = told if pressure else without_pressure(told), process_time()
        estimate, diagnosis, rig = _answers(folder, truth, pressure)
        row = {"set": folder.name, "file": truth["file"], "input": truth["input"], "pressure": pressure}
        row |= judge_bulk_modulus(estimate, truth) | judge_class(diagnosis, truth)
        row["named"] = named(str(truth.get("named", "")), estimate, diagnosis)
        hits = _severities(diagnosis, truth, rig) if int(truth["sev"] or 0) else []
        yield {**row, "severities": len(hits), "covered_severities": sum(hits), "seconds": process_time() - began}


def without_pressure(truth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the truth of a log whose pressure is not used: what is strange of that sensor alone is not there.

    Parameters
    ----------
    truth : Mapping
        A row of `truth.csv`.

    Returns
    -------
    Mapping[str, Any]
        Where the pressure sensor alone is strange, the row of a plain log: its condition is the one right verdict, and
        nothing need be named. Any other row as it was.
    """
    of_pressure = str(truth.get("set", "")).startswith(OF_PRESSURE) and truth.get("condition")
    return {**truth, "accept": truth["condition"], "named": ""} if of_pressure else truth


def _answers(folder: Path, truth: Mapping[str, Any], pressure: bool) -> tuple[Any, Any, EhaParameters]:
    """Return the entries of both verbs, and the healthy actuator that they were told."""
    from hydrostate import read

    rig = folder / truth["rig"] if truth["rig"] else None
    try:
        log = read(folder / truth["file"], rig=rig)
    except HydrostateError as error:
        failed = {**FAILED, "message": str(error)}
        return failed, failed, EhaParameters()
    return _asked(log, "estimate", pressure), _asked(log, "diagnose", pressure), log.rig.parameters


def _asked(log: Log, verb: str, pressure: bool) -> Mapping[str, Any]:
    try:
        return getattr(log, verb)(no_pressure=not pressure).to_dict()
    except HydrostateError as error:
        return {**FAILED, "message": str(error)}


def _severities(said: Mapping[str, Any], truth: Mapping[str, Any], healthy: EhaParameters) -> list[bool]:
    """Return which severities' intervals cover what they truly are, by the project's own definition of each."""
    from dataclasses import replace

    actuator = actuator_of(healthy)
    true = replace(healthy, **{name: float(truth[column]) for name, column in COEFFICIENTS.items()})
    exact = severities_at(coordinates_of(true, actuator.rated), actuator)
    told = {name: one["ci95"] for name, one in (said.get("severity") or {}).items() if name != "entrained_air"}
    ends = {name: ci for name, ci in told.items() if ci is not None and None not in ci}
    oil = float(truth["beta_lo"]), float(truth["beta_hi"])
    ranges = {name: oil if name == "bulk_modulus" else (exact[name], exact[name]) for name in ends}
    return [ci[0] <= ranges[name][1] and ci[1] >= ranges[name][0] for name, ci in ends.items()]


def summary(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return one line a set and sensors: counts, errors [%] and processor time a log [s].

    Parameters
    ----------
    rows : sequence of Mapping
        As `score_set` yields them.
    """
    lines: list[dict[str, Any]] = []
    for (name, pressure), part in pd.DataFrame(rows).groupby(["set", "pressure"], sort=False):
        sizes = 100.0 * part["error"].dropna().astype(float).abs()
        told, since = part["named"].dropna(), part["since"].dropna()
        lines.append(
            {
                "set": name,
                "pressure": pressure,
                "logs": len(part),
                "numbers": len(sizes),
                "median_%": sizes.median(),
                "max_%": sizes.max(),
                "covered": int(part["covered"].eq(True).sum()),
                "covered_total": int(part["covered_total"].eq(True).sum()),
                "flagged": int(part["flagged"].sum()),
                "silent_beta": int(part["silent_beta"].sum()),
                "narrow": int(part["narrow"].sum()),
                "right": int(part["right"].sum()),
                "unknown": int(part["verdict"].eq("unknown").sum()),
                "false_unknown": int(part["false_unknown"].sum()),
                "wrong": int(part["verdict"].isin(["wrong", "failed"]).sum()),
                "silent_class": int(part["silent_class"].sum()),
                "false_since": int(part["false_since"].sum()),
                "since": f"{int(since.sum())}/{len(since)}" if len(since) else "-",
                "named": f"{int(told.sum())}/{len(told)}" if len(told) else "-",
                "severities_%": 100.0 * part["covered_severities"].sum() / max(1, part["severities"].sum()),
                "seconds": part["seconds"].mean(),
            }
        )
    return pd.DataFrame(lines)
