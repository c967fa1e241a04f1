"""`hydrostate report STORE`: the report of a batch study, written from its store."""

from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import argument, option
from experiments.command.output_paths import require_folder
from experiments.command.terminal import emit

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate report results/eha-paper --out report")
def report(
    store: Annotated[str, argument("STORE", "Store of a batch study.")],
    out: Annotated[
        str | None, option("DIR", "Folder of the report; by default that of the store.", "--out", "-o")
    ] = None,
) -> None:
    """Write the report of a batch study from its store, also while the study still runs.

    The last line of standard output is the report's path.
    """
    from experiments.batch.folder import open_folder
    from experiments.batch.part_store import open_store
    from experiments.batch.report import write_report

    require_folder(None if out is None else Path(out))
    emit(write_report(open_store(store), open_folder(out or store)))
