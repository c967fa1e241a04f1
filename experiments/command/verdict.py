"""A diagnosis in words: five lines for a terminal, entries for a program."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from faults.diagnosis import Diagnosis

SHOWN = {
    "leakage_flow": "leakage at rated pressure",
    "velocity_lost": "velocity lost",
    "added_friction": "friction added at rated speed",
    "pressure_rise": "pressure rise",
    "bulk_modulus": "bulk modulus",
    "entrained_air": "entrained air, at most",
}
"""What each severity is called."""

NO_VERDICT: Mapping[str, Any] = {
    "probabilities": None,
    "unknown": None,
    "reasons": [],
    "severity": None,
    "not_told": [],
    "since_s": None,
    "since_ci95_s": None,
    "condition_before": None,
    "gate": None,
}
"""The entries of a log without a verdict."""


def verdict_entries(found: "Diagnosis") -> dict[str, Any]:
    """Return a diagnosis as entries of the JSON contract.

    Parameters
    ----------
    found : Diagnosis
        The diagnosis.

    Returns
    -------
    dict[str, object]
        ``condition``, ``probabilities``, ``unknown`` with ``reasons``, ``severity``, ``gate``, and where the condition
        changed within the log ``since_s``, ``since_ci95_s`` and ``condition_before``, which else are None: the log was
        in one condition before it began.
    """
    onset = found.scoreboard.onset
    return {
        "condition": found.condition,
        "probabilities": dict(found.probabilities),
        "unknown": found.unknown,
        "reasons": list(found.reasons),
        "severity": {
            name: {"value": one.value, "unit": one.unit, "ci95": list(one.ci95)} for name, one in found.severity.items()
        },
        "not_told": list(found.not_told),
        "since_s": None if onset is None else round(onset.since, 4),
        "since_ci95_s": None if onset is None else [round(end, 4) for end in onset.ci95],
        "condition_before": None if onset is None else onset.before,
        "gate": {"passed": not found.unknown, "reasons": list(found.reasons)},
    }


def verdict_lines(result: Mapping[str, Any]) -> list[str]:
    """Return the five lines that a reader gets of a log.

    Parameters
    ----------
    result : Mapping
        Its entries, with a verdict.

    Returns
    -------
    list[str]
        What it is, how bad in leakage, in friction and oil, whether to believe it, and what to measure next.
    """
    return [
        f"{result['file']}: {headline(result)}",
        f"  leakage   {amounts(result, ('leakage_flow', 'velocity_lost'))}",
        f"  friction  {amounts(result, ('added_friction', 'pressure_rise', 'bulk_modulus'))}",
        f"  believe   {believed(result)}",
        f"  next      {next_step(result)}",
    ]


def headline(result: Mapping[str, Any]) -> str:
    """Return the verdict in one sentence.

    Parameters
    ----------
    result : Mapping
        Entries with a verdict.

    Returns
    -------
    str
        Condition and probability, or that it is unknown; and since when.
    """
    ranked = sorted(result["probabilities"].items(), key=lambda item: -item[1])
    (best, first), (second, other) = ranked[:2]
    parts = [f"{_said(best)}, probability {_percent(first)}", since(result), f"next {_said(second)}, {_percent(other)}"]
    named = "; ".join(part for part in parts if part)
    if result["unknown"]:
        return f"UNKNOWN, in none of the nine conditions; the nearest: {named}"
    return named


def since(result: Mapping[str, Any]) -> str:
    """Return since when the actuator is in its condition.

    Parameters
    ----------
    result : Mapping
        Entries with a verdict.

    Returns
    -------
    str
        A clause; empty for a healthy actuator that was so from the beginning.

    Examples
    --------
    >>> since({"condition": "minor_leakage", "since_s": None})
    'since before the log began'
    """
    if result["since_s"] is not None:
        low, high = result["since_ci95_s"]
        before = _said(result["condition_before"])
        return f"since {result['since_s']:.2f} s ({low:.2f} to {high:.2f}), {before} until then"
    return "" if result["condition"] == "normal" else "since before the log began"


def amounts(result: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return severities with their intervals.

    Parameters
    ----------
    result : Mapping
        Entries with a verdict.
    names : sequence of str
        Which.

    Returns
    -------
    str
        In the units of a shop.
    """
    return "; ".join(f"{SHOWN[name]} {amount(result['severity'][name])}" for name in names)


def amount(one: Mapping[str, Any]) -> str:
    """Return one severity with its interval.

    Parameters
    ----------
    one : Mapping
        ``value``, ``unit`` and ``ci95``.

    Returns
    -------
    str
        Pascals as MPa.

    Examples
    --------
    >>> amount({"value": 2.07e8, "unit": "Pa", "ci95": [2.05e8, 2.09e8]})
    '207.0 MPa (205.0 to 209.0)'
    """
    if not all(math.isfinite(number) for number in (one["value"], *one["ci95"])):
        return "not determined"
    scale, unit = (1e-6, "MPa") if one["unit"] == "Pa" else (1.0, one["unit"])
    value, low, high = (scale * float(number) for number in (one["value"], *one["ci95"]))
    decimals = min(max(1 - math.floor(math.log10(high - low)), 0), 4) if high > low else 2
    return f"{value:.{decimals}f} {unit} ({low:.{decimals}f} to {high:.{decimals}f})"


def believed(result: Mapping[str, Any]) -> str:
    """Return whether the verdict may be believed.

    Parameters
    ----------
    result : Mapping
        Entries with a verdict.

    Returns
    -------
    str
        A sentence.
    """
    if result["unknown"]:
        return "no: " + "; ".join(result["reasons"])
    return "; ".join(["yes: a circuit in one of the nine conditions follows the log", *result["not_told"]])


def next_step(result: Mapping[str, Any]) -> str:
    """Return what to measure next.

    Parameters
    ----------
    result : Mapping
        Entries with a verdict.

    Returns
    -------
    str
        A sentence.
    """
    if result["unknown"]:
        return "mend what line 'believe' names (sensor, wiring, rig file), then log again"
    if "differential_pressure_pa" not in result["channels"]:
        return "log differential pressure: it narrows leakage and friction several times"
    if any("friction is not visible" in sentence for sentence in result["not_told"]):
        return "drive steps that move the piston: this log cannot show friction"
    if any("not told apart" in sentence for sentence in result["not_told"]):
        return "hold two or more motor speeds (hydrostate simulate --drive steps): one amplitude leaves two causes"
    if max(result["probabilities"].values()) < 0.9:
        return "log steps of 10 s or more at several speeds: this log leaves more than one condition open"
    return "nothing: the log decides"


def _said(condition: str) -> str:
    return condition.replace("_", " ")


def _percent(probability: float) -> str:
    if probability > 0.999:
        return "> 99.9 %"
    return "< 0.1 %" if probability < 0.001 else f"{100.0 * probability:.1f} %"
