"""Findings of the gear-pump actuator as entries of the JSON contract; later versions add entries and rename none."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from experiments.command.terminal import clauses
from experiments.log_pages.entries import NO_GATE, gate_entry
from experiments.page.numbers import decimals_of

if TYPE_CHECKING:
    from estimation.eha.result import BulkModulusEstimate
    from estimation.finding import Finding, Quantity
    from faults.diagnosis.diagnose import EhaEvidence

NO_QUANTITY: Mapping[str, Any] = {"value": None, "std": None, "ci95": None, "ci95_total": None}

NO_ESTIMATE: Mapping[str, Any] = {
    "bulk_modulus_pa": NO_QUANTITY,
    **dict.fromkeys(("leakage_coefficient_m3_s_pa", "flow_bias_m3_s")),
    "states": {},
    "noise": None,
    "nis": {},
    **dict.fromkeys(("method", "form")),
    "gate": NO_GATE,
    **dict.fromkeys(("bound_percent", "condition")),
    "channels": [],
    "notes": [],
}

NO_DIAGNOSIS: Mapping[str, Any] = {
    "condition": None,
    "scores": {},
    **dict.fromkeys(("probabilities", "unknown")),
    "reasons": [],
    "severity": None,
    "not_told": [],
    "advice": [],
    **dict.fromkeys(("since_s", "since_ci95_s", "condition_before", "gate")),
    "bulk_modulus_pa": NO_QUANTITY,
    "channels": [],
    **dict.fromkeys(("runner_up", "margin", "transfer_function_scores", "transfer_function_condition")),
    "notes": [],
}

COST_CODES = frozenset(
    {"pressure_absent", "pressure_unused", "pressure_absent_class", "known_as_the_rig", "healthy_of_the_paper"}
)
"""Codes for the cost of an absent channel or an uncertain rig; the same for all logs, so reported once."""

NO_CLASS_CODES = frozenset({"channel_zero", "models_alike", "models_diverged", "no_probabilities"})
"""Codes for why a log is in no class; they are reported in its message and not repeated beside it."""


def estimate_entries(found: "Finding") -> dict[str, Any]:
    """Return the entries of `estimate` for a log.

    Parameters
    ----------
    found : Finding
        A finding whose evidence is a `BulkModulusEstimate`.

    Returns
    -------
    dict[str, Any]
        The entries of `NO_ESTIMATE`, with outcome, message and warnings.
    """
    evidence: BulkModulusEstimate = found.evidence
    others = {name: _quantity(one) for name, one in found.quantities.items() if name != "bulk_modulus"}
    tuned = None if evidence.tuning is None else evidence.tuning.tuned
    return {
        "outcome": found.outcome.value,
        "bulk_modulus_pa": _quantity(found.quantities["bulk_modulus"]),
        "leakage_coefficient_m3_s_pa": others.get("leakage_coefficient"),
        "flow_bias_m3_s": others.get("flow_bias"),
        "nis": dict(evidence.nis),
        "method": evidence.method,
        "states": others,
        "noise": None if tuned is None else {**tuned.noise, **tuned.variances},
        "form": evidence.form,
        "gate": gate_entry(found.gate),
        "bound_percent": 100.0 * evidence.bound,
        "channels": list(found.channels),
        "message": estimate_message(found),
        **_notes(found),
    }


def diagnosis_entries(found: "Finding") -> dict[str, Any]:
    """Return the entries of `diagnose` for a log.

    Parameters
    ----------
    found : Finding
        A finding whose evidence is an `EhaEvidence`.

    Returns
    -------
    dict[str, Any]
        The entries of `NO_DIAGNOSIS`, with outcome, message and warnings. If the condition changed within the log,
        ``since_s``, ``since_ci95_s`` and ``condition_before`` give the time; else they are None.
    """
    from estimation.finding import Outcome
    from experiments.eha.verdict_words import headline, models_sentence
    from faults.diagnosis.models_verdict import error_margin, ranked_conditions

    evidence: EhaEvidence = found.evidence
    judged, ratio, others = bool(found.probabilities), error_margin(evidence.scores), evidence.transfer_functions
    order = sorted(found.probabilities, key=lambda name: -found.probabilities[name]) if judged else None
    order = order or [name for name, _ in ranked_conditions(evidence.scores)]
    entries: dict[str, Any] = {
        "outcome": found.outcome.value,
        "condition": found.condition,
        "scores": dict(evidence.scores.by_condition),
        "channels": list(found.channels),
        "runner_up": order[1] if found.condition is not None else None,
        "margin": None if ratio != ratio else ratio,
        "gate": gate_entry(found.gate),
        "bulk_modulus_pa": _quantity(found.quantities["bulk_modulus"]),
        "unknown": None if found.condition is None else found.unknown,
        "reasons": [str(note) for note in found.against],
        "advice": [str(note) for note in found.advice],
        "transfer_function_scores": None if others is None else dict(others.by_condition),
        "transfer_function_condition": None if others is None else others.condition,
        **_notes(found),
    }
    if found.condition is None:
        return {**entries, "message": _no_class_message(found)}
    if not judged and found.outcome is Outcome.MISMATCH:
        return {**entries, "message": clauses(str(note) for note in found.against)}
    if not judged:
        return {**entries, "message": models_sentence(entries)}
    since = found.since
    entries |= {
        "probabilities": dict(found.probabilities),
        "severity": {name: _severity(one) for name, one in found.severities.items()},
        "not_told": [str(note) for note in found.not_told],
        "since_s": None if since is None else round(since.since, 4),
        "since_ci95_s": None if since is None else [round(end, 4) for end in since.ci95],
        "condition_before": None if since is None else since.before,
    }
    return {**entries, "message": headline(entries)}


def _quantity(one: "Quantity") -> dict[str, Any]:
    return {"value": one.value, "std": one.std, "ci95": one.ci95, "ci95_total": one.ci95_total}


def _severity(one: "Quantity") -> dict[str, Any]:
    ends, total = (list(ci or (None, None)) for ci in (one.ci95, one.ci95_total))
    return {"value": one.value, "unit": one.unit, "ci95": ends, "ci95_total": total}


def _notes(found: "Finding") -> dict[str, Any]:
    return {
        "notes": [note.to_dict() for note in found.all_notes],
        "warnings": [str(note) for note in found.notes if note.code not in COST_CODES | NO_CLASS_CODES],
    }


def _no_class_message(found: "Finding") -> str:
    """Return why a log is in no class; a suspect sensor comes first, because no other drive corrects it."""
    from estimation.log_checks.notes import LoggerCode
    from estimation.notes import SensorCode

    accused = [note for note in found.gate.reasons if isinstance(note.code, (SensorCode, LoggerCode))]
    return clauses(str(note) for note in (*accused, *(one for one in found.notes if one.code in NO_CLASS_CODES)))


def estimate_message(found: "Finding") -> str:
    """Return the result of `estimate` for a log as one sentence."""
    modulus = found.quantities["bulk_modulus"]
    if modulus.value is None or modulus.ci95 is None:
        return _no_value_message(found)
    low, high = (1e-6 * end for end in modulus.ci95)
    digits = decimals_of(low, high)
    said = [
        f"bulk modulus {1e-6 * modulus.value:.{digits}f} MPa, 95 % interval {low:.{digits}f} to {high:.{digits}f} MPa"
    ]
    if modulus.ci95_total is not None:
        low, high = (1e-6 * end for end in modulus.ci95_total)
        said[0] += f", {low:.0f} to {high:.0f} MPa with rig error"
    if not found.gate.passed:
        said.append(f"do not rely on it: {clauses(str(note) for note in found.gate.reasons)}")
    return clauses(said)


def _no_value_message(found: "Finding") -> str:
    """Return why a log gives no value of bulk modulus; a mistake in a channel comes first."""
    from estimation.finding import NOT_OBSERVABLE_WITH_PRESSURE, OUTCOMES, Outcome
    from estimation.log_checks.channel_names import PRESSURE
    from estimation.log_checks.notes import LoggerCode
    from estimation.notes import ChannelCode, EstimateCode, RigCode, SensorCode

    reasons = found.gate.reasons
    mistakes = [str(note) for note in reasons if isinstance(note.code, ChannelCode)]
    if mistakes:
        return clauses(mistakes)
    seen = found.outcome is Outcome.NOT_OBSERVABLE and PRESSURE in found.channels
    volume = next((str(note) for note in found.notes if note.code == RigCode.VOLUME_DIFFERS), None)
    if seen and volume:
        return clauses([f"no value of bulk modulus: {volume}; correct chamber_volume, then estimate this log again"])
    at_rest = {
        EstimateCode.PUMP_AND_PISTON_REST,
        EstimateCode.POSITION_CONSTANT,
        EstimateCode.PISTON_STANDS_STILL,
        EstimateCode.STILL_AND_FOREIGN,
    }
    still = [str(note) for note in reasons if note.code in at_rest]
    if seen and still:
        return clauses([f"no value of bulk modulus: {still[0]}", *still[1:]])
    unexplained = seen and any(note.code != EstimateCode.BOUND_TOO_WIDE for note in reasons)
    if unexplained or (found.outcome is Outcome.MISMATCH and reasons):
        told = list(map(str, reasons))
        if all(isinstance(note.code, (SensorCode, LoggerCode)) for note in reasons):
            return clauses([f"no value of bulk modulus: {told[0]}", *told[1:]])
        return clauses(["no value of bulk modulus: the model does not describe the log", *told])
    return clauses([NOT_OBSERVABLE_WITH_PRESSURE if seen else OUTCOMES[found.outcome]])


def costs(results: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return sentences on the cost of absent channels or an unknown rig, each with its number of logs.

    Parameters
    ----------
    results : iterable of Mapping
        Entries with ``notes``, one for each log.

    Returns
    -------
    list[str]
        One sentence for each kind of absent channel or rig entry, with the number of logs if there are several; its
        share is that of the first of these logs.
    """
    results = list(results)
    said: dict[tuple[str, str | None], list[str]] = {}
    for note in (one for result in results for one in result["notes"] if one["code"] in COST_CODES):
        said.setdefault((note["code"], note["data"].get("entry")), []).append(note["text"])
    shares = (f"{len(texts)} of {len(results)} logs" if len(results) > 1 else "note" for texts in said.values())
    return [f"{share}: {texts[0]}" for share, texts in zip(shares, said.values(), strict=True)]
