"""Which tests can notice a fault at a line, from the data that `make coverage` recorded.

A line of a function is executed by the tests that coverage.py names. Coverage does not see code that runs only once
(constants, defaults, cached results) or compiled (loops pasted into kernels). So the next candidates are the mirrored
folder's kept numbers, the tests that execute functions that use the name, the rest of the file, and the mirrored
folder's tests.
"""

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from benchmarks.mutants.mutation import mirrored_tests

PACKAGES = ("plant", "estimation", "faults", "experiments")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


class Executed:
    """Tests by the lines that they execute.

    Parameters
    ----------
    root : Path
        The project.
    data : Path
        Output of coverage.py, with one context for each test.
    """

    def __init__(self, root: Path, data: Path) -> None:
        self.root = root
        self.measured = data.stat().st_mtime
        self._data = CoverageData(basename=str(data))
        self._data.read()
        self._files = {_from_package(file): file for file in self._data.measured_files()}
        self._by_line: dict[str, Mapping[int, set[str]]] = {}
        self._cost: dict[str, int] = defaultdict(int)
        for path in list(self._files):
            if not (root / path).is_file():
                del self._files[path]
                continue
            for tests in self.of_file(path).values():
                for test in tests:
                    self._cost[test] += 1

    def of_file(self, path: str) -> Mapping[int, set[str]]:
        """Return tests by line; empty for a file edited since, because its lines have moved."""
        if path not in self._by_line:
            stands = path in self._files and (self.root / path).stat().st_mtime <= self.measured
            found = self._data.contexts_by_lineno(self._files[path]) if stands else {}
            self._by_line[path] = {line: {_test(one) for one in tests if one} for line, tests in found.items()}
        return self._by_line[path]

    @cached_property
    def all_tests(self) -> Mapping[str, list[str]]:
        """Tests by their file."""
        found: dict[str, list[str]] = defaultdict(list)
        for test in self._cost:
            found[test.partition("::")[0]].append(test)
        return found

    @cached_property
    def trees(self) -> Mapping[str, ast.Module]:
        """The packages' files, parsed."""
        files = [file for package in PACKAGES for file in (self.root / package).rglob("*.py")]
        return {str(file.relative_to(self.root)): ast.parse(file.read_text(encoding="utf-8")) for file in files}

    @cached_property
    def _uses(self) -> Mapping[str, list[tuple[str, ast.stmt]]]:
        """Where each name is read: functions, or statements of a module or class."""
        found: dict[str, list[tuple[str, ast.stmt]]] = defaultdict(list)
        for path, tree in self.trees.items():
            for place in _code_places(tree):
                for name in _names(place):
                    found[name].append((path, place))
        return found

    def tests(self, path: str, line: int) -> list[str]:
        """Return the tests that can notice a fault at a line, with the most likely and fastest first.

        Parameters
        ----------
        path : str
            File, relative to the project's folder.
        line : int
            Line of the fault.

        Returns
        -------
        list of str
            Names of tests. Within a group, tests that execute the fewest lines come first.
        """
        near = mirrored_tests(self.root, path)
        groups = [self._tests_at(path, line), self._kept_numbers(near), *self._further_tests(path, line)]
        groups.append({test for file, tests in self.all_tests.items() if file.startswith(near[-1]) for test in tests})
        ordered: dict[str, None] = {}
        for group in groups:
            ordered |= dict.fromkeys(
                sorted(group, key=lambda test: (_test_distance(test, near), self._cost[test], test))
            )
        return [test for test in ordered if (self.root / test.partition("::")[0]).is_file()]

    def _kept_numbers(self, near: Sequence[str]) -> set[str]:
        """Return the kept numbers of the mirrored folder, which take seconds and cover constants."""
        return {test for file in near if "test_numbers" in file for test in self.all_tests.get(file, ())}

    def _tests_at(self, path: str, line: int) -> set[str]:
        statement = _innermost(self.trees[path], line)
        end = min([one.lineno - 1 for one in _body(statement)], default=statement.end_lineno or line)
        at = self.of_file(path)
        return set().union(*(at.get(one, set()) for one in range(statement.lineno, max(end, line) + 1)))

    def _further_tests(self, path: str, line: int) -> Iterator[set[str]]:
        """Yield tests of code that uses the name defined on the line, and of the rest of the file."""
        place = next((one for one in _code_places(self.trees[path]) if _spans_line(one, line)), None)
        names = _defined_names(place) if place is not None else set()
        seen = set(names)
        users = self._tests_within(path, place) if isinstance(place, FUNCTIONS) else set[str]()
        while names:
            more: set[str] = set()
            for name in names:
                for file, use in self._uses.get(name, ()):
                    if isinstance(use, FUNCTIONS):
                        users |= self._tests_within(file, use)
                    else:
                        more |= _defined_names(use)
            names = more - seen
            seen |= names
        yield users
        yield set().union(
            *(self._tests_within(path, one) for one in _code_places(self.trees[path]) if isinstance(one, FUNCTIONS))
        )

    def _tests_within(self, path: str, function: ast.stmt) -> set[str]:
        first = min((one.lineno for one in _body(function)), default=function.lineno)
        at = self.of_file(path)
        return set().union(*(at.get(one, set()) for one in range(first, (function.end_lineno or first) + 1)))


def _from_package(file: str) -> str:
    parts = Path(file).parts
    first = next((i for i, part in enumerate(parts) if part in PACKAGES), 0)
    return "/".join(parts[first:])


def _test(context: str) -> str:
    return context.rpartition("|")[0] or context


def _test_distance(test: str, near: Sequence[str]) -> int:
    """Return the distance of a test from a file: its own and its folder's kept numbers, its folder's, all others.

    The first two rank equally: a quick test among them comes before kept numbers of a whole search.
    """
    place = next((i for i, place in enumerate(near) if test.startswith(place)), len(near))
    return max(place - (len(near) - 2), 0)


def _body(statement: ast.stmt) -> list[ast.stmt]:
    handlers = [one for handler in getattr(statement, "handlers", []) for one in handler.body]
    cases = [one for case in getattr(statement, "cases", []) for one in case.body]
    return [*getattr(statement, "body", []), *handlers, *cases]


def _spans_line(statement: ast.stmt, line: int) -> bool:
    decorators = getattr(statement, "decorator_list", [])
    first = min([statement.lineno, *(one.lineno for one in decorators)])
    return first <= line <= (statement.end_lineno or first)


def _innermost(tree: ast.Module, line: int) -> ast.stmt:
    found = [one for one in ast.walk(tree) if isinstance(one, ast.stmt) and _spans_line(one, line)]
    return min(found, key=lambda one: (one.end_lineno or one.lineno) - one.lineno)


def _code_places(tree: ast.Module | ast.ClassDef) -> Iterator[ast.stmt]:
    """Yield functions, methods, and statements of modules and classes."""
    for one in tree.body:
        if isinstance(one, ast.ClassDef):
            yield from _code_places(one)
        else:
            yield one


def _defined_names(place: ast.stmt) -> set[str]:
    if isinstance(place, FUNCTIONS):
        return {place.name}
    targets: Iterable[ast.AST] = (
        place.targets if isinstance(place, ast.Assign) else [place.target] if isinstance(place, ast.AnnAssign) else []
    )
    return {one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)}


def _names(place: ast.stmt) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(place):
        match node:
            case ast.Name(id=name, ctx=ast.Load()) | ast.Attribute(attr=name) | ast.keyword(arg=str(name)):
                found.add(name)
            case _:
                pass
    return found
