"""The server's own pages, and the content security policy stored in saved pages."""

import html
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from starlette.responses import StreamingResponse

from experiments.serve.limits import RefusedError
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

_PART = 1 << 16


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


def page_on_disk(path: Path) -> StreamingResponse:
    """Return a page on disk as a response, which stays whole if the page is deleted meanwhile.

    Raises
    ------
    RefusedError
        If it was deleted before.
    """
    try:
        file = path.open("rb")
    except FileNotFoundError as error:
        raise RefusedError(404, "the page was deleted") from error

    def parts() -> Iterator[bytes]:
        with file:
            while part := file.read(_PART):
                yield part

    headers = {"Content-Length": str(os.fstat(file.fileno()).st_size)}
    headers["Content-Security-Policy"] = policy_of(file.read(HEAD).decode("utf-8", "replace"))
    file.seek(0)
    return StreamingResponse(parts(), media_type="text/html", headers=headers)


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
