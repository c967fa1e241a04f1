"""Stream filters that are saved, stopped and restarted from their file: how many continue bit-identically.

Every form with every method that filters streams, with five restarts at random samples of a log of the plant, cut at
random. The comparison with the uninterrupted filter covers its entire memory, not only its outputs.
"""

import argparse
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.targets import Check, keep_figure
from estimation.eha.online import StreamFilterOptions, begin_filter, load_filter, save_filter
from estimation.export.task import EXPORTED_FORMS
from estimation.filters.online import RULES, OnlineFilter
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

SAMPLE_TIME, RESTARTS = 1e-3, 5


def filter_on(filtered: OnlineFilter, record: Record, begin: int, end: int) -> None:
    """Filter the samples of a log, cut at random."""
    rng, task = np.random.default_rng(begin), filtered.problem
    drives, measured = (np.column_stack([record[one] for one in names]) for names in (task.model.drives, task.channels))
    while begin < end:
        stop = min(end, begin + int(rng.integers(1, 500)))
        filtered.take(drives[begin:stop], measured[begin:stop])
        begin = stop


def is_same_memory(ours: OnlineFilter, wanted: OnlineFilter) -> bool:
    """Return whether the memories of two filters are bit-identical."""
    kept, other = ours.remembered(), wanted.remembered()
    return all(kept[name].tobytes() == other[name].tobytes() for name in kept)


def main(arguments: list[str]) -> int:
    """Print each form and method; return how many do not continue bit-identically."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=5000)
    samples: int = parser.parse_args(arguments).samples
    p, rng, missed, count = EhaParameters(), np.random.default_rng(0), 0, 0
    drive = sine(samples * SAMPLE_TIME, SAMPLE_TIME, p.rated_speed, 5.0)
    record = simulate(LUMPED, drive, SAMPLE_TIME, p, sensors=BENCH, rng=rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "filter.npz"
        for form in EXPORTED_FORMS:
            for method in RULES:
                asked = StreamFilterOptions(p, form, method)
                whole, ours = begin_filter(asked, record), begin_filter(asked, record)
                filter_on(whole, record, 0, len(record))
                places = [0, *sorted(rng.integers(1, len(record), RESTARTS).tolist()), len(record)]
                for begin, end in pairwise(places):
                    filter_on(ours, record, begin, end)
                    save_filter(path, asked, ours, 0.0)
                    ours, _ = load_filter(path, asked)
                met = is_same_memory(ours, whole)
                missed, count = missed + (not met), count + 1
                finite = bool(np.all(np.isfinite(whole.now().values)))
                print(f"{form:18s}{method:6s}{'to the bit' if met else 'MISSED'}{'' if finite else ' (it diverged)'}")
    keep_figure(Check("filters that do not continue to the last bit", missed, most=0))
    print(f"{count - missed} of {count} continue to the last bit over {RESTARTS} restarts")
    return missed
