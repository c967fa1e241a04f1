"""Regression tests on numbers: the results of an engine for a small fixed input are kept in a readable file.

Astronomical and chemical codes are tested against reference values, and so is this one. A module ``test_numbers.py``
defines cases, and ``numbers.json`` beside it keeps their results (``test_numbers_flow.py``: ``numbers_flow.json``). A
kept number only shows that nothing moved. If a formula has a property that can be tested, test that property instead.

`python -m tests.numbers` prints the numbers that moved, in all folders or only in the named ones; with ``--write`` it
keeps the new numbers. Read what moved before you keep it: users may see each of these numbers move.
"""

import argparse
import importlib.util
import json
import math
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from plant.errors import HydrostateError
from plant.notes import Note

ROOT = Path(__file__).resolve().parents[1]

FORMULA = 1e-6
"""Relative change allowed for the result of a formula [fraction]: other processors round differently."""

ROUNDING = 1e-12
"""Change allowed for a number in a list, relative to the largest in the list [fraction]: larger numbers may have
cancelled."""

WITHIN, WIDTH = 0.03, 0.01
"""Change allowed for the result of a search, relative to its standard deviation, and relative change allowed for that
deviation [fraction]."""

KEPT_DIGITS = 10


@dataclass(frozen=True)
class Found:
    """The result of a search: a value and its standard deviation.

    Parameters
    ----------
    value, std : float
        Both in the same unit.
    """

    value: float
    std: float


@dataclass(frozen=True)
class Roughly:
    """A number that differs between processors, such as the function calls of a search, or its end along a flat valley.

    Parameters
    ----------
    value : float
        In any unit.
    share : float
        Relative change allowed [fraction].
    """

    value: float
    share: float


Case = Callable[[], Mapping[str, Any]]


class Numbers:
    """The cases of one module, and the file with their results.

    Parameters
    ----------
    module : str
        The module's ``__file__``.
    """

    def __init__(self, module: str) -> None:
        self.file = Path(module).with_name(Path(module).stem.removeprefix("test_") + ".json")
        self.made: dict[str, tuple[Case, float]] = {}

    @property
    def cases(self) -> list[str]:
        """Names of the cases."""
        return list(self.made)

    def case(self, relative: float = FORMULA) -> Callable[[Case], Case]:
        """Return a decorator that adds a case under the name of its function.

        Parameters
        ----------
        relative : float
            Relative change allowed for its numbers [fraction].
        """

        def added(function: Case) -> Case:
            self.made[function.__name__.strip("_").replace("_", " ")] = function, relative
            return function

        return added

    def found(self, name: str) -> dict[str, Any]:
        """Return the present result of a case, in the form of the file."""
        return _plain(self.made[name][0]())

    def kept(self) -> dict[str, Any]:
        """Return the contents of the file."""
        return json.loads(self.file.read_text("utf-8")) if self.file.exists() else {}

    def moved(self, name: str) -> list[str]:
        """Return one line for each number of a case that moved, appeared or disappeared."""
        return list(_moved(name, self.kept().get(name, {}), self.found(name), self.made[name][1]))

    def check(self, name: str) -> None:
        """Fail if a number of a case moved, appeared or disappeared."""
        moved = self.moved(name)
        assert not moved, "see `python -m tests.numbers`:\n" + "\n".join(moved)

    def write(self) -> None:
        """Keep the present results of all cases."""
        kept = {name: self.found(name) for name in self.made}
        self.file.write_text(_lines(kept) + "\n", "utf-8")


def some(values: Any, count: int = 5) -> list[Any]:
    """Return a few values of an array, including both ends, and the root mean square of all, so that any change shows.

    Parameters
    ----------
    values : array_like
        Real or complex [any unit].
    count : int
        Number of values, evenly spaced.

    Examples
    --------
    >>> some([3.0, 4.0], 2)
    [3.0, 4.0, 3.5355339059327378]
    """
    flat = np.ravel(np.asarray(values))
    if flat.size == 0:
        return []
    picked = flat[np.unique(np.linspace(0, flat.size - 1, count).astype(int))]
    return [*picked.tolist(), float(np.sqrt(np.nanmean(np.abs(flat) ** 2)))]


def refused(call: Callable[[], Any]) -> str | None:
    """Return why a call is refused; None if it is not.

    Parameters
    ----------
    call : callable
        The function to try.
    """
    try:
        call()
    except HydrostateError as error:
        return error.message
    return None


def or_refused(call: Callable[[], Any]) -> Any:
    """Return the result of a call, or the type of its error and the beginning of the message.

    Parameters
    ----------
    call : callable
        The function to try.
    """
    try:
        return call()
    except ValueError as error:  # our errors are among them
        return f"{type(error).__name__}: {str(error)[:90]}"


def told(notes: Iterable[Note]) -> list[dict[str, Any]]:
    """Return the codes and data of notes.

    Parameters
    ----------
    notes : iterable of Note
        The notes.
    """
    return [{"code": str(one.code), **one.data} for one in notes]


