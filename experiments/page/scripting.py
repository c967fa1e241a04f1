"""Embeds the scripts of a page, with a policy that allows no other script and no loading."""

import json
import re
from base64 import b64encode
from collections.abc import Iterable
from hashlib import sha256
from importlib.resources import files
from typing import Any

from markupsafe import Markup

_PLACES = files("experiments.page").joinpath("scripts")

SCRIPTS_BY_MARK = (
    ('class="charts"', "uplot/uPlot.iife.min.js"),
    ('class="charts"', "charts.js"),
    ('class="limit"', "limits.js"),
    ('class="fleet-table"', "fleet.js"),
    ('class="dropped-logs"', "serve.js"),
    ('class="live-stream"', "uplot/uPlot.iife.min.js"),
    ('class="live-stream"', "live.js"),
)
"""Marks that a page may contain, and the scripts that each requires, in their order."""

SERVER_MARKS = ('class="dropped-logs"', 'class="live-stream"')
"""Marks of pages that may send requests to their own server, but to no other."""

CHART_STYLE = "uplot/uPlot.min.css"

POLICY_HERE, SCRIPTS_HERE = "<!-- policy -->", "<!-- scripts -->"
"""Placeholders for the policy and the scripts."""


def with_scripts(page: str) -> str:
    """Return a page with the scripts that it needs, and with a policy that allows only these.

    Parameters
    ----------
    page : str
        HTML with `POLICY_HERE` and `SCRIPTS_HERE`.

    Returns
    -------
    str
        The page with scripts and styles allowed by their hashes, embedded images, and nothing else.
    """
    needed = [file for mark, file in SCRIPTS_BY_MARK if mark in page]
    scripts = [_text(file) for file in needed]
    style = f"<style>{_text(CHART_STYLE)}</style>\n" if SCRIPTS_BY_MARK[0][1] in needed else ""
    page = page.replace(SCRIPTS_HERE, "\n".join(f"<script>{one}</script>" for one in scripts))
    page = page.replace("</head>", f"{style}</head>", 1)
    styles = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    policy = (
        f"default-src 'none'; img-src data:; style-src {_allowed_hashes(styles)}; "
        f"script-src {_allowed_hashes(scripts)}; base-uri 'none'; form-action 'none'"
    )
    if any(mark in page for mark in SERVER_MARKS):
        policy += "; connect-src 'self'"
    return page.replace(POLICY_HERE, f'<meta http-equiv="Content-Security-Policy" content="{policy}">', 1)


def data_block(data: Any) -> Markup:
    r"""Return data as JSON that is safe inside a script element: no tag can start in it.

    Parameters
    ----------
    data : object
        Any JSON value; infinities are rejected.

    Returns
    -------
    Markup
        Text that a template does not escape.

    Examples
    --------
    >>> data_block({"name": "</script>"})
    Markup('{"name": "\\u003c/script>"}')
    """
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return Markup(text)  # noqa: S704 - no tag can begin in it


def _text(file: str) -> str:
    return _PLACES.joinpath(file).read_text(encoding="utf-8")


def _allowed_hashes(texts: Iterable[str]) -> str:
    hashes = [f"'sha256-{b64encode(sha256(one.encode()).digest()).decode()}'" for one in texts]
    return " ".join(hashes) or "'none'"
