"""Rules of the architecture: imports point left, filterpy has one importer, files are short, lower layers do not print.

Each guard is a pure function from sources to offences, so tests can also show that it finds an offender.
"""

import ast
import doctest
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("plant", "estimation", "faults", "experiments")
FILTERPY_BRIDGE = "estimation/filters/filterpy_bridge.py"
LONGEST_FILE = 350
ACTUATORS = ("eha", "piezo_stack", "diaphragm_motor")
SHARED = (
    *(f"plant/{room}/" for room in ("compiled", "components", "solvers")),
    *(f"estimation/{room}/" for room in ("engine", "filters")),
    *(f"estimation/{file}" for file in ("fits/greybox", "models/model", "models/greybox", "models/gaussian")),
)
FAULT_NAME = re.compile(r"\b(?:minor|major)[ _-](?:leakage|friction)", re.IGNORECASE)


@dataclass(frozen=True)
class Import:
    """One imported name, dotted and absolute; `eager` if the import runs when its module is loaded."""

    target: str
    line: int
    eager: bool


@dataclass(frozen=True)
class Source:
    """One Python file, by its path relative to the project."""

    path: str
    text: str

    @property
    def layer(self) -> str:
        return self.path.split("/", 1)[0]

    @property
    def module(self) -> str:
        return self.path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text, filename=self.path)

    @cached_property
    def imports(self) -> tuple[Import, ...]:
        return (*_imports_below(self.tree, self, eager=True), *_doctest_imports(self))


def _is_type_checking(test: ast.expr) -> bool:
    return ast.unparse(test) in {"TYPE_CHECKING", "typing.TYPE_CHECKING"}


def _absolute(node: ast.ImportFrom, source: Source) -> str:
    if node.level == 0:
        return node.module or ""
    parents = source.module.split(".")
    if not source.path.endswith("__init__.py"):
        parents = parents[:-1]
    parents = parents[: len(parents) - node.level + 1]
    return ".".join([*parents, *([node.module] if node.module else [])])


def _targets(node: ast.AST, source: Source) -> list[str]:
    match node:
        case ast.Import():
            return [alias.name for alias in node.names]
        case ast.ImportFrom():
            return [f"{_absolute(node, source)}.{alias.name}" for alias in node.names]
        case ast.Call(
            func=ast.Name(id="import_module" | "__import__") | ast.Attribute(attr="import_module"),
            args=[ast.Constant(value=str(name)), *_],
        ):
            return [name]
        case _:
            return []


def _imports_below(node: ast.AST, source: Source, *, eager: bool) -> Iterator[Import]:
    calls = any(name in source.text for name in ("import_module", "__import__"))
    waiting = [(node, eager)]
    while waiting:
        above, at_once = waiting.pop()
        for child in ast.iter_child_nodes(above):
            if isinstance(child, ast.expr) and not calls:
                continue  # most of the tree; only calls among expressions can import
            if isinstance(child, ast.Import | ast.ImportFrom | ast.Call):
                yield from (Import(target, child.lineno, at_once) for target in _targets(child, source))
            if isinstance(child, ast.If) and _is_type_checking(child.test):
                waiting += [(ast.Module(child.orelse, []), at_once), (ast.Module(child.body, []), False)]
            else:
                deferred = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
                waiting.append((child, at_once and not deferred))


def _doctest_imports(source: Source) -> Iterator[Import]:
    for node in ast.walk(source.tree) if ">>>" in source.text else ():
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and ">>>" in node.value:
            for example in doctest.DocTestParser().get_examples(node.value):
                for found in _imports_below(ast.parse(example.source), source, eager=False):
                    yield Import(found.target, node.lineno + example.lineno + found.line - 1, eager=False)


