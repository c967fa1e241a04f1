"""The report of a batch study, with figures and tables, written from its store alone."""

from experiments.batch.figures import BATCH_FIGURES
from experiments.batch.folder import Folder
from experiments.batch.log_pages import pages_in
from experiments.batch.pages import render_batch_report
from experiments.batch.part_store import PartStore
from experiments.batch.standing import logs_by_standing
from experiments.batch.summary import frame_of, summary_tables
from experiments.page.figure_files import figure_files
from experiments.page.folder import csv_files
from experiments.page.frames import Tables
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

REPORT = "report.html"


def write_report(store: PartStore, folder: Folder) -> str:
    """Write a study's report, figures and tables; the report links to pages of logs that are in the folder.

    Parameters
    ----------
    store : PartStore
        The store; it may still be growing.

    Raises
    ------
    HydrostateError
        If there is no store, or the folder cannot be written.
    """
    manifest = store.manifest()
    if manifest is None:
        raise HydrostateError(f"store {store.name}: there is no batch study there")
    rows = store.rows()
    tables = summary_tables(frame_of(rows))
    drawings = {name: draw for name, draw in BATCH_FIGURES.items() if _is_drawable(name.replace("_", " "), tables)}
    figures = figure_files(drawings, tables)
    logs = tables["logs"]["file"].dropna().tolist() if "logs" in tables else []
    page = render_batch_report(
        manifest, tables, figures, len(rows), pages_in(folder, logs), logs_by_standing(rows)
    ).encode()
    numbered = {name: table.reset_index() if table.index.name else table for name, table in tables.items()}
    with os_errors_as(f"report {folder.name} cannot be written"):
        for name, content in {**figures, **csv_files("tables", numbered), REPORT: page}.items():
            folder.write(name, content)
    return f"{folder.name.rstrip('/')}/{REPORT}"


def _is_drawable(name: str, tables: Tables) -> bool:
    if name not in tables:
        return False
    return name != "bulk modulus" or bool(tables[name]["median_percent"].notna().any())