def warned(call: Callable[[], Any]) -> list[str]:
    """Return the warnings of a call; one that points to a file other than the caller's includes that file's name.

    Parameters
    ----------
    call : callable
        The function to try: one defined in the calling test, or the tested callable with its arguments.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    asked = call.__code__.co_filename if isinstance(call, FunctionType) else __file__
    return [
        str(one.message) if one.filename == asked else f"{one.message} (in {Path(one.filename).name})" for one in caught
    ]


def _plain(value: Any) -> Any:
    """Return a value as JSON can hold it: numbers with `KEPT_DIGITS` digits, or as text if they are not finite."""
    match value:
        case Found(value=middle, std=std):
            return {"value": _plain(middle), "std": _plain(std)}
        case Roughly(value=middle, share=share):
            return {"value": _plain(middle), "within": share}
        case Mapping():
            return {str(name): _plain(one) for name, one in value.items()}
        case bool() | np.bool_():
            return bool(value)
        case int() | np.integer():
            return int(value)
        case float() | np.floating():
            return float(f"{value:.{KEPT_DIGITS}g}") if math.isfinite(value) else str(float(value))
        case complex() | np.complexfloating():
            return [_plain(float(value.real)), _plain(float(value.imag))]
        case np.ndarray() if value.ndim == 0:
            return _plain(value.item())
        case np.ndarray() | list() | tuple():
            return [_plain(one) for one in value]
        case None | str():
            return value
        case _:
            raise TypeError(f"a kept number is a number, text, list or mapping, got {value!r}")


def _moved(name: str, kept: Any, found: Any, relative: float) -> Iterator[str]:
    if isinstance(kept, dict) and isinstance(found, dict):
        if set(found) == {"value", "std"} == set(kept):
            yield from _search_moved(name, kept, found)
            return
        if set(found) == {"value", "within"} == set(kept):
            yield from _moved(name, float(kept["value"]), found["value"], found["within"])
            return
        for key in dict.fromkeys([*kept, *found]):
            yield from _moved(f"{name}: {key}", kept.get(key, "nothing"), found.get(key, "nothing"), relative)
    elif isinstance(kept, list) and isinstance(found, list) and len(kept) == len(found):
        size = max((abs(one) for one in kept if _is_number(one)), default=0.0)
        pairs: list[tuple[Any, Any]] = list(zip(kept, found, strict=True))
        for i, (old, new) in enumerate(pairs):
            if not (_is_number(old) and _is_number(new) and abs(new - old) <= ROUNDING * size):
                yield from _moved(f"{name} [{i}]", old, new, relative)
    elif isinstance(kept, float) and _is_number(found):
        if not abs(found - kept) <= relative * abs(kept):
            yield f"{name}: {kept!r} -> {found!r}"
    elif kept != found or isinstance(kept, bool) != isinstance(found, bool):
        yield f"{name}: {kept!r} -> {found!r}"


def _search_moved(name: str, kept: Mapping[str, Any], found: Mapping[str, Any]) -> Iterator[str]:
    if not (_is_number(kept["std"]) and _is_number(found["std"])):
        if kept["std"] != found["std"]:  # without one the value may be anything
            yield f"{name}, deviation: {kept['std']!r} -> {found['std']!r}"
    elif not (_is_number(kept["value"]) and _is_number(found["value"])):
        if kept["value"] != found["value"]:  # one of them is not finite
            yield f"{name}: {kept['value']!r} -> {found['value']!r}"
    elif abs(found["value"] - kept["value"]) > WITHIN * kept["std"] + FORMULA * abs(kept["value"]):
        yield f"{name}: {kept['value']!r} -> {found['value']!r}, deviation {kept['std']!r}"
    elif abs(found["std"] - kept["std"]) > WIDTH * kept["std"]:
        yield f"{name}, deviation: {kept['std']!r} -> {found['std']!r}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _lines(value: Any, indent: str = "") -> str:
    """Return JSON text with one number or list of numbers per line."""
    if isinstance(value, dict) and set(value) not in ({"value", "std"}, {"value", "within"}):
        inner = indent + "  "
        entries = [
            f"{inner}{json.dumps(name, ensure_ascii=False)}: {_lines(one, inner)}" for name, one in value.items()
        ]
        return "{\n" + ",\n".join(entries) + f"\n{indent}}}" if entries else "{}"
    return json.dumps(value, ensure_ascii=False)


def modules(folders: Sequence[str]) -> list[Numbers]:
    """Return the cases of all modules in some folders of tests.

    Parameters
    ----------
    folders : sequence of str
        Relative to the project's folder.
    """
    files = sorted({file for folder in folders for file in (ROOT / folder).rglob("test_numbers*.py")})
    return [_imported(file).NUMBERS for file in files]


def _imported(file: Path) -> Any:
    name = "kept_" + "_".join(file.relative_to(ROOT).with_suffix("").parts)  # differs from pytest's name for it
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def main(arguments: Sequence[str]) -> int:
    """Print what moved, or keep it; return 1 if something moved and was not kept."""
    parser = argparse.ArgumentParser(prog="python -m tests.numbers", description=__doc__)
    parser.add_argument("folders", nargs="*", default=["tests"], help="folders of tests; all if none is named")
    parser.add_argument("--write", action="store_true", help="keep what is found")
    given = parser.parse_args(arguments)
    for folder in given.folders:
        if not any((ROOT / folder).rglob("test_numbers*.py")):
            parser.error(
                f"no numbers are kept under {folder}: name it from the project's folder, tests/estimation/trust"
            )
    moved: list[str] = []
    for numbers in modules(given.folders):
        place = str(numbers.file.parent.relative_to(ROOT))
        lines = [line for name in numbers.cases for line in numbers.moved(name)]
        lines += [f"{name}: no longer made" for name in numbers.kept() if name not in numbers.made]
        moved += [f"{place}: {line}" for line in lines]
        if given.write:
            numbers.write()
    sys.stdout.write("\n".join(moved or ["nothing moved"]) + "\n")
    return int(bool(moved) and not given.write)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
