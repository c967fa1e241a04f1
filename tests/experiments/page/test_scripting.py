"""A page runs its own scripts and no others."""

import re
from base64 import b64encode
from hashlib import sha256
from importlib.resources import files

from experiments.page.scripting import POLICY_HERE, SCRIPTS_HERE, with_scripts


def page_with(body: str) -> str:
    return f"<html><head>{POLICY_HERE}<style>p {{}}</style></head><body>{body}{SCRIPTS_HERE}</body></html>"


def policy(page: str) -> str:
    (found,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    return found


def test_a_page_without_charts_contains_and_allows_no_script() -> None:
    page = with_scripts(page_with(""))
    assert "<script" not in page
    assert "default-src 'none'" in policy(page)
    assert "script-src 'none'" in policy(page)


def test_scripts_and_styles_of_charts_are_allowed_by_their_hashes() -> None:
    page = with_scripts(page_with('<figure class="charts"></figure>'))
    scripts, styles = re.findall("<script>(.*?)</script>", page, re.DOTALL), re.findall("<style>(.*?)</style>", page)
    assert len(scripts) == 2
    assert "uPlot" in scripts[0]
    for one in (*scripts, *styles):
        assert f"'sha256-{b64encode(sha256(one.encode()).digest()).decode()}'" in policy(page)


def test_the_library_keeps_its_licence_and_its_version() -> None:
    place = files("experiments.page").joinpath("scripts/uplot")
    assert "Permission is hereby granted" in place.joinpath("LICENSE").read_text("utf-8")
    version = place.joinpath("VERSION").read_text("utf-8").strip()
    assert f"(v{version})" in place.joinpath("uPlot.iife.min.js").read_text("utf-8")[:300]


def test_only_pages_of_the_server_may_send_requests_to_it() -> None:
    for mark in ("dropped-logs", "live-stream"):
        assert policy(with_scripts(page_with(f'<div class="{mark}"></div>'))).endswith("; connect-src 'self'")
    assert "connect-src" not in policy(with_scripts(page_with('<figure class="charts"></figure>')))
