"""The page on one log, for any actuator: verdict, next steps, quantities with intervals, notes, and channels."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from estimation.finding import Outcome
from estimation.notes import ChannelCode, EstimateCode
from experiments.command.terminal import clauses
from experiments.log_pages.channel_charts import channel_charts
from experiments.log_pages.entries import SOUND, joined_conditions
from experiments.page.condition_names import condition_in_words
from experiments.page.names_shown import quantity_name
from experiments.page.numbers import MISSING, number, percent_text, pretty_unit, reader_unit, with_equal_decimals
from experiments.page.render import render_page
from experiments.page.sentences import rig_advice, sentence, unused_column_advice
from experiments.page.tables import Column

if TYPE_CHECKING:
    from estimation.finding import Finding, Quantity
    from plant.log.record import Record

ACTUATORS = {
    "eha": "electro-hydrostatic actuator",
    "piezo-stack": "piezo-stack actuator",
    "diaphragm-motor": "diaphragm motor",
}
"""Kinds of actuator in words."""

LEAST_SHARE = 0.001
"""Conditions with a lower probability are not listed [probability]."""

ALSO_ADVICE = (EstimateCode.STIFFER_THAN_RIG, EstimateCode.SOFTER_THAN_RIG, EstimateCode.KNOWN_AS_THE_RIG)
"""Notes that are also listed as advice, since they say what to correct or to measure."""

FRICTION_UNLIKE = (
    "Log differential pressure: bulk modulus then needs no friction model. Until you do, hydrostate diagnose fits the "
    "whole circuit to this log and gives a rough bulk modulus."
)
"""Advice if no friction model of the estimate explains the motion."""

NO_BREAK = "\N{NO-BREAK SPACE}"
"""A space that prevents a line break."""

COLUMNS = {
    "quantities": (
        "quantity",
        "value",
        Column("interval", "95 % interval"),
        Column("total", "with rig error"),
    ),
    "probabilities": ("condition", Column("percent", "probability", "%")),
}


def finding_page(result: Mapping[str, Any], found: "Finding", record: "Record") -> str:
    """Return the page on a log.

    Parameters
    ----------
    result : Mapping
        Entries of the log: ``file``, ``rig``, ``message``, ``notes`` and others.
    """
    shown = {**found.quantities, **found.severities}
    shares = sorted(found.probabilities.items(), key=lambda item: -item[1])
    file = Path(result["file"]).name
    also = [note for note in found.notes if note.code in ALSO_ADVICE]
    to_do = [*unused_column_advice(result), *(sentence(str(note)) for note in (*found.advice, *also))]
    if any(one.code == EstimateCode.POSITION_RESIDUALS_LARGE for one in found.gate.reasons):
        to_do.insert(0, FRICTION_UNLIKE)
    noted = [sentence(one["text"]) for one in result["notes"]]
    against = list(dict.fromkeys(map(str, (*found.against, *found.gate.reasons))))
    title = _title(found)
    message = _message_rest(title, _with_first_reason(result["message"], against))
    opening = (title, sentence(message)) if message else (title,)
    rows = [_row(name, one) for name, one in shown.items()]
    facts = {
        "result": result,
        "file": file,
        "title": title,
        "actuator": ACTUATORS.get(found.actuator, found.actuator),
        "message": sentence(message) if message else "",
        "to_do": to_do,
        "describe": rig_advice(result),
        "doubts": [
            sentence(one)
            for one in against
            if one not in message  # the message is already at the top of the page
        ],
        "doubted": bool(against),
        "duration": f"{record.duration:g}",
        "channels": ", ".join(found.channels),
        "notes": [
            one
            for one in noted
            if one not in (*to_do, *map(sentence, against)) and not any(one.rstrip(".") in each for each in opening)
        ],
        "quantities": pd.DataFrame(rows),
        "probabilities": pd.DataFrame(
            [(condition_in_words(name), percent_text(share)) for name, share in shares if share >= LEAST_SHARE],
            columns=["condition", "percent"],
        ),
        "charts": {"measured": channel_charts(record, found, Path(file).stem)},
    }
    with_total = any(row["total"] != MISSING for row in rows)
    columns = {**COLUMNS, "quantities": COLUMNS["quantities"][: None if with_total else -1]}
    return render_page("log_pages/finding.html", facts, columns, {})


def _message_rest(title: str, message: str) -> str:
    """Return the part of a message that the title does not repeat."""
    rest = message.removeprefix(f"{title[:1].lower()}{title[1:].rstrip('.')}; ")
    return "" if sentence(rest) == title else rest


def _with_first_reason(message: str, against: Sequence[str]) -> str:
    """Return the message with only the first of several reasons, since the page lists all of them below."""
    more = len(against) - 1
    if more < 1:
        return message
    first = f"{against[0].rstrip('.')}; {more} more {'reason stands' if more == 1 else 'reasons stand'} below"
    return message.replace(clauses(against), first)


def _title(found: "Finding") -> str:
    """Return the verdict in one sentence."""
    mistaken = [one.code for one in found.against if isinstance(one.code, ChannelCode)]
    if found.unknown and ChannelCode.NOTHING_CHANGES in mistaken:
        return "No verdict: no value changes in this log."
    if found.unknown and mistaken:
        return "No verdict: columns of the log are not what they are called."
    if found.unknown:
        return "No verdict: the log does not fit any known condition."
    if len(found.named) == 1 and found.named[0] in SOUND:
        return sentence(str(found.faults[0]) if found.faults else SOUND[found.named[0]])
    if found.named:
        return f"Found: {joined_conditions(found.named)}."
    oil = found.quantities.get("bulk_modulus")
    if oil is not None and oil.value is not None and found.gate.passed:
        return f"Bulk modulus is {number(1e-6 * oil.value, 3)} MPa; the consistency check passed."
    if any(one.value is not None for one in found.quantities.values()):
        passed = "which passed the consistency check" if found.gate.passed else "but do not rely on them"
        return f"Estimated values, {passed}."
    if found.outcome is Outcome.MISMATCH:
        return "No values: the model does not fit the log."
    return "No values: the log contains too little."


def _row(name: str, one: "Quantity") -> dict[str, str]:
    _, unit = reader_unit(one.unit)
    value, *ends = _in_digits(one.value, one.ci95, one.unit)
    _, *total = _in_digits(one.value, one.ci95_total, one.unit)
    return {
        "quantity": f"{quantity_name(name)} [{_unbreakable(pretty_unit(unit))}]",
        "value": value,
        "interval": " to ".join(ends) or MISSING,
        "total": " to ".join(total) or MISSING,
    }


def _in_digits(value: float | None, interval: tuple[float, float] | None, si_unit: str) -> list[str]:
    scale, unit = reader_unit(si_unit)
    ends = None if interval is None else [scale * end for end in interval]
    return [_unbreakable(one) for one in with_equal_decimals(None if value is None else scale * value, ends, unit)]


def _unbreakable(shown: str) -> str:
    """Return a number or a unit without places for a line break."""
    return shown.replace(" ", NO_BREAK)