def _below(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


def imports_that_point_right(sources: Sequence[Source]) -> list[str]:
    """Return imports of a higher layer in a lower one, in code, under TYPE_CHECKING, or in a doctest."""
    return [
        f"{source.path}:{found.line}: {source.layer} imports {found.target}, a layer above it"
        for source in sources
        if source.layer in LAYERS
        for found in source.imports
        if found.target.split(".")[0] in LAYERS[LAYERS.index(source.layer) + 1 :]
    ]


def actuators_in_shared_rooms(sources: Sequence[Source]) -> list[str]:
    """Return imports of an actuator, except in doctests, in packages that serve every actuator."""
    return [
        f"{source.path}:{found.line}: imports {found.target}, but serves every actuator"
        for source in sources
        if source.path.startswith(SHARED)
        for found in _imports_below(source.tree, source, eager=True)
        if any(_below(found.target, f"{layer}.{actuator}") for layer in LAYERS for actuator in ACTUATORS)
    ]


def imports_of_the_workshop(sources: Sequence[Source]) -> list[str]:
    """Return imports of tests or benchmarks, which are not installed, in a package."""
    return [
        f"{source.path}:{found.line}: imports {found.target}, which is not installed with the packages"
        for source in sources
        if source.layer in LAYERS
        for found in source.imports
        if _below(found.target, "tests") or _below(found.target, "benchmarks")
    ]


def second_importers_of_filterpy(sources: Sequence[Source]) -> list[str]:
    """Return imports of filterpy outside the bridge."""
    return [
        f"{source.path}:{found.line}: imports {found.target}, which only {FILTERPY_BRIDGE} may"
        for source in sources
        if source.layer in LAYERS and source.path != FILTERPY_BRIDGE
        for found in source.imports
        if _below(found.target, "filterpy")
    ]


def overlong_files(sources: Sequence[Source]) -> list[str]:
    """Return files that are too long and should be split."""
    return [
        f"{source.path}:{LONGEST_FILE + 1}: has {lines} lines, at most {LONGEST_FILE} are wanted"
        for source in sources
        if (lines := len(source.text.splitlines())) > LONGEST_FILE
    ]


def prints_outside_experiments(sources: Sequence[Source]) -> list[str]:
    """Return calls of print below the layer that talks to the user."""
    return [
        f"{source.path}:{node.lineno}: calls print, which only experiments may"
        for source in sources
        if source.layer in LAYERS[:-1] and "print" in source.text
        for node in ast.walk(source.tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print"
    ]


def fault_names_in_estimation(sources: Sequence[Source]) -> list[str]:
    """Return names of faults, in code or words, in the layer that must not know them."""
    return [
        f"{source.path}:{number}: names the fault {found[0]!r}, which estimation must not know"
        for source in sources
        if source.layer == "estimation"
        for number, line in enumerate(source.text.splitlines(), start=1)
        if (found := FAULT_NAME.search(line))
    ]


def import_cycles(sources: Sequence[Source]) -> list[str]:
    """Return modules that need each other while they are being loaded."""
    known = {source.module: source for source in sources}
    edges: dict[str, dict[str, int]] = {module: {} for module in known}
    for module, source in known.items():
        for found in source.imports:
            parts = found.target.split(".")
            prefixes = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
            target = next((prefix for prefix in prefixes if prefix in known), None)
            if found.eager and target is not None and target != module:
                edges[module].setdefault(target, found.line)
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        cycle: list[str] = error.args[1][::-1]
        steps = [f"{known[module].path}:{edges[module][target]} imports {target}" for module, target in pairwise(cycle)]
        return [f"an import cycle: {', '.join(steps)}"]
    return []


def _read(*folders: str) -> list[Source]:
    paths = sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))
    return [Source(path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")) for path in paths]


@pytest.fixture(scope="module")
def packages() -> list[Source]:
    return _read(*LAYERS)


Guard = Callable[[Sequence[Source]], list[str]]

GUARDS: tuple[Guard, ...] = (
    imports_that_point_right,
    actuators_in_shared_rooms,
    imports_of_the_workshop,
    second_importers_of_filterpy,
    import_cycles,
    fault_names_in_estimation,
    prints_outside_experiments,
    overlong_files,
)

OFFENDERS: dict[str, tuple[Guard, str, str, int]] = {
    "right": (imports_that_point_right, "plant/a.py", "\nfrom faults.conditions import CONDITIONS", 2),
    "right, typing": (
        imports_that_point_right,
        "estimation/a.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import experiments.page.folder",
        3,
    ),
    "right, deferred": (imports_that_point_right, "faults/a.py", "def f():\n    import experiments", 2),
    "right, by name": (imports_that_point_right, "plant/a.py", "import_module('faults.eha.bank')", 1),
    "right, doctest": (
        imports_that_point_right,
        "plant/a.py",
        '"""A.\n\n>>> from faults import bank\n"""',
        3,
    ),
    "actuator": (actuators_in_shared_rooms, "plant/solvers/a.py", "def f():\n    from plant.eha import model", 2),
    "workshop": (imports_of_the_workshop, "plant/a.py", "import os\nfrom tests import helpers", 2),
    "filterpy": (second_importers_of_filterpy, "estimation/filters/ekf.py", "from filterpy.kalman import UKF", 1),
    "overlong": (overlong_files, "tests/test_a.py", "x = 1\n" * (LONGEST_FILE + 1), LONGEST_FILE + 1),
    "print": (prints_outside_experiments, "faults/a.py", "def f():\n    print('x')", 2),
    "fault name": (fault_names_in_estimation, "estimation/a.py", "x = 1\nif c == 'minor_leakage': ...", 2),
    "fault word": (fault_names_in_estimation, "estimation/a.py", "# as in major friction", 1),
}

INNOCENTS: dict[str, tuple[Guard, str, str]] = {
    "left": (
        imports_that_point_right,
        "faults/a.py",
        "from plant.log.record import Record\nimport estimation.filters.run",
    ),
    "actuator in its room": (actuators_in_shared_rooms, "estimation/eha/a.py", "from plant.eha.model import A"),
    "own layer": (imports_that_point_right, "plant/a.py", "from plant import units"),
    "alike name": (second_importers_of_filterpy, "estimation/a.py", "import estimation.filters.filterpy_bridge"),
    "bridge": (second_importers_of_filterpy, FILTERPY_BRIDGE, "import filterpy.kalman"),
    "just short enough": (overlong_files, "plant/a.py", "x = 1\n" * LONGEST_FILE),
    "print in experiments": (prints_outside_experiments, "experiments/cli.py", "print('x')"),
    "print in a doctest": (prints_outside_experiments, "plant/a.py", '""">>> print(1)\n1\n"""'),
    "row-major": (fault_names_in_estimation, "estimation/a.py", "x = 'row-major order, minor details'"),
    "fault name in faults": (fault_names_in_estimation, "faults/a.py", "x = 'minor_leakage'"),
}


@pytest.mark.parametrize(("guard", "path", "text", "line"), OFFENDERS.values(), ids=OFFENDERS)
def test_guard_fires_with_file_and_line(guard: Guard, path: str, text: str, line: int) -> None:
    (offence,) = guard([Source(path, text)])
    assert offence.startswith(f"{path}:{line}: ")


@pytest.mark.parametrize(("guard", "path", "text"), INNOCENTS.values(), ids=INNOCENTS)
def test_guard_leaves_the_innocent_alone(guard: Guard, path: str, text: str) -> None:
    assert guard([Source(path, text)]) == []


def test_cycle_guard_fires_with_every_step() -> None:
    ring = [
        Source("plant/a.py", "import numpy\nfrom plant.b import f"),
        Source("plant/b.py", "from plant import c"),
        Source("plant/c.py", "\n\nfrom . import a"),
    ]
    (offence,) = import_cycles(ring)
    for step in (
        "plant/a.py:2 imports plant.b",
        "plant/b.py:1 imports plant.c",
        "plant/c.py:3 imports plant.a",
    ):
        assert step in offence


@pytest.mark.parametrize("deferred", ["def f():\n    import plant.b", "if TYPE_CHECKING:\n    import plant.b"])
def test_cycle_guard_allows_imports_that_wait(deferred: str) -> None:
    assert import_cycles([Source("plant/a.py", deferred), Source("plant/b.py", "import plant.a")]) == []


def test_the_walk_finds_the_packages(packages: list[Source]) -> None:
    modules = {source.module for source in packages}
    assert {"plant", "plant.units", "plant.log.record"} <= modules
    assert {source.layer for source in packages} == set(LAYERS)


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.__name__)
def test_the_packages_have_no_offences(guard: Guard, packages: list[Source]) -> None:
    offences = guard(packages)
    assert not offences, "\n".join(offences)


def test_files_of_tests_and_benchmarks_keep_the_length_limit_of_the_packages() -> None:
    offences = overlong_files(_read("tests", "benchmarks"))
    assert not offences, "\n".join(offences)


@pytest.mark.parametrize("operation", [np.divide, np.power], ids=["zero by zero", "overflow"])
def test_floating_point_faults_raise_in_tests(operation: np.ufunc) -> None:
    values = (0.0, 0.0) if operation is np.divide else (1e200, 2.0)
    with pytest.raises(FloatingPointError):
        operation(np.array([values[0]]), values[1])
