"""Turns clauses of results into sentences, for pages and terminals."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup, escape

from plant.eha.rig import UNNAMED
from plant.log.notes import LogCode

_DATE = re.compile(r"\b\d{4}-\d\d-\d\d\b")


def rig_in_words(name: str) -> str:
    """Return which actuator a log was compared with.

    Examples
    --------
    >>> rig_in_words("bench 7"), rig_in_words("paper")
    ('rig bench 7', "no rig file of your own: the paper's actuator is assumed")
    """
    if name == UNNAMED:
        return "no rig file of your own: the paper's actuator is assumed"
    return f"rig {name}"


def sentence(said: str) -> str:
    """Return a clause as a sentence; the name of a channel keeps its spelling.

    Examples
    --------
    >>> sentence("check the rig file"), sentence("position_m stays at 0")
    ('Check the rig file.', 'position_m stays at 0.')
    """
    begin = said[:1] if "_" in said.split(" ", 1)[0] else said[:1].upper()
    return f"{begin}{said[1:].rstrip('.')}."


def joined_names(names: Sequence[str]) -> str:
    """Return names as a list within a sentence.

    Examples
    --------
    >>> joined_names(["leakage"]), joined_names(["leakage", "friction", "bulk modulus"])
    ('leakage', 'leakage, friction and bulk modulus')
    """
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def whole_dates(said: str) -> Markup:
    """Return text in which no line break falls within a date.

    Examples
    --------
    >>> whole_dates("past since 2026-10-12")
    Markup('past since <span class="date">2026-10-12</span>')
    """
    return Markup(_DATE.sub(r'<span class="date">\g<0></span>', str(escape(said))))  # noqa: S704 - it was escaped


def unused_column_advice(result: Mapping[str, Any]) -> list[str]:
    """Return advice on unused columns that may be needed, as sentences.

    Parameters
    ----------
    result : Mapping
        Entries of a log; its ``notes`` include remarks from reading it.
    """
    codes = (LogCode.COLUMN_OVERLOOKED, LogCode.CHAMBER_ALONE)
    return [sentence(one["text"]) for one in result.get("notes", ()) if one["code"] in codes]


def rig_advice(result: Mapping[str, Any]) -> str:
    """Return what to do if there is no rig file for a log; empty if there is one.

    Examples
    --------
    >>> rig_advice({"rig": "P-12"})
    ''
    """
    if result["rig"] != UNNAMED:
        return ""
    return "Describe your actuator in a rig file: without one, these numbers are for the paper's actuator."
