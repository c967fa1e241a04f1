"""Scores this package on sets of logs: every log is read, estimated and diagnosed as by a user, with its rig file."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any

import pandas as pd

from estimation.finding import NORMAL_95
from experiments.open_benchmark.judge import judge_bulk_modulus, judge_class, names_cause
from experiments.open_benchmark.loaders import read_truth, rows_of
from experiments.python_user.log import Log
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.circuit_runs import coordinates_of
from faults.diagnosis.severity import severities_at
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError

FAILED: Mapping[str, Any] = {"outcome": "failed"}

PRESSURE_PREFIX = "pressure_"
"""Prefix of the kinds in which only the pressure sensor is peculiar; without pressure they are plain."""

Z_PREFIX = "z_"
"""Prefix of the columns with normalised errors (error over standard deviation)."""

LOSSES = ("leakage_coefficient", "flow_bias")
"""Quantities that `estimate` gives in addition to bulk modulus."""

COEFFICIENTS: Mapping[str, str] = {
    "leakage_coefficient": "leak_coeff",
    "flow_bias": "flow_bias",
    "bulk_modulus": "bulk_modulus_pa",
    "friction_quadratic": "a1",
    "friction_linear": "a2",
    "friction_coulomb": "a3",
}
"""Parameters in a truth, with their columns."""


def score_set(folder: Path, count: int, *, pressure: bool) -> Iterator[dict[str, Any]]:
    """Yield one row for each of the first logs of a set.

    Parameters
    ----------
    folder : Path
        Folder with `truth.csv`.
    count : int
        Maximum number of logs.
    pressure : bool
        Whether pressure may be used.

    Yields
    ------
    dict[str, Any]
        What `judge_bulk_modulus` and `judge_class` give, severities covered of how many, and processor time [s].
    """
    for told in rows_of(read_truth(folder).head(count)):
        truth, began = told if pressure else without_pressure(told), process_time()
        estimate, diagnosis, rig = _verb_results(folder, truth, pressure)
        row = {"set": folder.name, "file": truth["file"], "input": truth["input"], "pressure": pressure}
        row |= judge_bulk_modulus(estimate, truth) | judge_class(diagnosis, truth)
        row["named"] = names_cause(str(truth.get("named", "")), estimate, diagnosis)
        errors = _normalised_errors(estimate, diagnosis, truth, rig) if int(truth["sev"] or 0) else {}
        hits = [abs(z) <= NORMAL_95 for name, z in errors.items() if name not in LOSSES]
        row |= {"severities": len(hits), "covered_severities": sum(hits), "seconds": process_time() - began}
        yield row | {f"{Z_PREFIX}{name}": z for name, z in errors.items()}


def without_pressure(truth: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the truth of a log whose pressure is not used: a peculiarity of the pressure sensor alone is removed.

    Parameters
    ----------
    truth : Mapping
        A row of `truth.csv`.

    Returns
    -------
    Mapping[str, Any]
        If only the pressure sensor is peculiar, the row of a plain log: its condition is the only right verdict, and
        nothing need be named. Otherwise the row unchanged.
    """
    of_pressure = str(truth.get("set", "")).startswith(PRESSURE_PREFIX) and truth.get("condition")
    return {**truth, "accept": truth["condition"], "named": ""} if of_pressure else truth


def _verb_results(folder: Path, truth: Mapping[str, Any], pressure: bool) -> tuple[Any, Any, EhaParameters]:
    """Return the entries of both verbs, and the healthy actuator that they were given."""
    from hydrostate import read

    rig = folder / truth["rig"] if truth["rig"] else None
    try:
        log = read(folder / truth["file"], rig=rig)
    except HydrostateError as error:
        failed = {**FAILED, "message": str(error)}
        return failed, failed, EhaParameters()
    return _verb_result(log, "estimate", pressure), _verb_result(log, "diagnose", pressure), log.rig.parameters


def _verb_result(log: Log, verb: str, pressure: bool) -> Mapping[str, Any]:
    try:
        return getattr(log, verb)(no_pressure=not pressure).to_dict()
    except HydrostateError as error:
        return {**FAILED, "message": str(error)}


def _normalised_errors(
    estimated: Mapping[str, Any], said: Mapping[str, Any], truth: Mapping[str, Any], healthy: EhaParameters
) -> dict[str, float]:
    """Return the normalised error of what both verbs give, given the rig, by name: 0 within a range of truths.

    Severities follow the project's own definition of each. Losses count only if the estimate passes its check.
    """
    from dataclasses import replace

    actuator = actuator_of(healthy)
    true = replace(healthy, **{name: float(truth[column]) for name, column in COEFFICIENTS.items()})
    exact = severities_at(coordinates_of(true, actuator.rated), actuator)
    told = {name: one["ci95"] for name, one in (said.get("severity") or {}).items() if name != "entrained_air"}
    ranges = {name: (exact[name], exact[name]) for name in told}
    ranges["bulk_modulus"] = float(truth["beta_lo"]), float(truth["beta_hi"])
    if (estimated.get("gate") or {}).get("passed"):
        states = estimated.get("states") or {}
        told |= {name: states[name]["ci95"] for name in LOSSES if name in states}
        ranges |= {name: (getattr(true, name), getattr(true, name)) for name in LOSSES}
    ends = {name: ci for name, ci in told.items() if ci is not None and None not in ci and ci[0] < ci[1]}
    return {name: _deviation_from_range(ci, ranges[name]) for name, ci in ends.items()}


def _deviation_from_range(ci: Sequence[float], truths: tuple[float, float]) -> float:
    """Return the distance of an interval's middle from the nearest of a range of truths, in standard deviations."""
    middle = 0.5 * (ci[0] + ci[1])
    return NORMAL_95 * (middle - min(max(middle, truths[0]), truths[1])) / (0.5 * (ci[1] - ci[0]))


def coverage(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return one row for each set and quantity: coverage of 95 % intervals given the rig; tells if they are too narrow.

    Returns
    -------
    pandas.DataFrame
        ``z`` is the root mean square of the normalised error, 1 if intervals are right [dimensionless].
    """
    table, lines = pd.DataFrame(rows), list[dict[str, Any]]()
    columns = [str(one) for one in table.columns if str(one).startswith(Z_PREFIX)]
    for (name, pressure), part in table.groupby(["set", "pressure"], sort=False):
        for column in columns:
            z = part[column].dropna().astype(float)
            if len(z):
                which = {
                    "set": name,
                    "pressure": pressure,
                    "quantity": column.removeprefix(Z_PREFIX),
                    "numbers": len(z),
                }
                covered = int((z.abs() <= NORMAL_95).sum())
                size, worst = float((z**2).mean() ** 0.5), float(max(z, key=abs))
                lines.append(which | {"covered": covered, "z": size, "mean_z": float(z.mean()), "largest": worst})
    return pd.DataFrame(lines)


def summary(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Return one row for each set and sensors: counts, errors [%] and processor time per log [s]."""
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
