"""How Sphinx builds the site: `make docs`. Pages of the API and the drawing of the house are written from the code."""

import sys
import tomllib
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent))
sys.path.insert(0, str(DOCS))

from site_pages import api_pages, house_drawing, house_table  # noqa: E402 -- of this folder

project = "Hydrostate"
author = "The Hydrostate authors"
release = tomllib.loads((DOCS.parent / "pyproject.toml").read_text("utf-8"))["project"]["version"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
html_theme = "pydata_sphinx_theme"
html_title = f"Hydrostate {release}"
html_show_sourcelink = False
html_theme_options = {"secondary_sidebar_items": ["page-toc"], "show_prev_next": False, "navbar_center": []}
html_context = {"default_mode": "auto"}  # light or dark as the reader's system has it; empty is an error in the console
html_static_path = ["static"]
html_css_files = ["site.css"]
html_search_scorer = str(DOCS / "static" / "scorer.js")
templates_path = ["templates"]
html_sidebars = {"**": ["contents.html"]}  # the sidebar links every page, under the captions of the index
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
numpydoc_show_class_members = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"


def inherited_from_scikit_learn(_app: Any, _what: str, name: str, *_: Any) -> bool | None:
    """Leave out the setters of metadata that scikit-learn gives every estimator: its own site describes them."""
    return True if name.startswith("set_") and name.endswith("_request") else None


def setup(app: Any) -> None:
    """Write what is made from the code, before anything is read."""
    app.connect("autodoc-skip-member", inherited_from_scikit_learn)
    made = DOCS / "generated"
    made.mkdir(exist_ok=True)
    for name, text in {**api_pages(), "house.svg": house_drawing(), "house.md": house_table()}.items():
        (made / name).write_text(text, encoding="utf-8")
