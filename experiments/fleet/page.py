"""The page of a fleet: one row per actuator, the sickest at the top."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from experiments.fleet.actuators import ActuatorRow
from experiments.fleet.dates import short_months
from experiments.fleet.outlook import outlook_of
from experiments.fleet.rows import STATES, LogRow
from experiments.page.condition_names import condition_in_words, level_in_words
from experiments.page.names_shown import QUANTITY_NAMES
from experiments.page.numbers import MISSING, fixed, number, shop_unit, with_equal_decimals
from experiments.page.render import render_page
from experiments.page.scripting import data_block
from experiments.page.sentences import whole_dates
from experiments.page.tables import Cell, Column, right_aligned

MOST_STILL = 100
"""Rows of a table when scripts do not run [count]."""

MOST_OPEN, MOST_LISTED = 25, 10
"""Rows shown on paper [count]: actuators that are not sound (more if more are sick), and logs that could not be read or
have no date. With the key to the states they fill two sheets. `fleet.html` hides the remaining logs."""

UNREAD_COLUMNS = ("log", "actuator", "why")
"""Columns of the table of logs that could not be read."""

IF_RIG_RIGHT = ", if the rig file is right"
"""Suffix for the leakage and friction levels of a circuit that lies outside the nine conditions."""

MOST_NAMED = 5
"""Largest number of actuators named above the table [count]."""

LEAST_OPEN, SHARE_OPEN = 3, 0.2
"""Actuators without a verdict from which a wrong rig file is suspected [count, fraction of all]."""

SICK_STATES = ("over", "likely")
"""States of actuators that need work."""

SOUND_STATE = "within"
"""State of actuators that need no work."""

COLUMNS: Sequence[Mapping[str, Any]] = (
    {"label": "actuator", "kind": "name", "width": 7.7},
    {"label": "state", "kind": "state", "width": 11.3, "words": STATES},
    {"label": "found", "kind": "text", "width": 11.2},
    {"label": "worst", "kind": "text", "width": 10.0},
    {"label": "of the limit", "kind": "number", "width": 6.5, "unit": "%"},
    {"label": "outlook", "kind": "text", "width": 13.0},
    {"label": "logs left", "kind": "number", "width": 5.5},
    {"label": "last log", "kind": "text", "width": 6.8},
    {"label": "logs", "kind": "number", "width": 4},
)
"""Columns of the table; widths in units of the page's font size [rem]. 76 in total fit a screen of 1280 px."""


def fleet_page(rows: Sequence[ActuatorRow], links: Mapping[str, str], source: str, home: str = "") -> str:
    """Return the page of a fleet.

    Parameters
    ----------
    rows : sequence of ActuatorRow
        The sickest first.
    links : Mapping[str, str]
        Relative path of an actuator's own page, by actuator name.
    source : str
        Description of the fleet's source.
    home : str
        Path of the page of all logs, if a server provides one.
    """
    counts = Counter(row.state for row in rows)
    cells = [row_cells(row) for row in rows]
    every = [one for row in rows for one in row.logs]
    unread = [
        (one.file.rsplit("/", 1)[-1], one.named.actuator or MISSING, finding_text(one))
        for one in every
        if one.state == "failed"
    ]
    undated = [(one.file, one.named.problem) for one in every if one.named.problem]
    data = {"columns": COLUMNS, "rows": cells, "links": [links.get(row.name) for row in rows]}
    facts = {
        "source": source,
        "home": home,
        "title": title_of(rows),
        "sickest": sickest_of(rows),
        "hint": rig_hint(rows, served=bool(home)),
        "counts": [(words, counts[name], name) for name, words in STATES.items() if counts[name]],
        "logs": sum(len(row.logs) for row in rows),
        "data": data_block(data),
        "most": MOST_STILL,
        "pages": len(links),
        "rows": len(rows),
        "unread_count": len(unread),
        "unread": pd.DataFrame(unread[:MOST_STILL], columns=list(UNREAD_COLUMNS)),
        "undated_count": len(undated),
        "undated": pd.DataFrame(undated[:MOST_STILL], columns=["log", "why"]),
        "listed": MOST_LISTED,
        **_still_rows(rows, cells),
    }
    columns = [
        Column("state", words=lambda name: Cell(STATES[name], f"fleet-{name}")),
        Column("of the limit", unit="%", words=lambda share: right_aligned(fixed(share, 1))),
        Column("logs left", words=lambda left: right_aligned(number(left, 2))),
        Column("outlook", words=whole_dates),
        Column("last log", words=lambda day: Cell(day, "name")),
    ]
    shown = [next((one for one in columns if one.source == each["label"]), each["label"]) for each in COLUMNS]
    named = (Column("log", words=lambda name: Cell(name, "name")), *UNREAD_COLUMNS[1:])
    tables = {"still": shown, "others": shown, "unread": named, "undated": (named[0], "why")}
    return render_page("fleet/fleet.html", facts, tables, {})


