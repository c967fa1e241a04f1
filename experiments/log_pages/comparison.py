"""Two logs side by side: their quantities, the changes, and the page."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from estimation.finding import NORMAL_95
from experiments.page.names_shown import QUANTITY_NAMES
from experiments.page.numbers import MISSING, percent_text, pretty_unit, shop_unit, with_equal_decimals
from experiments.page.sentences import joined_names, sentence
from experiments.page.words import condition_in_words

if TYPE_CHECKING:
    import pandas as pd

LEAST_SHARE = 1e-3
"""Conditions that are less likely than this in both logs are not shown [probability]."""

DOUBTED = "not reliable"
"""Comment on every quantity if a model fits one of the logs so badly that its numbers mean nothing."""

MOST_NAMED = 6
"""Largest number of quantities named in a title [count]."""


def compare_view(first: Mapping[str, Any], second: Mapping[str, Any], identities: tuple[str, str] | None = None) -> str:
    """Return the page of two logs side by side.

    Parameters
    ----------
    first, second : Mapping
        Entries of the logs in the JSON contract.
    identities : tuple of str, optional
        Identifiers of the logs on the server; without them, the page has no links.
    """
    from experiments.page.render import render_page
    from experiments.page.tables import Column

    rows = comparison_rows(first, second)
    title, *changes = headings(first, second, rows)
    logs = [
        {
            "file": one["file"],
            "message": plain_words(one) or sentence(one.get("message") or ""),
            "doubted": is_unreliable(one),
        }
        for one in (first, second)
    ]
    facts = {
        "logs": logs,
        "links": None if identities is None else [f"logs/{one}" for one in identities],
        "turned": identities and f"compare?first={identities[1]}&second={identities[0]}",
        "title": title,
        "changes": changes,
        "quantities": quantities_shown(rows, doubted=is_unreliable(first) or is_unreliable(second)),
        "probabilities": _probabilities_shown(*(_fitting_conditions(one) for one in (first, second))),
    }
    names = [str(log["file"]) for log in logs]
    headed = {
        "quantities": (
            "quantity",
            Column("says", "verdict"),
            Column("first", names[0]),
            Column("second", names[1]),
            "difference",
            Column("interval", "95 % interval of the difference"),
        ),
        "probabilities": ("condition", Column("first", names[0], "%"), Column("second", names[1], "%")),
    }
    return render_page("log_pages/compare.html", facts, headed, {})


def quantities_shown(rows: Sequence[Mapping[str, Any]], *, doubted: bool = False) -> "pd.DataFrame":
    """Return the quantities of two logs in the reader's units, with a comment on each.

    Parameters
    ----------
    doubted : bool
        Whether the numbers of a log are not reliable, so that no quantity is said to have changed or not.
    """
    import pandas as pd

    def comment(row: Mapping[str, Any]) -> str:
        if not row["interval"]:
            return "not in both logs"
        return DOUBTED if doubted else "changed" if row["changed"] else "no certain change"

    return pd.DataFrame([{**_in_reader_unit(row), "says": comment(row)} for row in rows])


def is_unreliable(result: Mapping[str, Any]) -> bool:
    """Return whether the numbers of a log are not reliable, because none of the models fits it."""
    from experiments.eha.plain_verdict import is_doubted

    return bool(result.get("unknown")) and (not plain_words(result) or is_doubted(result))


def _fitting_conditions(result: Mapping[str, Any]) -> Mapping[str, float] | None:
    """Return the probabilities of the conditions; None if none of them fits."""
    return None if is_unreliable(result) else result.get("probabilities")


def _probabilities_shown(first: Mapping[str, float] | None, second: Mapping[str, float] | None) -> "pd.DataFrame":
    """Return the conditions that are likely in at least one log, the most likely first; a dash means no diagnosis."""
    import pandas as pd

    both = first or {}, second or {}
    shares = {name: (both[0].get(name, 0.0), both[1].get(name, 0.0)) for name in {**both[0], **both[1]}}

    def told(one: Mapping[str, float], share: float) -> str:
        return percent_text(share) if one else MISSING

    likely = sorted(
        ((name, pair) for name, pair in shares.items() if max(pair) >= LEAST_SHARE), key=lambda one: -max(one[1])
    )
    return pd.DataFrame(
        [
            {"condition": condition_in_words(name), "first": told(both[0], a), "second": told(both[1], b)}
            for name, (a, b) in likely
        ]
    )


def comparison_rows(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the quantities of two logs with their differences.

    Returns
    -------
    list of dict
        ``quantity``, ``unit``, ``first`` and ``second`` (entries with value and std, or None), ``difference`` (second
        minus first), its 95 % ``interval`` for independent errors, and ``changed``, whether that interval excludes
        zero.
    """
    both = [quantities_of(one) for one in (first, second)]
    rows: list[dict[str, Any]] = []
    for name in {**both[0], **both[1]}:
        pair = [one.get(name) for one in both]
        known = [one for one in pair if one is not None and one.get("value") is not None]
        row: dict[str, Any] = {"quantity": name, "unit": next(one["unit"] for one in pair if one is not None)}
        row |= {"first": pair[0], "second": pair[1], "difference": None, "interval": None, "changed": False}
        if len(known) == 2:
            row["difference"] = known[1]["value"] - known[0]["value"]
            halves = [one for one in map(_half_widths, known) if one is not None]
            if len(halves) == 2:  # add in quadrature the ends that move the difference the same way
                (below_first, above_first), (below, above) = halves
                low = row["difference"] - math.hypot(below, above_first)
                high = row["difference"] + math.hypot(above, below_first)
                row["interval"], row["changed"] = [low, high], low > 0.0 or high < 0.0
        rows.append(row)
    return rows


