"""Actuators of one name in several folders: one actuator whose logs moved on, or several of the same name."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from experiments.fleet.naming import ActuatorAndDate


def apart_by_folder(named: "Mapping[str, ActuatorAndDate]", folders: Mapping[str, str]) -> "dict[str, ActuatorAndDate]":
    """Tell actuators of the same name apart by their folders, if logs of several folders are of the same time.

    Folders that follow each other, such as one a month, hold one actuator. Two sites, each with its P-12, do not: taken
    for one, a sick actuator would be hidden behind the last log of a sound one.

    Parameters
    ----------
    named : Mapping[str, ActuatorAndDate]
        By file.
    folders : Mapping[str, str]
        Folder that holds the actuator, by file; empty for the fleet's own.

    Returns
    -------
    dict[str, ActuatorAndDate]
        By file; the name is that of folder and actuator where folders differ.
    """
    places: dict[str, dict[str, list[float]]] = {}
    for file, one in named.items():
        if one.actuator and one.place is not None:
            places.setdefault(one.actuator, {}).setdefault(folders[file], []).append(one.place)
    several = {name for name, by_folder in places.items() if _overlap(by_folder.values())}
    return {
        file: replace(one, actuator=f"{folders[file]}/{one.actuator}".lstrip("/")) if one.actuator in several else one
        for file, one in named.items()
    }


def _overlap(groups: Collection[Collection[float]]) -> bool:
    """Return whether any group begins before, or when, the one before it has ended."""
    spans = sorted((min(group), max(group)) for group in groups)
    return any(after[0] <= before[1] for before, after in pairwise(spans))