def _still_rows(rows: Sequence[ActuatorRow], cells: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """Return the rows shown on paper, further rows shown when scripts do not run, and the counts of the others."""
    sick = sum(row.state in (*SICK_STATES, "alarm") for row in rows)
    ailing = [i for i, row in enumerate(rows) if row.state != SOUND_STATE][: max(MOST_OPEN, min(sick, MOST_STILL))]
    others = sorted(set(range(len(rows))).difference(ailing))
    left = Counter(rows[i].state for i in others)
    labels = [column["label"] for column in COLUMNS]
    return {
        "still": pd.DataFrame([cells[i] for i in ailing], columns=labels),
        "others": pd.DataFrame([cells[i] for i in others[: MOST_STILL - len(ailing)]], columns=labels),
        "left_out": [f"{left[name]} {words}" for name, words in STATES.items() if left[name]],
    }


def sickest_of(rows: Sequence[ActuatorRow]) -> list[str]:
    """Return the actuators to begin with, five at most: those past a limit, even if only under a correct rig file.

    If there are none, return those that are near a limit.

    Parameters
    ----------
    rows : sequence of ActuatorRow
        The sickest first.
    """
    sick = [row.name for row in rows if row.state in SICK_STATES]
    if not rig_hint(rows):  # a few outside the nine conditions are faulty; many mean that the rig file is wrong
        sick += [row.name for row in rows if row.state == "unknown" and row.last.beside and _is_past_limit(row.last)]
    return (sick or [row.name for row in rows if row.state == "alarm"])[:MOST_NAMED]


def _is_past_limit(log: LogRow) -> bool:
    return log.worst is not None and log.worst.share > 1.0


def title_of(rows: Sequence[ActuatorRow]) -> str:
    """Return a title with the number of sick actuators among those with readable logs."""
    known, alone = ([row for row in rows if bool(row.last.named.actuator) is each] for each in (True, False))
    if len(known) < len(alone):
        known, alone = list(rows), []
    counts = Counter(row.state for row in known)
    total = len(known) - counts["failed"]
    sick, certain = sum(counts[name] for name in SICK_STATES), counts["over"]
    stray = _apart(alone)
    if not total:
        return "No log could be read."
    if total == 1:
        probably = "probably " if sick and not certain else ""
        said = "nears a limit" if counts["alarm"] else f"is {probably}past {'a' if sick else 'no'} limit"
        return f"The actuator {said}{stray}."
    more = [
        f", {sick - certain} more probably" if certain and sick > certain else "",
        f"; {counts['alarm']} {'nears' if counts['alarm'] == 1 else 'near'} one" if counts["alarm"] else "",
        f"; {counts['unknown']} {'has' if counts['unknown'] == 1 else 'have'} no verdict" if counts["unknown"] else "",
        stray,
    ]
    told = certain or sick
    who = f"{told} of {total} actuators {'is' if told == 1 else 'are'}" if sick else f"None of {total} actuators is"
    who += " probably" if sick and not certain else ""
    return f"{who} past a limit{''.join(more)}."


def _apart(alone: Sequence[ActuatorRow]) -> str:
    """Return how many logs of no known actuator are past a limit or have no verdict; empty if none."""
    sick = sum(row.state in SICK_STATES for row in alone)
    open_ = sum(row.state == "unknown" for row in alone)
    if len(alone) == 1 and sick + open_:
        return f"; the log without an actuator {'is past one' if sick else 'has no verdict'}"
    said = [f"{sick} {'is' if sick == 1 else 'are'} past one"] if sick else []
    said += [f"{open_} {'has' if open_ == 1 else 'have'} no verdict"] if open_ else []
    return f"; of {len(alone)} logs without an actuator, {' and '.join(said)}" if said else ""


def rig_hint(rows: Sequence[ActuatorRow], *, served: bool = False) -> str:
    """Return advice if many actuators have no verdict, else an empty string.

    Parameters
    ----------
    rows : sequence of ActuatorRow
        In any order.
    served : bool
        Whether the logs are on a server, not in a folder of the reader.
    """
    unknown = [row for row in rows if row.state == "unknown"]
    if len(unknown) < LEAST_OPEN or len(unknown) < SHARE_OPEN * len(rows):
        return ""
    remedy = (
        "give each of them a rig file: start the server with --rigs FOLDER, in which P-12.toml is the rig file of P-12."
        if served
        else "move their logs into a folder of their own, with their rig file in it as rig.toml."
    )
    return (
        f"{len(unknown)} of {len(rows)} actuators have no verdict. If they are of another size than "
        f"the rig file says, {remedy}"
    )


def row_cells(row: ActuatorRow) -> list[Any]:
    """Return the table cells of an actuator, in the order of `COLUMNS`.

    Returns
    -------
    list
        Text, numbers, or None if unknown.
    """
    last = row.last
    told = last.has_verdict  # if no model fits, the severities are not the actuator's
    share = round(100.0 * last.worst.share, 1) + 0.0 if last.worst is not None and told else None  # no minus nought
    outlook = row.outlook
    left = None if outlook is None or outlook.left is None or not told else round(outlook.left[1], 1)
    words = _outlook_of_few(row) if outlook is None else outlook.words
    words = short_months(words.replace("past the limit ", "past ", 1))  # two lines hold the whole interval
    if outlook is not None and last.worst is not None and outlook.name != last.worst.name:
        words = f"{QUANTITY_NAMES.get(outlook.name, outlook.name)}: {words}"
    return [
        row.name,
        row.state,
        finding_text(last),
        worst_severity_text(last) if last.shows_severities else "",
        share,
        words if told else f"no verdict {no_verdict_since(row)}".strip(),
        left,
        last.named.day,
        len(row.logs),
    ]


def _outlook_of_few(row: ActuatorRow) -> str:
    """Return since when an actuator of too few logs for a trend is past its limit; else that they are too few."""
    few = None if row.last.worst is None else outlook_of(row.logs, row.last.worst.name)
    return "" if few is None else few.past or "too few logs"


def no_verdict_since(row: ActuatorRow) -> str:
    """Return since when there is no verdict; empty if there never was one, or if logs have no dates."""
    read = [one for one in row.logs if one.state != "failed"]
    known = [place for place, one in enumerate(read) if one.state != "unknown"]
    day = read[known[-1] + 1].named.day if known and known[-1] + 1 < len(read) else ""
    return f"since {day}" if day else ""


def finding_text(log: LogRow) -> str:
    """Return the finding of a log, or the reason why there is none, without the log's folder."""
    levels = [level_in_words(name, size) for name, size in log.between.items() if size > 0.0]
    if levels:
        return "; ".join(levels) + (IF_RIG_RIGHT if log.beside else "")
    return condition_in_words(log.condition) if log.condition else log.reason.split(f"{log.file}: ", 1)[-1]


def worst_severity_text(log: LogRow) -> str:
    """Return the severity that is closest to its limit, or farthest beyond it, with its name."""
    name = log.worst.name if log.worst else ""
    return f"{QUANTITY_NAMES.get(name, name.replace('_', ' '))} {severity_text(log, name)}" if name else ""


def severity_text(log: LogRow, name: str) -> str:
    """Return a severity with its unit; empty if the log does not determine it."""
    one = log.amounts.get(name)
    if one is None:
        return ""
    scale, unit = shop_unit(one.unit)
    shown, *_ = with_equal_decimals(scale * one.value, [scale * one.low, scale * one.high], unit)
    return f"{shown} {unit}"
