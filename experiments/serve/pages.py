"""The server's own pages, and the content security policy stored in saved pages."""

import html
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from experiments.serve.rigs import rig_files
from experiments.serve.settings import MB, VERBS, Settings

_POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">')

WORDS: Mapping[str, str] = {
    "diagnose": "what is wrong",
    "estimate": "bulk modulus of the oil",
    "inspect": "what the file contains",
}
"""Question that each verb answers."""

FORMATS = ("CSV or other text", "Parquet", "Feather", "MAT")
MORE_FORMATS: Mapping[str, str] = {"nptdms": "TDMS", "asammdf": "MDF", "h5py": "HDF5", "openpyxl": "XLSX"}
"""Log formats that need a package, by its module; any server reads the others."""

HEAD = 4096
"""Length of the start of a page in which its policy is found [count]."""


def policy_of(page: str) -> str:
    """Return the content security policy of a page, for the header; without one, the page is allowed nothing.

    Examples
    --------
    >>> policy_of("no page")
    "default-src 'none'; frame-ancestors 'none'"
    """
    found = _POLICY.search(page[:HEAD])
    allowed = html.unescape(found[1]) if found else "default-src 'none'"
    return f"{allowed}; frame-ancestors 'none'"


def policy_of_file(path: Path) -> str:
    """Return the content security policy of a page on disk."""
    with path.open(encoding="utf-8", errors="replace") as file:
        return policy_of(file.read(HEAD))


def home_page(settings: Settings) -> str:
    """Return the page for uploading logs."""
    more = tuple(name for module, name in MORE_FORMATS.items() if find_spec(module) is not None)
    return _rendered(
        "serve/home.html",
        (
            ("verbs", tuple((verb, WORDS[verb]) for verb in VERBS)),
            ("formats", (*FORMATS, *more)),
            ("largest", settings.largest // MB),
            ("seconds", f"{settings.seconds:g}"),
            ("streams", tuple(settings.streams)),
            ("rigs", None if settings.rigs is None else tuple(rig_files(settings.rigs))),
            ("others", None if settings.rig is None else settings.rig.name),
        ),
    )


def live_page(names: Sequence[str], name: str) -> str:
    """Return the page of a stream."""
    return _rendered("serve/live.html", (("streams", tuple(names)), ("name", name)))


@cache
def _rendered(template: str, facts: tuple[tuple[str, Any], ...]) -> str:
    from experiments.page.render import render_page

    return render_page(template, dict(facts), {}, {})
