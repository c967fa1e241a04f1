"""A finding as entries of the JSON contract, for any actuator. Later versions add entries and never rename them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.command.terminal import clauses
from experiments.page.condition_names import condition_in_words

if TYPE_CHECKING:
    from estimation.finding import Finding, Gate, Quantity

NO_GATE: Mapping[str, Any] = {"passed": False, "reasons": []}

BLANK: dict[str, Any] = {
    "quantities": {},
    "channels": [],
    "condition": None,
    "probabilities": {},
    "severity": {},
    "findings": [],
    "not_told": [],
    "advice": [],
    "gate": NO_GATE,
    "notes": [],
}

ALL_DETERMINED = "every quantity is determined, and the model describes the log"


def finding_entries(found: "Finding") -> dict[str, Any]:
    """Return a finding as entries of the JSON contract.

    Returns
    -------
    dict[str, Any]
        The entries of `BLANK`, with outcome, message and warnings. The condition is left out if the finding is unknown.
    """
    return {
        "outcome": found.outcome.value,
        "quantities": {name: quantity_entry(one) for name, one in found.quantities.items()},
        "channels": list(found.channels),
        "condition": None if found.unknown else " or ".join(found.named) or None,
        "probabilities": dict(found.probabilities),
        "severity": {name: quantity_entry(one) for name, one in found.severities.items()},
        "findings": [] if found.unknown else [str(note) for note in found.faults],
        "not_told": [str(note) for note in found.not_told],
        "advice": [str(note) for note in found.advice],
        "gate": gate_entry(found.gate),
        "message": message_of(found),
        "notes": [note.to_dict() for note in found.all_notes],
        "warnings": [str(note) for note in found.notes],
    }


def quantity_entry(one: "Quantity") -> dict[str, Any]:
    """Return a quantity for JSON.

    Returns
    -------
    dict[str, Any]
        ``value``, ``unit``, ``std``, ``ci95`` and ``ci95_total``.
    """
    ends = {name: None if ci is None else list(ci) for name, ci in (("ci95", one.ci95), ("ci95_total", one.ci95_total))}
    return {"value": one.value, "unit": one.unit, "std": one.std, **ends}


def gate_entry(gate: "Gate") -> dict[str, Any]:
    """Return a gate for JSON.

    Returns
    -------
    dict[str, Any]
        ``passed``, and ``reasons`` in words.
    """
    return {"passed": gate.passed, "reasons": [str(note) for note in gate.reasons]}


SOUND: Mapping[str, str] = {"normal": "leakage and friction are normal", "healthy": "no fault"}
"""Conditions of a sound actuator, in words."""


def joined_conditions(named: Sequence[str]) -> str:
    """Return the condition, and all conditions that cannot be told apart from it, as part of a sentence.

    Examples
    --------
    >>> joined_conditions(["minor_leakage_minor_friction", "normal"])
    'minor leakage + minor friction or normal'
    """
    return " or ".join(map(condition_in_words, named))


def _faults_found(found: "Finding") -> Iterator[str]:
    """Yield all that is wrong. Faults come before a sound condition, but after any other condition."""
    faults = [str(note) for note in found.faults]
    if len(found.named) == 1 and found.named[0] in SOUND:
        yield from (*faults, SOUND[found.named[0]])
    else:
        told = joined_conditions(found.named)
        yield from () if any(fault.startswith(f"{told}:") for fault in faults) else (told,)
        yield from faults


def message_of(found: "Finding") -> str:
    """Return a finding in one sentence.

    Returns
    -------
    str
        The condition, or why there is none; then what the log does not determine, and what else is wrong.
    """
    from plant.notes import distinct

    doubts = [str(note) for note in distinct((*found.against, *found.gate.reasons))]
    named = found.condition is not None and not found.unknown
    said = [*_faults_found(found)] if named else [*doubts, *(() if found.unknown else map(str, found.faults))]
    said += map(str, found.not_told)
    if named and not found.gate.passed:
        said.append(f"not to be relied on: {clauses(doubts)}")
    return clauses(said or [ALL_DETERMINED])
