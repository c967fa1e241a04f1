"""One result folder a study, written whole or not at all."""

import json
import os
import shutil
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from secrets import token_hex
from types import MappingProxyType
from typing import Any

import pandas as pd

from experiments.figures import FIGURES, draw
from experiments.figures.style import styled
from experiments.figures.tables import PNG_DOTS_PER_INCH
from experiments.report.page import render_report
from experiments.study import StudyResult
from plant.errors import HydrostateError

SERIES_FORMAT = "%.9g"
"""Digits of the curves; tables keep all."""

DESKTOP_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
"""Files that file managers leave behind, which are nobody's work."""


def write_study(result: StudyResult, folder: Path) -> Path:
    """Write a study's report, figures, tables and models as one folder, replacing an earlier study's.

    All is written beside the folder first and takes its name at the end: an earlier result stays whole until then.

    Parameters
    ----------
    result : StudyResult
        What the study found.
    folder : Path
        The folder; new, empty, or an earlier study's result.

    Returns
    -------
    Path
        The report, ``report.html``.

    Raises
    ------
    HydrostateError
        If the folder holds anything that no study wrote, or cannot be written.
    """
    _write_whole(folder, lambda temporary: _fill(temporary, result))
    return folder / "report.html"


def write_tables(
    tables: Mapping[str, pd.DataFrame],
    manifest: Mapping[str, Any],
    folder: Path,
    files: Mapping[str, bytes] = MappingProxyType({}),
) -> Path:
    """Write a study's tables, and what was made of them, as one folder, replacing an earlier study's.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        What was found, by name.
    manifest : Mapping[str, Any]
        What it takes to run it again; its ``study`` names it.
    folder : Path
        The folder; new, empty, or an earlier study's result.
    files : Mapping[str, bytes]
        Report, figures and others, by their path within the folder.

    Returns
    -------
    Path
        The manifest, ``manifest.json``.

    Raises
    ------
    HydrostateError
        If the folder holds anything that no study wrote, or cannot be written.
    """

    def fill(temporary: Path) -> None:
        (temporary / "tables").mkdir(parents=True)
        _write_frames(temporary / "tables", tables)
        for name, content in files.items():
            path = temporary / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
        _write_manifest(temporary, manifest)

    _write_whole(folder, fill)
    return folder / "manifest.json"


def _write_whole(folder: Path, fill: Callable[[Path], None]) -> None:
    target = check_target(folder)
    temporary = target.with_name(f".{target.name}.{token_hex(4)}.tmp")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _removed_on_failure(temporary):
            fill(temporary)
            _swap(temporary, target)
    except OSError as error:
        raise _unwritable(folder, error) from error


def check_target(folder: Path) -> Path:
    """Tell whether a study may be written to a folder, before the study is run.

    Parameters
    ----------
    folder : Path
        Where the result shall go.

    Returns
    -------
    Path
        The folder without symbolic links.

    Raises
    ------
    HydrostateError
        If it is a file, is or holds the current folder, or holds anything that no study wrote, or if nothing can be
        written there.
    """
    try:
        return _checked(folder)
    except OSError as error:
        raise _unwritable(folder, error) from error


def _checked(folder: Path) -> Path:
    target = folder.resolve()
    if Path.cwd().is_relative_to(target):
        raise HydrostateError(
            f"result folder must be one of its own, got {folder}, which is or holds the current folder"
        )
    if target.exists() and not target.is_dir():
        raise HydrostateError(f"result folder must be a folder or not exist yet, got the file {folder}")
    strangers = sorted(_strangers(target)) if target.exists() else []
    if strangers:
        raise HydrostateError(
            f"result folder must be new, empty, or an earlier study's result, got {folder}, "
            f"which holds {strangers[0]}: choose another folder"
        )
    nearest = next(parent for parent in target.parents if parent.exists())
    if not (nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK)):
        raise HydrostateError(f"result folder {folder} must be in a place that can be written, got {nearest}")
    return target


def _unwritable(folder: Path, error: OSError) -> HydrostateError:
    return HydrostateError(
        f"result folder {folder} must be in a place that can be written, got: {error.strerror or error}"
    )


def _strangers(folder: Path) -> set[str]:
    """Return the files in a folder that no study wrote."""
    present = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        written = set(manifest["files"]) if "study" in manifest else set[str]()
    except (FileNotFoundError, ValueError, TypeError, KeyError):
        written = set[str]()
    return {name for name in present - written if Path(name).name not in DESKTOP_FILES}


@contextmanager
def _removed_on_failure(folder: Path) -> Generator[None]:
    try:
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _swap(temporary: Path, target: Path) -> None:
    if not target.exists():
        temporary.rename(target)
        return
    old = target.with_name(f".{target.name}.{token_hex(4)}.old")
    target.rename(old)
    try:
        temporary.rename(target)
    except BaseException:
        old.rename(target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _fill(folder: Path, result: StudyResult) -> None:
    for name in ("figures", "tables", "series"):
        (folder / name).mkdir(parents=True)
    _write_frames(folder / "tables", result.tables)
    _write_frames(folder / "series", result.series, SERIES_FORMAT)
    _write_json(folder / "transfer_functions.json", {name: model.to_dict() for name, model in result.library.items()})
    report = render_report(result, _write_figures(folder / "figures", result))
    (folder / "report.html").write_text(report, encoding="utf-8")
    _write_manifest(folder, result.manifest)


def _write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    files = [path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()]
    _write_json(folder / "manifest.json", {**manifest, "files": sorted([*files, "manifest.json"])})


def _write_frames(folder: Path, frames: Mapping[str, pd.DataFrame], float_format: str | None = None) -> None:
    for name, frame in frames.items():
        file = folder / (name.replace(",", "").replace(" ", "_") + ".csv")
        rows = (
            frame if pd.api.types.is_integer_dtype(frame.index) else frame.rename_axis(index="condition").reset_index()
        )
        rows.to_csv(file, index=False, float_format=float_format)


def _write_figures(folder: Path, result: StudyResult) -> Mapping[str, bytes]:
    """Write every figure twice and return the SVG files."""
    drawn: dict[str, bytes] = {}
    for name in FIGURES:
        figure = draw(name, result)
        with styled():
            buffer = BytesIO()
            figure.savefig(buffer, format="svg", metadata={"Date": None})
            figure.savefig(folder / f"{name}.png", dpi=PNG_DOTS_PER_INCH)
        drawn[name] = buffer.getvalue()
        (folder / f"{name}.svg").write_bytes(drawn[name])
    return drawn


def _write_json(path: Path, values: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(values, indent=2, allow_nan=False) + "\n", encoding="utf-8")
