"""Whether two commits give the same numbers: `python -m benchmarks same_numbers BASE [HEAD]`.

Both run estimate, diagnose and identify on the same logs (`same_numbers_logs`), good, foreign and hostile, each in a
git worktree of its own. Every number must agree to 1e-9, every word and exit code exactly; sentences may be put
otherwise but not appear or vanish, and entries may be added but not lost. What is meant to change stands in `WANTED`.
Results are kept by commit, so that a base is run once. With ``--again 'diagnose/*'`` HEAD's results are made anew for
those calls: a commit beside itself shows what is not repeatable.
"""

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import platformdirs

from benchmarks.same_numbers.same_numbers_calls import Call, calls, cells
from benchmarks.same_numbers.same_numbers_logs import collect
from benchmarks.same_numbers.same_numbers_runs import Commit, found_by, uncommitted

RELATIVE, ABSOLUTE = 1e-9, 1e-300
"""How far two numbers may be apart, as a share of the larger, or at all."""

TEXT = frozenset({"message", "reasons", "warnings", "not_told", "file", "findings", "stdout", "stderr"})
"""Entries that hold sentences."""

COMPILING = "compiling kernels"
"""How a line of standard error begins that a run with compiled kernels does not print."""

SHOWN = 40
"""Differences that are printed unless all are asked for."""

SAME, DIFFERS, MISSING, NEW, REWORDED = "same", "differs", "missing", "new", "reworded"


@dataclass(frozen=True)
class Wanted:
    """A change that is meant.

    Parameters
    ----------
    verb, log, key : str
        Patterns such as ``diagnose``, ``hostile/*`` and ``gate.passed``, with ``*`` and ``?``.
    reason : str
        Why.
    """

    verb: str
    log: str
    key: str
    reason: str


WANTED: tuple[Wanted, ...] = ()
"""The changes that are meant; empty where a commit is to change no number."""


@dataclass(frozen=True)
class Row:
    """Two values of one entry.

    Parameters
    ----------
    kind : str
        Whether they are the `SAME`, and if not, how.
    key : str
        The entry, with a dot between names.
    base, head : object
        The values.
    """

    kind: str
    key: str
    base: Any = None
    head: Any = None


def compared(base: Any, head: Any, key: str = "") -> Iterator[Row]:
    """Lay two results beside each other.

    Parameters
    ----------
    base, head : object
        As JSON gives them.
    key : str
        Which entry they are.

    Yields
    ------
    Row
        One for every value of the base, and one for every entry that only the other has.

    Examples
    --------
    >>> [row.kind for row in compared({"a": 1.0, "b": [2]}, {"a": 1.0 + 1e-12, "b": [3], "c": None})]
    ['same', 'differs', 'new']
    """
    if key.rpartition(".")[2] in TEXT:
        kind = DIFFERS if bool(base) != bool(head) else SAME if base == head else REWORDED
        yield Row(kind, key, base, head)
    elif isinstance(base, dict) and isinstance(head, dict):
        for name in base:
            inner = f"{key}.{name}" if key else name
            if name in head:
                yield from compared(base[name], head[name], inner)
            else:
                yield Row(MISSING, inner, base[name])
        yield from (Row(NEW, f"{key}.{name}" if key else name, None, head[name]) for name in head if name not in base)
    elif isinstance(base, list) and isinstance(head, list) and len(base) == len(head):
        for place, (one, other) in enumerate(zip(base, head, strict=True)):
            yield from compared(one, other, f"{key}.{place}")
    else:
        yield Row(SAME if _agree(base, head) else DIFFERS, key, base, head)


