"""Both verbs on unseen actuators: one line for each log of a random realistic rig, and summary figures.

The rig file is right. With ``--wrong``, its displacement, area, volume, mass and bulk modulus have the usual errors,
all at once. Intervals conditional on the rig are scored only if the file is right.
"""

import argparse
import time
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.diagnosis.rig_draws import draw_bench, wrong_rig_file
from benchmarks.diagnosis.scores import share_interval
from benchmarks.targets import Check, print_and_keep
from estimation.finding import NORMAL_95
from experiments.open_benchmark.judge import judge_bulk_modulus, judge_class, names_cause
from experiments.python_user.log import Log
from plant.eha.rig import Rig
from plant.errors import HydrostateError, LogWarning

FAILED = {"outcome": "failed"}

USUAL_NOTES = {"known_as_the_rig", "nothing"}
"""Codes of notes that say nothing about the log: the limit of the total interval, and that no advice is needed."""


def main(arguments: list[str]) -> int:
    """Print one line for each log, and every figure with its target; return how many fall short."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1000:1019", metavar="A:B", help="first and last seed, both drawn")
    parser.add_argument("--wrong", action="store_true", help="give both verbs a wrong rig file")
    parser.add_argument("--without-pressure", action="store_true")
    options = parser.parse_args(arguments)
    first, _, last = options.seeds.partition(":")
    warnings.simplefilter("ignore", LogWarning)
    rows: list[dict[str, Any]] = []
    for seed in range(int(first), int(last or first) + 1):
        rows.append(score_rig(seed, wrong=options.wrong, pressure=not options.without_pressure))
        print(row_as_text(rows[-1]), flush=True)
    checks = print_and_keep(print_figures(rows, wrong=options.wrong))
    return sum(not check.met for check in checks)


def score_rig(seed: int, *, wrong: bool, pressure: bool) -> dict[str, Any]:
    """Return the results of both verbs for one rig, compared with its truth.

    Parameters
    ----------
    seed : int
        Seed of the rig.
    wrong : bool
        Whether the rig file is wrong.
    pressure : bool
        Whether pressure may be used.

    Returns
    -------
    dict[str, Any]
        Entries of `judge_bulk_modulus` and `judge_class`; ``z``, the error divided by its standard deviation;
        ``notes``, their codes; ``seconds`` of processor time.
    """
    bench = draw_bench(seed)
    rig = Rig("drawn", wrong_rig_file(bench.healthy, seed) if wrong else bench.healthy)
    log, began = Log(bench.record, rig), time.process_time()
    row = score_log(log, {"bulk_modulus": bench.true.bulk_modulus, "condition": bench.condition}, pressure=pressure)
    return {"seed": seed, "about": bench.about, **row, "seconds": time.process_time() - began}


def score_log(log: Log, truth: dict[str, Any], *, pressure: bool) -> dict[str, Any]:
    """Return the results of both verbs for a log, compared with its truth.

    Parameters
    ----------
    log : Log
        The log with its rig.
    truth : dict
        True ``bulk_modulus`` [Pa] and ``condition``, or the equivalent entries of a row of `truth.csv`.
    pressure : bool
        Whether pressure may be used.

    Returns
    -------
    dict[str, Any]
        As from `score_rig`, without the entries about the rig.
    """
    return score_results(_verb_result(log, "estimate", pressure), _verb_result(log, "diagnose", pressure), truth)


def score_results(estimate: dict[str, Any], diagnosis: dict[str, Any], truth: dict[str, Any]) -> dict[str, Any]:
    """Return the scores of two answers.

    Parameters
    ----------
    estimate, diagnosis : dict
        Entries of the JSON contract.
    truth : dict
        As for `score_log`.

    Returns
    -------
    dict[str, Any]
        As from `score_log`.
    """
    modulus = truth["bulk_modulus"]
    judged = {"beta_lo": modulus, "beta_hi": modulus, "accept": truth["condition"], **truth}
    row: dict[str, Any] = {"z": None, **judge_bulk_modulus(estimate, judged), **judge_class(diagnosis, judged)}
    said = estimate.get("bulk_modulus_pa") or {}
    if said.get("value") is not None:
        low, high = said["ci95"]
        row["z"] = 2.0 * NORMAL_95 * (said["value"] - modulus) / (high - low)
    row["named"] = names_cause(judged.get("named", ""), estimate, diagnosis)
    condition = diagnosis.get("condition")
    row["said"] = condition, (diagnosis.get("probabilities") or {}).get(condition, 0.0)
    told = (*estimate.get("notes", ()), *diagnosis.get("notes", ()))
    row["notes"] = sorted({note["code"] for note in told} - USUAL_NOTES)
    row["reasons"] = [*(estimate.get("gate") or {}).get("reasons", ()), *diagnosis.get("reasons", ())]
    return row | {"failed": [one["message"] for one in (estimate, diagnosis) if one["outcome"] == "failed"]}


def _verb_result(log: Log, verb: str, pressure: bool) -> dict[str, Any]:
    try:
        return dict(getattr(log, verb)(no_pressure=not pressure).to_dict())
    except HydrostateError as error:
        return {**FAILED, "message": str(error)}


def row_as_text(row: dict[str, Any]) -> str:
    """Return a row as a line of text."""
    error = "no number" if row["error"] is None else f"error {100.0 * row['error']:.2f} %, z {row['z']:.1f}"
    covers = "".join("+" if row[name] else "-" for name in ("covered", "covered_total") if row["error"] is not None)
    name, probability = row["said"]
    verdict = row["verdict"] + (f" ({name} {100.0 * probability:.0f} %)" if row["verdict"] == "wrong" else "")
    flag = f"{row['outcome']}{', flagged' if row['flagged'] else ''}"
    words = "; ".join([*row["notes"], *row["failed"], *(str(reason) for reason in row["reasons"])])
    return f"{row['seed']} {verdict} | {flag} {error} {covers} | {row['seconds']:.1f} s | {row['about']} | {words}"


def print_figures(rows: Sequence[dict[str, Any]], *, wrong: bool) -> list[Check]:
    """Return the figures of a population, and print each share with its bounds."""
    count = len(rows)
    verdicts = [row["verdict"] for row in rows]
    believed = [row for row in rows if row["error"] is not None and not row["flagged"] and row["outcome"] == "ok"]
    shares = {
        "unknown": (sum(verdict == "unknown" for verdict in verdicts), count),
        "of another class": (sum(verdict in ("wrong", "failed") for verdict in verdicts), count),
        "without a believed bulk modulus": (count - len(believed), count),
        "of these not determined by the log": (sum(row["outcome"] == "not_observable" for row in rows), count),
        "total intervals that hold it": (sum(row["covered_total"] for row in believed), len(believed)),
    }
    if not wrong:
        shares["intervals given the rig that hold it"] = sum(row["covered"] for row in believed), len(believed)
    print(f"{count} logs; {np.mean([row['seconds'] for row in rows]):.1f} s CPU a log")
    if believed:
        errors, z = np.array([[100.0 * abs(row["error"]), row["z"]] for row in believed]).T
        size = f"off by {np.median(errors):.2f} % median, {np.max(errors):.2f} % at most"
        print(f"bulk modulus {size}; z {np.sqrt(np.mean(z**2)):.2f} rms, {np.median(np.abs(z)):.2f} median in size")
    for what, (hits, of) in shares.items():
        if of:
            low, high = share_interval(hits, of)
            print(f"{what}: {hits} of {of} ({100.0 * low:.0f} to {100.0 * high:.0f} %)")
    percent = {what: 100.0 * hits / of for what, (hits, of) in shares.items() if of}
    checks = [
        Check("sure of a wrong class", sum(row["silent_class"] for row in rows), most=0),
        Check("bulk modulus wrong without a word", sum(row["narrow"] for row in rows), most=0),
        Check("unknown, %", percent["unknown"], most=10.0),
        Check("total intervals that cover, %", percent.get("total intervals that hold it", 100.0), least=90.0),
    ]
    if not wrong:
        covered = percent.get("intervals given the rig that hold it", 100.0)
        checks.append(Check("intervals given the rig that cover, %", covered, least=90.0))
    return checks
