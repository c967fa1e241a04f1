"""Earlier figures of the benchmarks, so that regressions show.

`python -m benchmarks --record NAME ...` adds every figure of that run to `benchmarks/history.jsonl`, with the date, the
commit and the kind of machine. `python -m benchmarks history` compares the newest figure of each with the earlier ones
on the same kind of machine, and ends with a non-zero exit status if one got worse. `--plot FOLDER` draws one plot for
each benchmark.
"""

import argparse
import json
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf, isfinite
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.targets import Check

HISTORY = Path(__file__).with_name("history.jsonl")
"""File of the figures, one on each line."""

REPORTED_CHANGE = 0.25
"""Change for the worse that is always reported, as a share of the earlier median. Two shared cores scatter by some 10
%."""

SCATTER_FACTOR = 3.0
"""Number of median absolute deviations of the earlier figures that a change must also exceed [dimensionless]."""


@dataclass(frozen=True)
class Entry:
    """One figure of one run."""

    date: str
    commit: str
    machine: str
    benchmark: str
    """Name and arguments of the benchmark, as given."""

    check: Check

    def line(self) -> str:
        """Return the entry as one line of JSON; an open limit of the range is null."""
        least, most = (limit if isfinite(limit) else None for limit in (self.check.least, self.check.most))
        where = {"date": self.date, "commit": self.commit, "machine": self.machine, "benchmark": self.benchmark}
        return json.dumps({**where, "what": self.check.what, "value": self.check.value, "least": least, "most": most})


def entry_of(line: str) -> Entry:
    """Return the entry on a line."""
    held: dict[str, Any] = json.loads(line)
    least, most = held["least"], held["most"]
    check = Check(held["what"], held["value"], -inf if least is None else least, inf if most is None else most)
    return Entry(held["date"], held["commit"], held["machine"], held["benchmark"], check)


def machine() -> str:
    """Return the kind of this machine: processors, and the widest vectors of the first one."""
    try:
        flags = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        flags = ""
    vectors = "AVX-512" if " avx512f" in flags else "AVX2" if " avx2" in flags else "vectors unknown"
    return f"{os.cpu_count()} processors, {vectors}"


def commit() -> str:
    """Return the checked-out commit, with a plus sign if files differ from it."""
    said = [
        subprocess.run(["git", *words], capture_output=True, text=True, check=False, cwd=HISTORY.parent).stdout.strip()  # noqa: S603, S607 -- git, our own words
        for words in (("rev-parse", "--short", "HEAD"), ("status", "--porcelain", "--untracked-files=no"))
    ]
    return f"{said[0] or 'unknown'}{'+' if said[1] else ''}"


def record(benchmark: str, checks: Iterable[Check], path: Path = HISTORY) -> int:
    """Add the figures of a run to the history; return how many. Figures that are not finite are skipped."""
    now, where, kind = datetime.now(UTC).date().isoformat(), commit(), machine()
    lines = [Entry(now, where, kind, benchmark, check).line() for check in checks if isfinite(check.value)]
    with path.open("a", encoding="utf-8") as file:
        file.writelines(f"{line}\n" for line in lines)
    return len(lines)


def series_of(entries: Iterable[Entry]) -> dict[tuple[str, str, str], list[Entry]]:
    """Return the entries of each figure in recorded order, by machine, benchmark and name."""
    series: dict[tuple[str, str, str], list[Entry]] = defaultdict(list)
    for entry in entries:
        series[entry.machine, entry.benchmark, entry.check.what].append(entry)
    return series


def regression(checks: Sequence[Check]) -> str | None:
    """Describe how the newest figure is worse than the earlier ones, or return None.

    A figure is worse if it misses a range that the previous figure met. A figure with one limit is also worse if it
    moved towards that limit by more than `REPORTED_CHANGE` of the earlier median and more than `SCATTER_FACTOR` of the
    earlier scatter.

    Examples
    --------
    >>> regression([Check("a step [ns]", value, most=25.0) for value in (20.0, 21.0, 24.0)])
    >>> regression([Check("a step [ns]", value, most=50.0) for value in (20.0, 21.0, 29.0)])
    'worse by 41 %: 29, 20.5 before'
    """
    *before, last = checks
    if not before:
        return None
    if before[-1].met and not last.met:
        return f"misses its range now: {last.value:.4g}, wanted {last.wanted}, {before[-1].value:.4g} before"
    if isfinite(last.least) == isfinite(last.most):
        return None
    middle = median(check.value for check in before)
    scatter = median(abs(check.value - middle) for check in before)
    worse = (last.value - middle) * (1.0 if isfinite(last.most) else -1.0)
    if worse <= max(REPORTED_CHANGE * abs(middle), SCATTER_FACTOR * scatter):
        return None
    share = f"worse by {100.0 * worse / abs(middle):.0f} %" if middle else "worse"
    return f"{share}: {last.value:.4g}, {middle:.4g} before"


def draw(series: dict[tuple[str, str, str], list[Entry]], folder: Path) -> list[Path]:
    """Plot the figures of each benchmark over the runs, relative to its first one; return the files."""
    import matplotlib.pyplot as plt

    by_benchmark: dict[tuple[str, str], list[list[Entry]]] = defaultdict(list)
    for (kind, benchmark, _), entries in series.items():
        if len(entries) > 1 and entries[0].check.value:
            by_benchmark[kind, benchmark].append(entries)
    folder.mkdir(parents=True, exist_ok=True)
    files: list[Path] = []
    for number, ((kind, benchmark), figures) in enumerate(sorted(by_benchmark.items())):
        figure, axes = plt.subplots(figsize=(8.0, 4.5), layout="constrained")
        for entries in figures:
            shares = [100.0 * entry.check.value / entries[0].check.value for entry in entries]
            axes.plot(range(len(shares)), shares, marker="o", label=entries[0].check.what)
        longest = max(figures, key=len)
        axes.set_xticks(range(len(longest)), [f"{entry.date}\n{entry.commit}" for entry in longest], fontsize="small")
        axes.set(title=f"{benchmark} ({kind})", ylabel="figure, share of the first [%]")
        axes.legend(fontsize="x-small")
        files.append(folder / f"{number:02d}_{benchmark.split()[0]}.png")
        figure.savefig(files[-1], dpi=120)
        plt.close(figure)
    return files


def main(arguments: list[str]) -> int:
    """Print the newest figure of each with the previous one; return how many are worse."""
    parser = argparse.ArgumentParser(prog="history", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--file", type=Path, default=HISTORY, help="another history")
    parser.add_argument("--plot", type=Path, help="folder for one figure a benchmark")
    options = parser.parse_args(arguments)
    if not options.file.exists():
        print(f"{options.file}: no history there; `python -m benchmarks --record NAME` begins one", file=sys.stderr)
        return 1
    series = series_of(map(entry_of, options.file.read_text(encoding="utf-8").splitlines()))
    worse = 0
    for (_, benchmark, what), entries in series.items():
        found = regression([entry.check for entry in entries])
        worse += found is not None
        last = entries[-1]
        said = f"{last.check.value:.4g} on {last.date} at {last.commit}, {len(entries)} runs"
        print(f"{'WORSE ' if found else '      '} {benchmark}: {what}: {found or said}")
    for file in draw(series, options.plot) if options.plot else []:
        print(file)
    return worse
