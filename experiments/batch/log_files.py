"""Files that a pattern matches. Each folder is entered once, however many links lead to it."""

from collections.abc import Iterator
from glob import escape, glob
from pathlib import Path

from experiments.batch.part_store import CASES, PARTS


def matching_files(pattern: str) -> list[str]:
    """Return the files that a pattern matches, in order of their names.

    Parameters
    ----------
    pattern : str
        A pattern for `glob.glob`; ``**`` stands for a folder and all folders below it.

    Returns
    -------
    list of str
        Paths of regular files, and of links to them. ``**`` enters each folder once, so circular links are harmless,
        and a link to a folder that contains the search is not followed. The store of a study holds results and no logs,
        so it is not entered.

    Examples
    --------
    >>> matching_files("/nowhere/**/*.csv")
    []
    """
    return sorted(path for path in set(_matches(pattern)) if Path(path).is_file())


def _matches(pattern: str) -> Iterator[str]:
    parts = Path(pattern).parts
    if "**" not in parts:
        yield from glob(pattern)  # noqa: PTH207 -- absolute too
        return
    place = parts.index("**")
    rest = Path(*parts[place + 1 :]) if parts[place + 1 :] else Path("*")
    for top in glob(str(Path(*parts[:place]))):  # noqa: PTH207 -- absolute too
        for folder in _folders(top):
            yield from _matches(str(Path(escape(folder)) / rest))


def _folders(top: str) -> Iterator[str]:
    """Yield a folder and all folders below it once each, linked ones last; hidden ones are skipped, as in glob."""
    top_itself = Path(top).resolve()
    seen: set[Path] = set()
    own, linked = [Path(top)], list[Path]()
    while own or linked:
        folder = own.pop() if own else linked.pop(0)
        try:
            itself = folder.resolve()
            if itself in seen or (folder.is_symlink() and top_itself.is_relative_to(itself) and folder != Path(top)):
                continue
            if (folder / CASES).is_file() and (folder / PARTS).is_dir():
                continue
            entries = [one for one in folder.iterdir() if not one.name.startswith(".") and one.is_dir()]
        except (OSError, RuntimeError):  # the folder cannot be read, or is a link to itself
            continue
        seen.add(itself)
        yield str(folder)
        for one in entries:
            (linked if one.is_symlink() else own).append(one)
