"""Shared parts of the verbs that run a study: the option for its folder, and their exit."""

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, TypeAlias, TypeVar

from experiments.command.json_output import json_text
from experiments.command.options import option
from experiments.command.output_paths import require_folder
from experiments.command.terminal import emit

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from experiments.running.study import Study

Settings = TypeVar("Settings", bound="DataclassInstance")


def _folder(out: Path) -> Path:
    """Refuse a path that is not a folder before the study is imported, which takes seconds."""
    require_folder(out)
    return out


Folder: TypeAlias = Annotated[Path, option("DIR", "Folder of the report.", "--out", "-o", callback=_folder)]


def finish_study(study: "Study[Settings]", settings: Settings, out: Path, *, as_json: bool) -> None:
    """Run a study with progress on standard error, and print the path of its result.

    Raises
    ------
    HydrostateError
        If the folder cannot be written.
    """
    from rich.console import Console

    from experiments.running.study import run_study
    from experiments.streams.endings import stop_at_signals

    stop_at_signals()
    begin = perf_counter()
    written = run_study(study, settings, out, Console(stderr=True))
    manifest = str(written.with_name("manifest.json"))
    done = {"outcome": "ok", "report": str(written), "manifest": manifest, "seconds": perf_counter() - begin}
    emit(json_text([done]) if as_json else str(written))
