"""The pages of the fleet of all logs on a server, and of one actuator, made in a process that can be killed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias
from urllib.parse import quote

from plant.errors import HydrostateError

if TYPE_CHECKING:
    from experiments.fleet.actuators import ActuatorRow

Diagnosed: TypeAlias = Sequence[tuple[str, str, Mapping[str, Any]]]
"""Identity, name and batch row entries of each diagnosed log."""


Repairs: TypeAlias = Mapping[str, Sequence[float]]
"""Times of repairs, by actuator name [day]."""


def fleet_view(rows: Diagnosed, pattern: str | None, limits: Mapping[str, float], repairs: Repairs, source: str) -> str:
    """Return the page of the fleet.

    Parameters
    ----------
    rows : sequence of tuple
        In the form of `Diagnosed`.
    pattern : str or None
        Pattern of log names.
    limits : Mapping[str, float]
        Limits of severities [their units].
    repairs : Mapping[str, sequence of float]
        Times of repairs, by actuator name [day].
    """
    from experiments.fleet.page import fleet_page

    found, pages = _actuators(rows, pattern, limits, repairs)
    links = {
        row.name: f"actuator?name={quote(row.name, safe='')}" if len(row.logs) > 1 else pages[row.last.file]
        for row in found
        if len(row.logs) > 1 or row.last.state != "failed"
    }
    return fleet_page(found, links, source, home=".")


def actuator_view(
    rows: Diagnosed, pattern: str | None, limits: Mapping[str, float], repairs: Repairs, name: str
) -> str:
    """Return the page of an actuator; empty if there is none with that name.

    Parameters
    ----------
    rows, pattern
        As in `fleet_view`.
    limits : Mapping[str, float]
        Limits of severities [their units].
    repairs : Mapping[str, sequence of float]
        Times of repairs, by actuator name [day].
    """
    from experiments.fleet.actuator_page import actuator_page

    found, pages = _actuators(rows, pattern, limits, repairs)
    row = next((one for one in found if one.name == name), None)
    if row is None:
        return ""
    return actuator_page(row, {one.file: pages[one.file] for one in row.logs if one.state != "failed"}, "fleet")


def _actuators(
    rows: Diagnosed, pattern: str | None, limits: Mapping[str, float], repairs: Repairs
) -> "tuple[list[ActuatorRow], dict[str, str]]":
    """Return the actuators, and the page of each log by its file."""
    from experiments.fleet.actuators import actuator_rows
    from experiments.fleet.naming import by_dates, by_pattern
    from experiments.fleet.rows import log_rows

    counts = Counter(name for _, name, _ in rows)
    files = {identity: name if counts[name] == 1 else f"{name} ({identity[:6]})" for identity, name, _ in rows}
    try:
        told = by_pattern(counts, pattern) if pattern else by_dates(counts)
    except HydrostateError:  # a date in a file name is invalid
        told = {}
    names = {files[identity]: told[name] for identity, name, _ in rows if name in told}
    blank = dict.fromkeys(("outcome", "found_condition", "reason", "quantities", "against"))
    table = [{**blank, **entries, "verb": "diagnose", "file": files[identity]} for identity, _, entries in rows]
    pages = {file: f"logs/{identity}" for identity, file in files.items()}
    return actuator_rows(log_rows(table, names, limits), repairs), pages
