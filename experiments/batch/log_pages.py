"""Pages of the worst logs of a batch study, linked from its report."""

from collections.abc import Collection

from experiments.actuators import kind_of_rig, verb_of_kind
from experiments.batch.cases import Plan
from experiments.batch.folder import Folder
from experiments.batch.logs_listed import read_listed
from experiments.batch.part_store import PartStore
from experiments.batch.series import Log
from experiments.batch.standing import STANDING_COLUMNS, logs_by_standing
from experiments.command.log_verb import page_of
from experiments.command.logs import catch_log_warnings
from experiments.fleet.log_pages import file_name
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

PAGES = "pages"
"""Sub-folder of a store that holds the pages."""


def write_log_pages(plan: Plan, store: PartStore, most: int) -> list[str]:
    """Write a page for each of the worst logs that were diagnosed.

    Parameters
    ----------
    plan : Plan
        The study.
    store : PartStore
        Store with the study's rows; the pages are written into its folder.
    most : int
        Maximum number of pages [count].

    Returns
    -------
    list of str
        One sentence for each log whose page could not be written, with the reason.
    """
    logs = {
        one.series.file: (one.series, work)
        for one in plan.groups
        for work in one.works
        if isinstance(one.series, Log) and work.verb == "diagnose"
    }
    rows = logs_by_standing(store.rows(list(STANDING_COLUMNS)))
    worst = [one for one in rows if one.file in logs and one.state != "failed"]
    unwritten: list[str] = []
    for one in worst[:most]:
        series, work = logs[one.file]
        rig = plan.rig_of(series)
        kind = kind_of_rig(rig, plan.study.plant)
        chosen = verb_of_kind(kind, "diagnose")
        options = {**chosen.options, "seed": 0} | ({} if work.pressure else {"no_pressure": True})
        try:
            with catch_log_warnings():
                record = read_listed(series, rig, kind.required)
                found = chosen.run(record, *chosen.prepare(rig, options))
            result = {**chosen.blank, "file": one.file, "rig": rig.name, **chosen.entries(found)}
            page = page_of(chosen, result, found, record, rig).encode()
            with os_errors_as(f"page of {one.file} cannot be written"):
                store.folder.write(f"{PAGES}/{file_name(one.file)}", page)
        except HydrostateError as error:
            unwritten.append(str(error))
    return unwritten


def pages_in(folder: Folder, files: Collection[str]) -> dict[str, str]:
    """Return the pages of logs in a folder.

    Returns
    -------
    dict[str, str]
        Path of each log's page, relative to the report.
    """
    there = set(folder.files(f"{PAGES}/"))
    named = {file: file_name(file) for file in files}
    return {file: f"{PAGES}/{name}" for file, name in named.items() if name in there}