def differences(first: Mapping[str, Any], second: Mapping[str, Any]) -> "pd.DataFrame":
    """Return the quantities of two logs with their differences, as a table for programs.

    Returns
    -------
    pandas.DataFrame
        By quantity: ``unit``, ``first``, ``second``, ``difference`` (second minus first), the ends ``low`` and ``high``
        of its 95 % interval [the row's unit], and ``changed``, whether that interval excludes zero. It is missing
        (``pandas.NA``) without that interval, or if the numbers of a log are not reliable.
    """
    import pandas as pd

    doubted = is_unreliable(first) or is_unreliable(second)
    rows = [
        {
            **{name: row[name] for name in ("quantity", "unit")},
            **{name: (row[name] or {}).get("value") for name in ("first", "second")},
            "difference": row["difference"],
            **dict(zip(("low", "high"), row["interval"] or (None, None), strict=True)),
            "changed": None if doubted or not row["interval"] else row["changed"],
        }
        for row in comparison_rows(first, second)
    ]
    return pd.DataFrame(rows).set_index("quantity").astype({"changed": "boolean"})


def quantities_of(result: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return severities and quantities of a log by name, each with its ``unit``.

    Parameters
    ----------
    result : Mapping
        Entries of the JSON contract, of any kind of actuator.
    """
    found: dict[str, dict[str, Any]] = {}
    for group in ("severity", "quantities"):
        for name, one in (result.get(group) or {}).items():
            if isinstance(one, Mapping) and "value" in one:
                found[name] = {"unit": one.get("unit") or "", **one}
    bulk = result.get("bulk_modulus_pa")
    if isinstance(bulk, Mapping) and bulk.get("value") is not None:
        found.setdefault("bulk_modulus", {"unit": "Pa", **bulk})
    return found


def _half_widths(one: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return how far the 95 % interval of a quantity extends below and above its value; None if it has no interval."""
    value, std, ends = one["value"], one.get("std"), one.get("ci95")
    if ends and None not in ends:
        return value - ends[0], ends[1] - value
    return None if std is None else (NORMAL_95 * std, NORMAL_95 * std)


def _in_reader_unit(row: Mapping[str, Any]) -> dict[str, str]:
    scale, unit = shop_unit(row["unit"])
    named = QUANTITY_NAMES.get(row["quantity"], row["quantity"].replace("_", " "))

    def amount(one: Mapping[str, Any] | None) -> str:
        if one is None or one.get("value") is None:
            return MISSING
        known = [scale * end for end in one.get("ci95") or () if end is not None]
        told = known if len(known) == 2 else None
        value, *ends = with_equal_decimals(scale * one["value"], told, unit)
        return f"{value} ({' to '.join(ends)})" if ends else value

    difference, interval = row["difference"], row["interval"]
    told = None if interval is None else [scale * end for end in interval]
    shown, *ends = with_equal_decimals(None if difference is None else scale * difference, told, unit)
    return {
        "first": amount(row["first"]),
        "second": amount(row["second"]),
        "difference": shown,
        "interval": " to ".join(ends) or MISSING,
        "quantity": f"{named} [{pretty_unit(unit)}]" if unit else named,
    }


def plain_words(result: Mapping[str, Any]) -> str:
    """Return the verdict of a diagnosis as on its page; empty for any other result."""
    from experiments.eha.plain_verdict import confidence_sentence, verdict
    from faults.conditions import CONDITIONS

    if result.get("condition") not in CONDITIONS or not result.get("probabilities"):
        return ""
    said = verdict(result)
    return said if result["unknown"] else f"{said} {confidence_sentence(result)}"


def headings(first: Mapping[str, Any], second: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the opening sentences of a comparison: the conditions if both logs were diagnosed, and the changes.

    Parameters
    ----------
    first, second : Mapping
        Entries of the logs in the JSON contract.
    rows : sequence of Mapping
        From `comparison_rows`.
    """
    doubted = [str(one["file"]) for one in (first, second) if is_unreliable(one)]
    changes = (
        f"Nothing certain can be said of what changed: the numbers of {joined_names(doubted)} are not reliable."
        if doubted
        else title_of(rows)
    )
    return [one for one in (_conditions_of(first, second), changes) if one]


def _conditions_of(first: Mapping[str, Any], second: Mapping[str, Any]) -> str:
    """Return the conditions of two logs in the order of the logs; empty if one of them was not diagnosed."""
    if not all(one.get("condition") and one.get("probabilities") for one in (first, second)):
        return ""
    one, other = (_verdict_words(each) for each in (first, second))
    return f"From {one} to {other}." if one != other else sentence(f"{one} in both logs")


def _verdict_words(result: Mapping[str, Any]) -> str:
    from experiments.eha.plain_verdict import is_of_another_size, is_other_fault, size_in_words

    if not result.get("unknown"):
        return condition_in_words(result["condition"])
    if is_other_fault(result):
        return "a fault beside the nine conditions"
    return size_in_words(result) if is_of_another_size(result) else "no verdict"


def title_of(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return which quantities are higher and which are lower in the second log, in one sentence."""
    changed = [row for row in rows if row["changed"]]
    if not any(row["interval"] for row in rows):
        return "The two logs cannot be compared: no quantity has an interval in both."
    if not changed:
        return "No certain difference between the two logs."
    found: list[str] = []
    for words, sign in (("higher", 1.0), ("lower", -1.0)):
        named = [
            QUANTITY_NAMES.get(one["quantity"], one["quantity"].replace("_", " "))
            for one in changed[:MOST_NAMED]
            if sign * one["difference"] > 0.0
        ]
        if named:
            found.append(f"{joined_names(named)} {'are' if len(named) > 1 else 'is'} {words}")
    more = "; more has changed" if len(changed) > MOST_NAMED else ""
    return f"In the second log, {'; '.join(found)}{more}."
