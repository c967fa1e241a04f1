"""Pages that are written from the code: the API of the faces, and a drawing of the house from its imports."""

import ast
import importlib
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("plant", "estimation", "faults", "experiments")
FACES = ("hydrostate", *LAYERS)


@dataclass(frozen=True)
class House:
    """Rooms of the packages with what is in them, and who imports whom."""

    rooms: Mapping[str, tuple[int, int]]
    imports: Mapping[tuple[str, str], int]


def room_of(path: Path) -> str:
    """Return the room of a file: package and folder, or the package alone."""
    parts = path.relative_to(ROOT).parts
    return ".".join(parts[:2]) if len(parts) > 2 else parts[0]


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield statements, the outer ones first: an import is one, and most of a tree are expressions."""
    waiting = deque[ast.AST]([tree])
    while waiting:
        above = waiting.popleft()
        for part in ("body", "handlers", "orelse", "finalbody", "cases"):
            below = getattr(above, part, [])
            waiting.extend(below)
            yield from below


@cache
def house() -> House:
    """Read all packages: files and lines of each room, and imports between rooms."""
    files = {path: path.read_text("utf-8") for layer in LAYERS for path in sorted((ROOT / layer).rglob("*.py"))}
    counts, lines, imports = Counter[str](), Counter[str](), Counter[tuple[str, str]]()
    for path, text in files.items():
        room = room_of(path)
        counts[room] += 1
        lines[room] += text.count("\n")
        for node in _statements(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] in LAYERS:
                parts = node.module.split(".")
                used = ".".join(parts[:2]) if (ROOT / Path(*parts[:2])).is_dir() else parts[0]
                imports[room, used] += used != room
    return House({room: (counts[room], lines[room]) for room in counts}, {pair: n for pair, n in imports.items() if n})


WIDE, ROW, GAP, TOP = 200, 22, 90, 70
"""Width of a column, height of a room, space between columns, and where rooms begin [px]."""


def house_drawing() -> str:
    """Return the drawing: a column a package, its rooms as boxes, imports between packages as arrows, as SVG."""
    found = house()
    columns = {layer: sorted(room for room in found.rooms if room.split(".")[0] == layer) for layer in LAYERS}
    place = {layer: 20 + i * (WIDE + GAP) for i, layer in enumerate(LAYERS)}
    height = TOP + ROW * max(len(rooms) for rooms in columns.values()) + 20
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {place["experiments"] + WIDE + 20} {height + 120}" '
        'font-family="sans-serif" font-size="12" role="img" aria-label="Packages, their rooms, and who imports whom">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for layer, rooms in columns.items():
        x = place[layer]
        parts.append(
            f'<rect x="{x}" y="20" width="{WIDE}" height="{height - 20}" rx="8" fill="#eef3f8" stroke="#456"/>'
        )
        parts.append(f'<text x="{x + 12}" y="46" font-size="17" font-weight="bold">{layer}</text>')
        for i, room in enumerate(rooms):
            files, _ = found.rooms[room]
            name = room.partition(".")[2] or "(the package itself)"
            y = TOP + ROW * i
            parts.append(
                f'<rect x="{x + 8}" y="{y}" width="{WIDE - 16}" height="{ROW - 4}" fill="white" stroke="#abc"/>'
            )
            parts.append(f'<text x="{x + 14}" y="{y + 13}">{escape(name)}</text>')
            parts.append(f'<text x="{x + WIDE - 14}" y="{y + 13}" text-anchor="end" fill="#567">{files} files</text>')
    parts += _arrows(found, place, height)
    return "\n".join([*parts, "</svg>", ""])


def _arrows(found: House, place: Mapping[str, int], height: int) -> list[str]:
    """Return the arrows between packages, deeper the farther they reach."""
    between = Counter[tuple[str, str]]()
    for (user, used), count in found.imports.items():
        between[user.split(".")[0], used.split(".")[0]] += count
    parts: list[str] = []
    for (user, used), count in sorted(between.items()):
        if user == used:
            continue
        start, end = place[user] + WIDE / 2, place[used] + WIDE / 2
        depth = height + 6 + 42 * abs(LAYERS.index(user) - LAYERS.index(used))
        parts.append(
            f'<path d="M{start} {height} C{start} {depth} {end} {depth} {end} {height}" fill="none" stroke="#c60"/>'
            f'<path d="M{end} {height} l-4 9 h8 z" fill="#c60"/>'
            f'<text x="{(start + end) / 2}" y="{(height + 3 * depth) / 4 + 12}" text-anchor="middle">{count} imports'
            "</text>"
        )
    return parts


def house_table() -> str:
    """Return the rooms as a table: files, lines, and the rooms that each imports, as Markdown."""
    found = house()
    rows = [
        f"| `{room}` | {files} | {lines} | "
        + (", ".join(f"`{used}`" for user, used in sorted(found.imports) if user == room) or "-")
        + " |"
        for room, (files, lines) in sorted(found.rooms.items(), key=lambda item: LAYERS.index(item[0].split(".")[0]))
    ]
    return "\n".join(
        [
            "---\norphan: true\n---\n\n# Rooms\n",
            "| room | files | lines | imports |",
            "|---|---|---|---|",
            *rows,
            "",
        ]
    )


def api_pages() -> dict[str, str]:
    """Return a page a face: every name of its ``__all__``, documented where it is defined, as reStructuredText."""
    shown: set[str] = set()
    pages = {face: _face(face, shown) for face in (*LAYERS, FACES[0])}
    return {f"api_{face}.rst": page for face, page in pages.items()}


def _face(face: str, shown: set[str]) -> str:
    """Return the page of a face; what another page has in its index is not put there again."""
    module = importlib.import_module(face)
    homes = _homes(module.__file__ or "")
    lines = [face, "=" * len(face), "", f".. automodule:: {face}", "   :no-members:", ""]
    for name in sorted(module.__all__, key=str.lower):
        if name.startswith("_"):
            continue
        thing = getattr(module, name)
        home = homes.get(name, f"{face}.{name}")
        if callable(thing):
            home = f"{thing.__module__}.{thing.__qualname__}"
        kind = "class" if isinstance(thing, type) else "function" if callable(thing) else "data"
        again = ["   :no-index:"] if home in shown else []
        lines += [name, "-" * len(name), "", f".. auto{kind}:: {home}", *_options(kind), *again, ""]
        shown.add(home)
    return "\n".join(lines)


def _options(kind: str) -> list[str]:
    return {"class": ["   :members:"], "data": ["   :no-value:"], "function": []}[kind]


def _homes(path: str) -> dict[str, str]:
    """Return where the names that a face imports are defined."""
    return {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in ast.walk(ast.parse(Path(path).read_text("utf-8")))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