def _agree(base: Any, head: Any) -> bool:
    if _is_number(base) and _is_number(head):
        if math.isnan(base) or math.isnan(head):
            return math.isnan(base) and math.isnan(head)
        return base == head or math.isclose(base, head, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    empty = [value is None or (_is_number(value) and math.isnan(value)) for value in (base, head)]
    return all(empty) or (type(base) is type(head) and base == head)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def rows_of(call: Call, base: dict[str, Any], head: dict[str, Any]) -> Iterator[tuple[str, Row]]:
    """Lay what two commits print for one call beside each other.

    Parameters
    ----------
    call : Call
        The call.
    base, head : dict[str, Any]
        What `found_by` returns.

    Yields
    ------
    tuple of str and Row
        The log, empty where the row is of the whole call, and the row.
    """
    for name in ("exit_code", "stdout"):
        yield from (("", row) for row in compared(base[name], head[name], name))
    yield from (("", row) for row in compared(_heard(base["stderr"]), _heard(head["stderr"]), "stderr"))
    ours, theirs = base["results"], head["results"]
    if ours is None or theirs is None or not len(ours) == len(theirs) == len(call.logs):
        sizes = [None if found is None else len(found) for found in (ours, theirs)]
        yield "", Row(SAME if ours == theirs else DIFFERS, "count of results", *sizes)
        return
    for log, one, other in zip(call.logs, ours, theirs, strict=True):
        yield from ((log, row) for row in compared(one, other))


def _heard(stderr: str) -> str:
    """Return standard error without what only a first run says."""
    return "\n".join(line for line in stderr.splitlines() if not line.startswith(COMPILING))


def reason_for(verb: str, log: str, row: Row) -> str | None:
    """Return why a difference is wanted, or None."""
    fits = (w.reason for w in WANTED if fnmatch(verb, w.verb) and fnmatch(log, w.log) and fnmatch(row.key, w.key))
    return next(fits, None)


@dataclass
class Tally:
    """What is counted over all calls.

    Parameters
    ----------
    counts : Counter
        Rows, by kind.
    numbers : int
        Pairs of numbers.
    unwanted, allowed : list of str
        Differences in words.
    new, reworded : Counter
        Logs by verb and entry.
    """

    counts: Counter[str]
    numbers: int
    unwanted: list[str]
    allowed: list[str]
    new: Counter[str]
    reworded: Counter[str]

    def add(self, call: Call, log: str, row: Row) -> None:
        """Count a row."""
        self.counts[row.kind] += 1
        self.numbers += _is_number(row.base) and _is_number(row.head)
        if row.kind == NEW:
            self.new[f"{call.verb} {row.key}"] += 1
        elif row.kind == REWORDED:
            self.reworded[f"{call.verb} {row.key}"] += 1
        elif row.kind in (DIFFERS, MISSING):
            reason = reason_for(call.verb, log, row)
            words = f"{call.name} {log} {row.key}: {_said(row)}"
            if reason is None:
                self.unwanted.append(words)
            else:
                self.allowed.append(f"{words} ({reason})")


def _said(row: Row) -> str:
    if row.kind == MISSING:
        return f"{_short(row.base)} -> is missing"
    apart = ""
    if _is_number(row.base) and _is_number(row.head):
        apart = f", {abs(row.head - row.base) / max(abs(row.base), abs(row.head)):.1e} apart"
    return f"{_short(row.base)} -> {_short(row.head)}{apart}"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 120 else f"{text[:117]}..."


def show(tally: Tally, most: int) -> None:
    """Print what differs, what may differ, and what else there is to know."""
    for heading, lines in (("differs", tally.unwanted), ("differs as wanted", tally.allowed)):
        if lines:
            print(f"\n{heading}: {len(lines)}")
            print("\n".join(f"  {line}" for line in lines[:most]))
        if len(lines) > most:
            print(f"  and {len(lines) - most} more (--all)")
    for heading, counts in (("new entries", tally.new), ("sentences put otherwise", tally.reworded)):
        if counts:
            print(f"\n{heading}:")
            print("\n".join(f"  {name}: {count}" for name, count in sorted(counts.items())))


def parsed(arguments: list[str]) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(prog="same_numbers", description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("base", help="the commit whose numbers are right")
    parser.add_argument("head", nargs="?", default="HEAD", help="the commit that is to give the same (default: HEAD)")
    parser.add_argument(
        "--folder",
        type=Path,
        default=Path(platformdirs.user_cache_dir("hydrostate")) / "same_numbers",
        help="where logs, worktrees, kernels and results are kept (default: %(default)s)",
    )
    parser.add_argument("--only", default="*", help="calls to compare, a pattern such as 'diagnose/*'")
    parser.add_argument("--again", default="", help="calls to run anew for HEAD, though results are kept")
    parser.add_argument("--all", action="store_true", help="print every difference")
    return parser.parse_args(arguments)


def main(arguments: list[str]) -> int:
    """Compare two commits; return how many differences are not wanted."""
    options = parsed(arguments)
    folder = options.folder.resolve()
    base, head = (Commit.of(name, folder) for name in (options.base, options.head))
    if options.head == "HEAD" and uncommitted():
        print("what is not committed is not compared")
    logs, kept = folder / "logs", folder / "results"
    collect(logs, base.simulate)
    chosen = [call for call in calls(logs) if fnmatch(call.name, options.only)]
    tally, seconds = Tally(Counter(), 0, [], [], Counter(), Counter()), [0.0, 0.0]
    for call in chosen:
        first = found_by(base, call, logs, kept, again=False)
        second = found_by(head, call, logs, kept, again=fnmatch(call.name, options.again))
        for log, row in rows_of(call, first, second):
            tally.add(call, log, row)
        seconds = [seconds[0] + first["cpu_s"], seconds[1] + second["cpu_s"]]
    show(tally, len(tally.unwanted) + len(tally.allowed) if options.all else SHOWN)
    count, pairs = cells(chosen)
    print(
        f"\n{base.sha[:7]} and {head.sha[:7]}: {count} logs in {len(chosen)} calls, {pairs} pairs of a call and a log"
    )
    print(f"CPU: {seconds[0]:.0f} s and {seconds[1]:.0f} s; {tally.numbers} numbers, {dict(tally.counts)}")
    print(f"differences that are not wanted: {len(tally.unwanted)}")
    return len(tally.unwanted)
