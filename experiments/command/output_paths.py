"""Files that a command writes in addition to its results: checked before the work, with one file for each log."""

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from plant.errors import HydrostateError

PAGES = (".html", ".htm", "")
"""Allowed endings of a page's file name."""

FILE_ENDINGS = (
    ".csv",
    ".txt",
    ".xml",
    ".xlsx",
    ".html",
    ".htm",
    ".png",
    ".pdf",
    ".toml",
    ".parquet",
    ".mat",
    ".c",
    ".h",
)
"""Endings of files: a folder with such a name would be a mistake."""

Owner = TypeVar("Owner", Path, str)


def paths_by_owner(target: Path | None, owners: Sequence[Owner]) -> dict[Owner, Path]:
    """Return the file for each log or output; if there are several, each file name contains the name of its owner.

    Parameters
    ----------
    target : Path or None
        As given to an option such as ``--figure``; None if nothing is written.
    owners : sequence of Path or of str
        Logs, or names of outputs.

    Returns
    -------
    dict
        File by log or output; empty if nothing is written. If logs in two folders have the same name, their folders are
        included in the file names.

    Examples
    --------
    >>> paths_by_owner(Path("fit.png"), [Path("a/run.csv"), Path("b/run.csv")])[Path("b/run.csv")]
    PosixPath('fit-b-run.png')
    """
    if target is None:
        return {}
    distinct = list(dict.fromkeys(owners))
    if len(distinct) == 1:
        return {distinct[0]: target}
    names = (f"{target.stem}-{label}{target.suffix}" for label in _labels(distinct))
    return {one: target.with_name(name) for one, name in zip(distinct, names, strict=True)}


def require_no_log(option: str, places: Iterable[Path], logs: Iterable[Path]) -> None:
    """Raise an error if a log, or a file that `plant.log.files.write_record` put beside it, would be overwritten.

    Parameters
    ----------
    option : str
        Name of the option on the command line.
    places : iterable of Path
        Files to write.
    logs : iterable of Path
        Files to read.

    Raises
    ------
    HydrostateError
        If one of the files is a log.
    """
    from plant.log.files import sidecar

    there = [place for place in places if place.is_file()]
    for log in logs if there else ():
        for read in (log, sidecar(log)):
            if read.is_file() and any(place.samefile(read) for place in there):
                raise HydrostateError(f"{option}: {read} is read and would be overwritten; give another name")


def require_place(option: str, path: Path | None, ending: str = "", logs: Iterable[Path] = ()) -> None:
    """Raise an error before the work if a file cannot be written, or not under this name.

    Parameters
    ----------
    option : str
        Name of the option on the command line.
    path : Path or None
        The file to write; None, not given, passes.
    ending : str
        Required ending of its name, such as ``.png``; any ending if empty.
    logs : iterable of Path
        Files to read, which must not be overwritten.

    Raises
    ------
    HydrostateError
        If it names a folder, a file in a missing folder, another kind of file, or a log.
    """
    if path is None:
        return
    if ending and path.suffix.lower() != ending:
        raise HydrostateError(f"{option} must end in {ending}, got {str(path)!r}")
    if not path.name or path.is_dir():
        raise HydrostateError(f"{option} must be a file, got the folder {str(path)!r}")
    if not path.parent.is_dir():
        raise HydrostateError(f"{option} {path}: there is no such folder")
    require_no_log(option, [path], logs)


def require_folder(folder: Path | None) -> None:
    """Raise an error before the work if the folder of ``--out`` is a file, or is named like one.

    Parameters
    ----------
    folder : Path or None
        Folder for the files; None, not given, passes.

    Raises
    ------
    HydrostateError
        If it is a file, or does not exist and has the ending of a file.
    """
    if folder is None or folder.is_dir():
        return
    if folder.exists():
        raise HydrostateError(f"--out must be a folder, got the file {str(folder)!r}")
    if folder.suffix.lower() in (*FILE_ENDINGS, ".json"):
        raise HydrostateError(f"--out must be a folder, got {str(folder)!r}, which looks like the name of a file")


def page_place(report: Path | None) -> Path | None:
    """Return the path of the page of ``--report``; the ending ``.html`` is added if it is missing.

    Parameters
    ----------
    report : Path or None
        As given on the command line; None, not given, stays None.

    Raises
    ------
    HydrostateError
        If it names a folder, a file in a missing folder, or another kind of file.
    """
    require_place("--report", report)
    if report is None:
        return None
    return with_page_ending("--report", report)


def with_page_ending(what: str, page: Path) -> Path:
    """Return the name of a page; the ending ``.html`` is added if it is missing.

    Parameters
    ----------
    what : str
        The user's name for it, such as ``--report``.

    Raises
    ------
    HydrostateError
        If it does not have the ending of a page, or is a folder.
    """
    if page.is_dir():
        raise HydrostateError(f"{what} must be a file, got the folder {str(page)!r}")
    if page.suffix.lower() not in PAGES:
        print_it = "; a browser prints the page as PDF" if page.suffix.lower() == ".pdf" else ""
        raise HydrostateError(f"{what} must end in .html, got {page.name!r}{print_it}")
    return page.with_suffix(".html")


def pages_sentence(written: Sequence[Path]) -> str:
    """Return a sentence that names the files of the pages.

    Examples
    --------
    >>> pages_sentence([Path("page.html")])
    'written: page.html; open it in a browser'
    >>> pages_sentence([Path("page-a.html"), Path("page-b.html")])
    'written: page-a.html to page-b.html, 2 pages; open them in a browser'
    """
    if len(written) == 1:
        return f"written: {written[0]}; open it in a browser"
    return f"written: {written[0]} to {written[-1]}, {len(written)} pages; open them in a browser"


def _labels(owners: Sequence[Owner]) -> list[str]:
    """Return a name for each, as short as possible, but unique without regard to case."""
    labels: list[str] = []
    for labels in _candidates(owners):
        if len({label.casefold() for label in labels}) == len(labels):
            return labels
    given: list[str] = []
    for label in labels:
        taken = {one.casefold() for one in given}
        numbered = (label, *(f"{label}-{number}" for number in range(2, len(labels) + 2)))
        given.append(next(one for one in numbered if one.casefold() not in taken))
    return given


def _candidates(owners: Sequence[Owner]) -> Iterator[list[str]]:
    """Yield names for all: for logs the last part of the path without and with its ending, then more of the path."""
    paths = [one.absolute() for one in owners if isinstance(one, Path)]
    if len(paths) < len(owners):
        yield [re.sub(r"[^\w.+-]+", "_", str(one)).strip("_") or "output" for one in owners]
        return
    for depth in range(1, max(len(path.parts) for path in paths)):
        yield ["-".join((*path.parts[1:-1], path.stem)[-depth:]) for path in paths]
        yield ["-".join(path.parts[1:][-depth:]) for path in paths]
