"""Writes docs/notes.md: every code that a note may carry, its sentence, and the files that raise it.

Run it as ``python docs/notes.py`` after a code was added, reworded or moved.
"""

import ast
import importlib
import pkgutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Formatter

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from plant.notes import Code  # noqa: E402 -- of this tree, not of an installed one

PACKAGES = ("plant", "estimation", "faults", "experiments")

HEAD = """# Notes

Every result has a list of notes beside its numbers: `notes` in the JSON, `found.all_notes` in Python. Each note has a
`code`, `data` (in SI unless the sentence says otherwise), and `text`, the sentence made from them. Programs should
decide by code and data: any version may change a sentence. A field such as `{drop_pa:.2g|bar}` is shown in bar; its
data are in SI. `python docs/notes.py` writes this page.
"""


@dataclass(frozen=True)
class Site:
    """A place at which a note is made: file and line, codes that it may have, and the fields that it is given."""

    path: str
    line: int
    codes: tuple[str, ...]
    fields: frozenset[str]


def enums() -> list[type[Code]]:
    """Return every enum of codes that the packages define, by module."""
    for package in PACKAGES:
        for found in pkgutil.walk_packages(importlib.import_module(package).__path__, f"{package}."):
            if not found.name.endswith("__main__"):
                importlib.import_module(found.name)
    found = [enum for enum in dict.fromkeys(_below(Code)) if enum.__module__.split(".")[0] in PACKAGES]
    return sorted(found, key=lambda enum: (PACKAGES.index(enum.__module__.split(".")[0]), enum.__module__))


def _below(kind: type[Code]) -> Iterator[type[Code]]:
    for enum in kind.__subclasses__():
        if getattr(sys.modules.get(enum.__module__), enum.__name__, None) is enum:  # otherwise a docstring's example
            yield enum
        yield from _below(enum)


def fields_of(template: str) -> frozenset[str]:
    """Return the names of the fields of a template."""
    return frozenset(name for _, name, _, _ in Formatter().parse(template) if name)


def sites(enums: Mapping[str, type[Code]]) -> Iterator[Site]:
    """Find every place in the packages that makes a note, as ``Enum.MEMBER.note(field=...)`` or by a name for it."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            text = path.read_text(encoding="utf-8")
            if ".note(" in text:
                yield from sites_in(path.relative_to(ROOT).as_posix(), text, enums)


def sites_in(path: str, text: str, enums: Mapping[str, type[Code]]) -> Iterator[Site]:
    """Find the same in one file."""
    tree = ast.parse(text, filename=path)
    names = {
        target.id: node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    }
    returns = {
        function.name: node.value
        for function in ast.walk(tree)
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Dict)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "note":
            codes = tuple(_members(node.func.value, names, enums))
            if codes:
                yield Site(path, node.lineno, codes, frozenset(_given(node, names | returns)))


def _members(node: ast.expr, names: Mapping[str, ast.expr], enums: Mapping[str, type[Code]]) -> Iterator[str]:
    """Yield the codes that an expression may be."""
    match node:
        case ast.Attribute(value=ast.Name(id=enum), attr=member) if enum in enums and member in enums[enum].__members__:
            yield f"{enum}.{member}"
        case ast.IfExp(body=one, orelse=other):
            yield from _members(one, names, enums)
            yield from _members(other, names, enums)
        case ast.Name(id=name) if name in names and not isinstance(names[name], ast.Name):
            yield from _members(names[name], names, enums)


def _given(call: ast.Call, dictionaries: Mapping[str, ast.expr]) -> Iterator[str]:
    """Yield the fields that a note is given, those of ``**`` too where a literal or a function of the file has them."""
    for keyword in call.keywords:
        if keyword.arg is not None:
            yield keyword.arg
            continue
        source = keyword.value.func if isinstance(keyword.value, ast.Call) else keyword.value
        literal = dictionaries.get(ast.unparse(source))
        if not isinstance(literal, ast.Dict):
            raise ValueError(f"line {call.lineno}: what ** gives to a note cannot be read off the file")
        yield from (str(key.value) for key in literal.keys if isinstance(key, ast.Constant))


def page() -> str:
    """Return the text of docs/notes.md."""
    known = enums()
    raised: dict[str, set[str]] = {}
    for site in sites({enum.__name__: enum for enum in known}):
        for code in site.codes:
            raised.setdefault(code, set()).add(site.path)
    parts = [HEAD]
    for enum in known:
        said = " ".join((enum.__doc__ or "").split("\n\n")[0].split())
        parts += [
            f"## `{enum.__module__}.{enum.__name__}`\n",
            f"{said}\n",
            "| code | sentence | raised in |",
            "|---|---|---|",
        ]
        for name, member in enum.__members__.items():
            where = ", ".join(f"`{path}`" for path in sorted(raised.get(f"{enum.__name__}.{name}", ())))
            said = member.template.replace("|", r"\|").replace("!w}", "}")
            parts.append(f"| `{member}` | {said} | {where} |")
        parts.append("")
    return "\n".join(parts)


if __name__ == "__main__":
    (ROOT / "docs" / "notes.md").write_text(page(), encoding="utf-8")
