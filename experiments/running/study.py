"""A study: its results, figures and page. One runner makes the result folder for all studies."""

import platform
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from experiments.page.figure_files import Drawings, figure_files
from experiments.page.folder import check_target, write_tables
from experiments.page.frames import Tables
from experiments.page.render import render_page
from experiments.page.tables import Columns
from experiments.running.progress import Track, run_as_one_piece

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

PACKAGES = ("hydrostate", "numpy", "scipy", "llvmlite", "pandas", "control", "filterpy", "matplotlib")
"""Packages whose versions are stored with a result."""

Settings = TypeVar("Settings", bound="DataclassInstance", contravariant=True)


@dataclass(frozen=True)
class SeedSettings:
    """Settings of a study that needs only a seed."""

    seed: int


@dataclass(frozen=True, eq=False)
class StudyResult:
    """Result of a study.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        Results to read, by name.
    series : Mapping[str, pandas.DataFrame]
        Curves to draw, in long form, by name; their files keep nine digits.
    files : Mapping[str, bytes]
        Other files for the folder, by path.
    """

    tables: Tables
    series: Tables = field(default_factory=dict[str, pd.DataFrame])
    files: Mapping[str, bytes] = field(default_factory=dict[str, bytes])

    @property
    def frames(self) -> Tables:
        """Tables and series together, which are read by the figures and the page."""
        return {**self.tables, **self.series}


def _no_facts(_: Tables, __: object) -> Mapping[str, Any]:
    return {}


@dataclass(frozen=True, eq=False)
class Study(Generic[Settings]):
    """A study of one question. It knows nothing about files and processes; `run_study` makes its folder.

    Parameters
    ----------
    template : str
        Text of its page, by its path below ``experiments``.
    find : callable
        From the settings, and a progress display, to the results.
    figures : Mapping[str, callable]
        From the results to the figures, by file name. They compute nothing.
    columns : Mapping[str, Columns]
        How the page shows its tables, by name.
    parameters : Mapping[str, Any]
        Parameters of the studied object, for the manifest.
    facts : callable
        From the results and the settings to other values used in the page's text and tables.
    """

    name: str
    template: str
    find: Callable[[Settings, Track], StudyResult]
    figures: Drawings
    columns: Mapping[str, Columns]
    parameters: Mapping[str, Any]
    facts: Callable[[Tables, Settings], Mapping[str, Any]] = _no_facts


def run_study(study: Study[Settings], settings: Settings, out: Path, console: Console) -> Path:
    """Run a study and write its tables, figures and report as one folder; no partial folder is left behind.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced as a whole if it contains an earlier study.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    check_target(out)
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as progress:
        found = study.find(settings, progress.track)
        run_as_one_piece(progress.track, "drawing and writing", lambda: write_result(study, settings, found, out))
    return out / "report.html"


def write_result(study: Study[Settings], settings: Settings, found: StudyResult, out: Path) -> None:
    """Write the results of a study, with its figures and its report, as one folder.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced as a whole if it contains an earlier study.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    manifest = manifest_of(study, settings)
    files = figure_files(study.figures, found.frames)
    facts = {**manifest, **found.frames, **study.facts(found.frames, settings)}
    files["report.html"] = render_page(study.template, facts, study.columns, files).encode()
    write_tables(found.tables, manifest, out, {**found.files, **files}, found.series)


def manifest_of(study: Study[Settings], settings: Settings) -> Mapping[str, Any]:
    """Return the manifest needed to reproduce a study."""
    return {
        "study": study.name,
        "settings": asdict(settings),
        "parameters": study.parameters,
        "python": platform.python_version(),
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Return the versions of the packages used for a result, by package."""
    return {package: version(package) for package in PACKAGES}
