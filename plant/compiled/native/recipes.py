"""Remembers which kernel a model gives: the text of a large kernel takes a tenth of a second to write.

A model's text follows from the sources of the packages and from its inputs. If neither has changed, the text has not
changed, and is not written again. Only a process that changes nothing in the packages while it runs may rely on that:
the command line declares so, tests and notebooks do not.
"""

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import FunctionType

PACKAGES = ("plant", "estimation", "faults")
"""Packages that determine a kernel's text."""

_ROOT = Path(__file__).resolve().parents[3]

_trusted: list[bool] = []


def trust_sources() -> None:
    """Rely on the packages' files: nothing changes in them while this process runs."""
    _trusted.append(True)


def recipe(name: str, made_of: object, machine: str) -> str | None:
    """Return a hash of everything that determines a kernel's text, or None if that cannot be known.

    Parameters
    ----------
    name : str
        Name of the kernel.
    made_of : object
        Everything from which its text is written: functions and classes of the packages, dataclasses, numbers, tuples
        of them.
    machine : str
        Compiler and target of the kernel.
    """
    import hashlib  # imported here, so that a call for help does not wait for it

    known = identity(made_of) if _trusted and made_of is not None else None
    sources = _sources() if known is not None else None
    if sources is None:
        return None
    return hashlib.sha256(f"{name}\n{machine}\n{sources}\n{known}".encode()).hexdigest()


@cache
def _sources() -> str | None:
    """Return a hash of all sources' stamps, or None if they are not files, as in an archive."""
    import hashlib

    try:
        stamps = "".join(stamp for package in PACKAGES for stamp in _stamps(str(_ROOT / package)))
    except OSError:
        return None
    return hashlib.sha256(stamps.encode()).hexdigest()


def _stamps(folder: str) -> Iterator[str]:
    """Yield path, size and times of each source below a folder; reading them takes 20 ms.

    The time of a file's last status change is the time of its installation, whatever modification time a package gives.
    """
    with os.scandir(folder) as found:
        for one in sorted(found, key=lambda one: one.name):
            if one.name.endswith(".py"):
                seen = one.stat()
                yield f"{one.path} {seen.st_size} {seen.st_mtime_ns} {seen.st_ctime_ns}\n"
            elif one.is_dir():
                yield from _stamps(one.path)


def identity(thing: object) -> str | None:
    """Return a text that is unique to this thing, or None if the packages' sources do not determine it.

    Parameters
    ----------
    thing : object
        See `recipe`.

    Examples
    --------
    >>> identity((1, "a", 0.5))
    "(1, 'a', 0.5)"
    >>> identity(lambda: 1) is None
    True
    """
    match thing:
        case None | bool() | int() | float() | str():
            return repr(thing)
        case tuple() | list():
            return _joint_identity(thing)
        case Mapping():
            return _joint_identity(part for pair in thing.items() for part in pair)
        case type() | FunctionType():
            return _import_path(thing)
        case _ if is_dataclass(thing):
            return _joint_identity([type(thing), *(getattr(thing, field.name) for field in fields(thing))])
        case _:
            return None


def _joint_identity(things: Iterable[object]) -> str | None:
    parts = [identity(thing) for thing in things]
    found = [part for part in parts if part is not None]
    return f"({', '.join(found)})" if len(found) == len(parts) else None


def _import_path(thing: type | FunctionType) -> str | None:
    """Return the import path of a class or function, if it is found there."""
    if thing.__module__.partition(".")[0] not in PACKAGES:
        return None
    there = getattr(sys.modules.get(thing.__module__), thing.__qualname__, None)
    return f"{thing.__module__}:{thing.__qualname__}" if getattr(there, "__wrapped__", there) is thing else None
