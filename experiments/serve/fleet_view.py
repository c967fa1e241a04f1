"""The page of the fleet of all logs that a server has, made in a process that can be killed."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from plant.errors import HydrostateError


def fleet_view(
    rows: Sequence[tuple[str, str, Mapping[str, Any]]], pattern: str | None, limits: Mapping[str, float], source: str
) -> str:
    """Return the page of the fleet.

    Parameters
    ----------
    rows : sequence of tuple
        Identity, name and entries of a row of each log that was diagnosed.
    pattern : str or None
        How logs are named.
    limits : Mapping[str, float]
        Limits of severities [their units].
    """
    from experiments.fleet.actuators import actuator_rows
    from experiments.fleet.naming import UNNAMED, Named, by_pattern
    from experiments.fleet.page import fleet_page
    from experiments.fleet.rows import log_rows

    counts = Counter(name for _, name, _ in rows)
    files = {identity: name if counts[name] == 1 else f"{name} ({identity[:6]})" for identity, name, _ in rows}
    names: dict[str, Named] = {}
    for identity, name, _ in rows if pattern else ():
        try:
            names[files[identity]] = by_pattern([name], pattern or "")[name]
        except HydrostateError:  # a date that is none
            names[files[identity]] = UNNAMED
    blank = dict.fromkeys(("outcome", "found_condition", "reason", "quantities", "against"))
    table = [{**blank, **entries, "verb": "diagnose", "file": files[identity]} for identity, _, entries in rows]
    found = actuator_rows(log_rows(table, names, limits))
    by_file = {file: identity for identity, file in files.items()}
    links = {row.name: f"logs/{by_file[row.last.file]}" for row in found if row.last.state != "failed"}
    return fleet_page(found, links, source)
