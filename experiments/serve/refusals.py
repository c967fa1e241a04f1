"""Refusals for human readers: a page with one sentence, in light or dark mode."""

import hashlib
import html
from base64 import b64encode

STYLE = (
    "body{max-width:40rem;margin:0 auto;padding:2rem 1.25rem;font:16px/1.5 system-ui,sans-serif;background:#fff;"
    "color:#1c1f23}h1{font-size:1.4rem}p{overflow-wrap:anywhere}a{color:#0072b2}"
    "@media(prefers-color-scheme:dark){body{background:#16191d;color:#e8eaed}a{color:#6fc0f0}}"
)
"""Style of the page, which may not load another page's style."""

_HASH = b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()

POLICY = f"default-src 'none'; style-src 'sha256-{_HASH}'; frame-ancestors 'none'"
"""Content security policy of the page: its own style, and nothing else."""


def wants_page(method: str, path: str, accept: str) -> bool:
    """Return whether a refusal is read by a person: a browser accepts pages, a program states what it accepts.

    Examples
    --------
    >>> wants_page("GET", "/fleet", "text/html,*/*;q=0.8"), wants_page("GET", "/fleet", "*/*")
    (True, False)
    """
    return method == "GET" and "text/html" in accept and not path.startswith("/api/")


def refusal_page(detail: str, path: str) -> str:
    """Return the page that gives the reason for a refusal.

    Parameters
    ----------
    path : str
        Path that was asked for: the page of all logs is that many folders above it, also behind a proxy.
    """
    said = html.escape(f"{detail[:1].upper()}{detail[1:].rstrip('.')}.")
    home = "../" * (path.count("/") - 1) or "./"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Hydrostate: not shown</title>'
        '<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">'
        f"<style>{STYLE}</style></head>"
        f"<body><main><h1>This page cannot be shown.</h1><p>{said}</p>"
        f'<p><a href="{home}">All logs</a></p></main></body>'
        "</html>\n"
    )
