"""The shipped estimators on the open benchmark: one line for each kind of log, with pressure and without.

Logs are made from the selected split; ``--folder`` scores existing sets instead. With pressure, the target is no silent
errors and no false unknowns. A log without pressure takes long, so few of them are scored. ``--pairs`` scores logs with
two kinds at once, drawn at random: log k is number k of its pair; ``--usual-pairs`` those of `USUAL_PAIRS`, ``--count``
of each.
"""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.open_benchmark.folders import write_set
from experiments.open_benchmark.kinds import KINDS, SPLITS, VERSION, drawn_pairs
from experiments.open_benchmark.score import coverage, score_set, summary

ZERO_COUNTS = ("silent_beta", "silent_class", "false_unknown", "false_since")
"""Counts that should be zero if pressure is logged."""

USUAL_PAIRS = (
    *("pressure_lags_2_ms+position_zero_at_stop", "pressure_1_bar_off+worn_pump", "clock_jitters+constant_load"),
    *("pressure_5_ms_late+entrained_air", "pressure_lags_2_ms+single_rod", "rig_volume_wrong+makeup_check_stuck_shut"),
    *("coarse_converters+leakage_grows", "no_velocity+speed_offset", "closed_loop+entrained_air"),
    *("logged_at_5_kHz+pressure_behind_30_hz", "position_zero_at_stop+worn_pump", "speed_offset+worn_pump"),
    *("pressure_1_bar_off+position_zero_at_stop", "pressure_5_ms_late+makeup_check_leaks"),
)
"""Two disturbances that a bench is likely to have at once: a fault or an omission of its rig file, and one effect of
its logger."""


def main(arguments: list[str]) -> int:
    """Print one line for each kind, and the counts that should be zero; return how many are not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", nargs="+", default=list(KINDS), choices=list(KINDS), metavar="KIND")
    parser.add_argument("--split", default="validation", choices=SPLITS)
    parser.add_argument("--count", type=int, default=3, help="logs of each kind")
    parser.add_argument("--pairs", type=int, default=0, help="logs of two kinds at once, in place of single ones")
    parser.add_argument("--usual-pairs", action="store_true", help="those of a usual bench, in place of single kinds")
    parser.add_argument("--without", type=int, default=0, help="of them scored without pressure too")
    parser.add_argument("--folder", nargs="+", type=Path, default=[], help="sets to score in place of made ones")
    parser.add_argument("--coverage", action="store_true", help="also a line a kind and quantity on its intervals")
    parser.add_argument("--rows", type=Path, help="CSV file for a row a log")
    options = parser.parse_args(arguments)
    print(f"open benchmark {VERSION}, {options.split if not options.folder else 'given'} sets", flush=True)
    with tempfile.TemporaryDirectory() as made:
        rows = score_sets(options, Path(made))
    if options.rows:
        pd.DataFrame(rows).to_csv(options.rows, index=False)
    if options.coverage:
        print(coverage(rows).to_string(index=False, float_format="%.2f"))
    table = summary(rows)
    counts = table[table["pressure"]][list(ZERO_COUNTS)].sum()
    for name, count in counts.items():
        print(f"with pressure, {name}: {count} of {table['logs'][table['pressure']].sum()} (none wanted)")
    return int((counts > 0).sum())


def score_sets(options: argparse.Namespace, made: Path) -> Sequence[dict[str, Any]]:
    """Return one row for each log, and print each set's line as it is finished."""
    rows: list[dict[str, Any]] = []
    for folder, count in log_folders(options, made):
        for pressure, logs in ((True, count), (False, min(count, options.without))):
            found = list(score_set(folder, logs, pressure=pressure))
            if found:
                line = summary(found).to_string(index=False, header=not rows, float_format="%.3g", col_space=6)
                print(line, flush=True)
            rows += found
    return rows


def log_folders(options: argparse.Namespace, made: Path) -> Iterator[tuple[Path, int]]:
    """Yield the folder of each set, made on demand, with the number of logs to score."""
    if options.folder:
        yield from ((folder, options.count) for folder in options.folder)
    elif options.pairs:
        for index, pair in enumerate(drawn_pairs(options.split, options.pairs)):
            yield write_set(pair, options.split, 1, made, first=index).parent, 1
    else:
        kinds = USUAL_PAIRS if options.usual_pairs else options.kind
        yield from ((write_set(kind, options.split, options.count, made).parent, options.count) for kind in kinds)
