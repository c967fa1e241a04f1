"""What to do about an actuator of a fleet, from the rows of its logs."""

from collections.abc import Mapping

from experiments.eha.plain_verdict import MAJOR, WORK_ON_FRICTION, WORK_ON_LEAKAGE
from experiments.fleet.actuators import ActuatorRow
from faults.conditions import CONDITIONS

CALLED_FOR = ("over", "likely", "alarm", "open")
"""States in which there is something to do on the actuator."""

BLEED = "Bleed the circuit and find where air gets in."

READ_ITS_PAGE = "Read the page of the last log: it says why there is no verdict, and what to check."
DIAGNOSE_IT = "Run hydrostate diagnose on the last log: it says why there is no verdict, and what to check."

WORKS: Mapping[str, Mapping[str, str]] = {"leakage": WORK_ON_LEAKAGE, "friction": WORK_ON_FRICTION}
"""What to check, by what is wrong and how badly."""

FAULTS: Mapping[str, str] = {"leakage_flow": "leakage", "added_friction": "friction"}
"""What is wrong if a severity grows; velocity lost and pressure rise may come of either."""


def what_to_do(row: ActuatorRow, *, has_page: bool) -> list[str]:
    """Return what to do about an actuator, the most important first.

    Parameters
    ----------
    has_page : bool
        Whether its last log has a page.

    Returns
    -------
    list of str
        Empty if nothing is past or near a limit, or if the kind of actuator has no such advice.
    """
    last = row.last
    if row.state == "unknown" and not last.between:
        return [READ_ITS_PAGE if has_page else DIAGNOSE_IT]
    if row.state not in CALLED_FOR and not last.between:
        return []
    soft = [BLEED] if row.deciding == "bulk_modulus" else []
    if last.between:  # a wrong sensor or rig file would look the same
        wrong = {name: "minor" if size < MAJOR else "major" for name, size in last.between.items() if size > 0.0}
        works = [WORKS[name][level] for name, level in wrong.items()]
        return [f"If rig file and sensors are right: {one[:1].lower()}{one[1:]}" for one in works]
    found = CONDITIONS.get(last.condition)
    levels = {} if found is None else {name: str(getattr(found, name)) for name in WORKS}
    works = [WORKS[name][level] for name, level in levels.items() if level in WORKS[name]]
    if not works and found is not None and row.deciding in FAULTS:  # it grows, but is not yet minor
        works = [WORKS[FAULTS[row.deciding]]["minor"]]
    return [*works, *soft]
