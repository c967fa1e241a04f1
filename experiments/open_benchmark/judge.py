"""Judgement of a verdict against the truth: definitions of silent errors, coverage and false unknowns."""

import re
from collections.abc import Mapping
from typing import Any

SILENT_ERROR_FRACTION = 0.05
"""Error of bulk modulus above which it can count as a silent error [fraction]."""

WIDTHS = 3.0
"""The error must also exceed this number of half widths of its 95 % interval [dimensionless]."""

SURE_PROBABILITY = 0.9
"""Probability above which a wrong class is a silent error."""

OUTCOMES_WITHOUT_NUMBER = ("failed", "diverged")

Entries = Mapping[str, Any]


def judge_bulk_modulus(said: Entries, truth: Entries) -> dict[str, Any]:
    """Return the judgement of an estimate; the true bulk modulus may be a range, whose nearer end counts.

    Parameters
    ----------
    said : Mapping
        Entries of the JSON contract.
    truth : Mapping
        A row of `truth.csv`, SI units.

    Returns
    -------
    dict[str, Any]
        ``error`` [fraction] and ``covered`` (given the rig, and in total), None if there is no value; ``flagged``,
        ``silent``; ``narrow`` is a silent error of any size.
    """
    gate, quantity = said.get("gate") or {}, said.get("bulk_modulus_pa") or {}
    flagged = not gate.get("passed", True) or said["outcome"] in OUTCOMES_WITHOUT_NUMBER
    value = quantity.get("value")
    row = {"outcome": said["outcome"], "flagged": flagged, "error": None, "covered": None, "covered_total": None}
    if value is None:
        return {**row, "silent_beta": False, "narrow": False}
    low, high = float(truth["beta_lo"]), float(truth["beta_hi"])
    near = min(max(value, low), high)
    given = quantity["ci95"]
    total = quantity.get("ci95_total") or given
    wide = abs(value - near) > WIDTHS * 0.5 * (total[1] - total[0])
    trusted = not flagged and said["outcome"] == "ok" and wide
    return row | {
        "error": value / near - 1.0,
        "covered": given[0] <= high and given[1] >= low,
        "covered_total": total[0] <= high and total[1] >= low,
        "silent_beta": trusted and abs(value / near - 1.0) > SILENT_ERROR_FRACTION,
        "narrow": trusted,
    }


def judge_class(said: Entries, truth: Entries) -> dict[str, Any]:
    """Return the judgement of a diagnosis.

    Parameters
    ----------
    said : Mapping
        Entries of the JSON contract.
    truth : Mapping
        A row of `truth.csv`; ``accept`` holds the right verdicts.

    Returns
    -------
    dict[str, Any]
        ``verdict`` is right, wrong, unknown, none or failed; ``right`` also if unknown is acceptable. ``false_since``:
        the diagnosis dates the beginning of a condition within a log that does not change. ``since``: the change is
        dated within the stated interval; None if nothing changed.
    """
    accept, got = str(truth["accept"]).split(";"), said.get("condition")
    dated = _onset_judgement(said, truth)
    if got is None:
        verdict = "none" if said["outcome"] == "not_observable" else "failed"
        return {"verdict": verdict, "right": False, "silent_class": False, "false_unknown": False, **dated}
    unknown = bool(said.get("unknown"))
    sure = (said.get("probabilities") or {}).get(got, 0.0) > SURE_PROBABILITY
    verdict = "unknown" if unknown else "right" if got in accept else "wrong"
    return {
        "verdict": verdict,
        "right": ("unknown" if unknown else got) in accept,
        "silent_class": verdict == "wrong" and sure,
        "false_unknown": unknown and "unknown" not in accept,
        **dated,
    }


def _onset_judgement(said: Entries, truth: Entries) -> dict[str, Any]:
    """Return whether a stated beginning of a condition is false, and whether it is right."""
    ends, began = said.get("since_ci95_s"), str(truth.get("since_s", ""))
    return {
        "false_since": ends is not None and str(truth.get("steady", "")) == "True",
        "since": (ends is not None and ends[0] <= float(began) <= ends[1]) if began else None,
    }


def names_cause(pattern: str, *said: Entries) -> bool | None:
    """Return whether the messages about a log name its cause; None if no cause need be named."""
    if not pattern:
        return None
    sentences = [str(one.get("message") or "") for one in said]
    for one in said:
        sentences += [str(text) for text in (*(one.get("warnings") or ()), *(one.get("reasons") or ()))]
    return re.search(pattern, "\n".join(sentences), re.IGNORECASE) is not None
