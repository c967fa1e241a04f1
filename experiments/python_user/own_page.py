"""The page of an answer in Python: one HTML file, with the file name that the command line would accept too."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.model import FreeRunModel
    from estimation.identification.model.linear_model import LinearModel
    from plant.log.record import Record


def page_path(path: "str | Path") -> Path:
    """Return the path of a page, with the ending ``.html``.

    Raises
    ------
    HydrostateError
        If it is not a path, or its name does not have the ending of a page.

    Examples
    --------
    >>> page_path("pages/bench").name
    'bench.html'
    """
    from os import PathLike

    from experiments.command.output_paths import with_page_ending
    from plant.errors import HydrostateError

    if not isinstance(path, str | PathLike):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
        raise HydrostateError(f"the path of a page is needed, got {path!r:.80}")
    file = Path(path)
    return with_page_ending("the name of a page", file) if file.name else file


def write_page(path: "str | Path", page: str) -> Path:
    """Write a page and return its file; no partial file is left behind, and missing folders are created.

    Raises
    ------
    HydrostateError
        If the file cannot be written, or `page_path` refuses it.
    """
    from experiments.command.json_output import write_whole

    file = page_path(path)
    write_whole(file, page, parents=True)
    return file


def page_of_columns(entries: Mapping[str, Any], model: "FreeRunModel", data: "Channels", title: str) -> str:
    """Return the page of a model between any columns, as ``identify --report`` writes it.

    Parameters
    ----------
    entries : Mapping
        Of the model, by the names of the JSON contract.
    data : Channels
        The data used for the fit.
    title : str
        Name of the log on the page.
    """
    from experiments.log_pages.identified_page import identified_page
    from experiments.log_pages.identified_view import view_of_columns

    return identified_page(view_of_columns({**entries, "file": title}, model, data))


def page_of_channels(record: "Record", model: "LinearModel", options: Mapping[str, Any], title: str) -> str:
    """Return the page of a transfer function between two channels of a test bench, as ``identify --report`` writes it.

    Parameters
    ----------
    record : Record
        The log used for the fit.
    options : Mapping
        Options of the fit.
    title : str
        Name of the log on the page.
    """
    from estimation.identification.from_record import record_signals
    from experiments.identification.of_channels import page_of_new_model

    taken = {name: options[name] for name in ("sample_time", "filter_cutoff_hz") if name in options}
    u, y = record_signals(record, output=model.output_name, input=model.input_name, **taken)
    return page_of_new_model(model, u, y, title)
