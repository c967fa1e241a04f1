"""Writes a store's report, figures and tables beside it or elsewhere, from the store alone."""

from collections.abc import Mapping

import pandas as pd

from experiments.batch.folder import Folder
from experiments.batch.part_store import PartStore
from experiments.batch.summary import frame_of, summary_tables
from experiments.figures.batch import BATCH_FIGURES
from experiments.figures.tables import figure_files
from experiments.report.batch import render_batch_report
from plant.errors import HydrostateError

REPORT = "report.html"


def write_report(store: PartStore, folder: Folder) -> str:
    """Write a study's report, its figures and its tables.

    Parameters
    ----------
    store : PartStore
        The store; it may be growing.
    folder : Folder
        Where to.

    Returns
    -------
    str
        Where the report is.

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
    kinds = {name: kind for name, kind in BATCH_FIGURES.items() if _drawable(name, tables)}
    figures = figure_files(kinds, tables)
    page = render_batch_report(manifest, tables, figures["svg"], len(rows))
    files = {
        f"figures/{name.replace(' ', '_')}.{kind}": image
        for kind, all_ in figures.items()
        for name, image in all_.items()
    }
    files |= {
        f"tables/{name.replace(' ', '_')}.csv": table.to_csv(index=name == "confusion").encode()
        for name, table in tables.items()
    }
    try:
        for name, content in {**files, REPORT: page.encode()}.items():
            folder.write(name, content)
    except OSError as error:
        raise HydrostateError(f"report {folder.name} cannot be written: {error.strerror or error}") from error
    return f"{folder.name.rstrip('/')}/{REPORT}"


def _drawable(name: str, tables: Mapping[str, pd.DataFrame]) -> bool:
    if name not in tables:
        return False
    return name != "bulk modulus" or bool(tables[name]["median_percent"].notna().any())
