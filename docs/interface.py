"""Writes docs/interface.json: the names that a user's program may rest on (CONTRIBUTING.md has the rule).

Run it as ``python docs/interface.py`` when a version is released. A test holds that nothing listed is missing.
"""

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import typer.main  # noqa: E402 -- of this tree, not of an installed one

from experiments.cli import app  # noqa: E402
from experiments.eha.entries import NO_DIAGNOSIS, NO_ESTIMATE  # noqa: E402

PAGE = ROOT / "docs" / "interface.json"
FACES = ("hydrostate", "plant", "estimation", "faults", "experiments")


def interface() -> dict[str, dict[str, list[str]]]:
    """Return names of the faces, keys of ``--json`` by verb, options by verb."""
    return {
        "faces": {name: sorted(importlib.import_module(name).__all__) for name in FACES},
        "json": {"estimate": sorted(NO_ESTIMATE), "diagnose": sorted(NO_DIAGNOSIS)},
        "options": dict(_verbs(typer.main.get_command(app))),
    }


def _verbs(command: Any, before: str = "") -> Iterator[tuple[str, list[str]]]:
    for name, one in sorted(command.commands.items()):
        if hasattr(one, "commands"):
            yield from _verbs(one, f"{before}{name} ")
        else:
            yield before + name, sorted(option for p in one.params for option in p.opts if option.startswith("--"))


def page() -> str:
    """Return the page: one line an entry."""
    parts = [
        f' "{part}": {{\n'
        + ",\n".join(f"  {json.dumps(key)}: {json.dumps(names)}" for key, names in entries.items())
        + "\n }"
        for part, entries in interface().items()
    ]
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    sys.stdout.write(f"wrote {PAGE}\n")
