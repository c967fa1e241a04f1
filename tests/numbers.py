"""Numbers that stand: what an engine makes of a small fixed input, kept in a file that a person can read.

Codes of astronomers and chemists are tested against reference values; so is this one. A module ``test_numbers.py``
names its cases, and ``numbers.json`` beside it keeps what they gave (``test_numbers_flow.py``: ``numbers_flow.json``).
A number says no more than that nothing moved: where a formula has a claim that can be tested, test the claim.

`python -m tests.numbers` prints what moved, all of it or only that of the folders named; ``--write`` keeps what is
found instead. Read what moved before you keep it: each line is a number that a user may see move.
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
"""How far a number may move that a formula gives, over its size [fraction]: other processors round otherwise."""

ROUNDING = 1e-12
"""How far a number in a list may move, over the largest of the list: what is left of larger ones [fraction]."""

WITHIN, WIDTH = 0.03, 0.01
"""How far the end of a search may move, over its deviation, and how far the deviation may, over itself [fraction]."""

KEPT_DIGITS = 10


@dataclass(frozen=True)
class Found:
    """The end of a search: a value, and the deviation that says how well it is known.

    Parameters
    ----------
    value, std : float
        In one unit.
    """

    value: float
    std: float


@dataclass(frozen=True)
class Roughly:
    """A number that other processors move: how often a search asks, the end of one along a valley.

    Parameters
    ----------
    value : float
        In any unit.
    share : float
        How far it may move, over its size [fraction].
    """

    value: float
    share: float


Case = Callable[[], Mapping[str, Any]]


class Numbers:
    """The cases of one module, and the file of what they gave.

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
        """What the cases are called."""
        return list(self.made)

    def case(self, relative: float = FORMULA) -> Callable[[Case], Case]:
        """Return a decorator that adds a case under the name of its function.

        Parameters
        ----------
        relative : float
            How far its numbers may move, over their size [fraction].
        """

        def added(function: Case) -> Case:
            self.made[function.__name__.strip("_").replace("_", " ")] = function, relative
            return function

        return added

    def found(self, name: str) -> dict[str, Any]:
        """Return what a case gives now, as the file keeps it."""
        return _plain(self.made[name][0]())

    def kept(self) -> dict[str, Any]:
        """Return what the file keeps."""
        return json.loads(self.file.read_text("utf-8")) if self.file.exists() else {}

    def moved(self, name: str) -> list[str]:
        """Return a line for each number of a case that moved, came or went."""
        return list(_moved(name, self.kept().get(name, {}), self.found(name), self.made[name][1]))

    def check(self, name: str) -> None:
        """Fail if a number of a case moved, came or went."""
        moved = self.moved(name)
        assert not moved, "see `python -m tests.numbers`:\n" + "\n".join(moved)

    def write(self) -> None:
        """Keep what all cases give now."""
        kept = {name: self.found(name) for name in self.made}
        self.file.write_text(_lines(kept) + "\n", "utf-8")


def some(values: Any, count: int = 5) -> list[Any]:
    """Return so many values of an array, both ends among them, and the root mean square of all, which any moves.

    Parameters
    ----------
    values : array_like
        Real or complex [any unit].
    count : int
        How many are picked, evenly spaced.

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
    """Return why a call is refused, None where it is not.

    Parameters
    ----------
    call : callable
        What is tried.
    """
    try:
        call()
    except HydrostateError as error:
        return error.message
    return None


def or_refused(call: Callable[[], Any]) -> Any:
    """Return what is made, or the kind of error and the beginning of its sentence.

    Parameters
    ----------
    call : callable
        What is tried.
    """
    try:
        return call()
    except ValueError as error:  # ours are among them
        return f"{type(error).__name__}: {str(error)[:90]}"


def told(notes: Iterable[Note]) -> list[dict[str, Any]]:
    """Return codes and data of notes.

    Parameters
    ----------
    notes : iterable of Note
        What was said.
    """
    return [{"code": str(one.code), **one.data} for one in notes]


def warned(call: Callable[[], Any]) -> list[str]:
    """Return the sentences that a call warns with, and the file that they name where it is not the one that asked.

    Parameters
    ----------
    call : callable
        What is tried: a function of a test that asks, or what is asked itself with its arguments.
    """
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    asked = call.__code__.co_filename if isinstance(call, FunctionType) else __file__
    return [
        str(one.message) if one.filename == asked else f"{one.message} (in {Path(one.filename).name})" for one in caught
    ]


def _plain(value: Any) -> Any:
    """Return what JSON can hold: numbers with `KEPT_DIGITS` digits, or names of those that are not finite."""
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
        if kept["std"] != found["std"]:  # nothing is known of the value, and it may end anywhere
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
    """Return JSON with a line a number or a list of numbers."""
    if isinstance(value, dict) and set(value) not in ({"value", "std"}, {"value", "within"}):
        inner = indent + "  "
        entries = [
            f"{inner}{json.dumps(name, ensure_ascii=False)}: {_lines(one, inner)}" for name, one in value.items()
        ]
        return "{\n" + ",\n".join(entries) + f"\n{indent}}}" if entries else "{}"
    return json.dumps(value, ensure_ascii=False)


def modules(folders: Sequence[str]) -> list[Numbers]:
    """Return the cases of all modules below some folders of tests.

    Parameters
    ----------
    folders : sequence of str
        From the project's folder.
    """
    files = sorted({file for folder in folders for file in (ROOT / folder).rglob("test_numbers*.py")})
    return [_imported(file).NUMBERS for file in files]


def _imported(file: Path) -> Any:
    name = "kept_" + "_".join(file.relative_to(ROOT).with_suffix("").parts)  # not what pytest calls it
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def main(arguments: Sequence[str]) -> int:
    """Print what moved, or keep it; return whether anything did that was not kept."""
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
