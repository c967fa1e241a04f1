"""All filters of a study: 9 conditions x 11 first guesses x 16 seeds x 100,000 steps, with simulation and noise.

CPU time on one core after compilation, and peak memory.
"""

import argparse
import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from estimation.engine.contract import FilterProblem
from estimation.filters.batch import filter_batch
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import START_STD, first_belief
from estimation.models.eha_forms import ACCELERATION_FORM, BULK_MODULUS
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import REDUCED, simulate
from plant.sensors.sensors import BENCH, measure

SAMPLE_TIME = 1e-4
STARTS = tuple(0.5e8 * k for k in range(11))
CHANNELS = ("position_m", "velocity_m_s")
VARIANCES = {"position_m": 1e-12, "velocity_m_s": 1e-6}
WANTED_SECONDS, WANTED_BYTES = 6.0, 1e9


def filter_problems(seeds: int, samples: int) -> Iterator[FilterProblem]:
    """Yield the filters, condition by condition; all first guesses of a run share its noise."""
    for number, condition in enumerate(CONDITIONS.values()):
        p = parameters_for(condition)
        speed = make_drive("sine", samples * SAMPLE_TIME, SAMPLE_TIME, p, np.random.default_rng(1))[:samples]
        truth = simulate(REDUCED, speed, SAMPLE_TIME, p)
        for seed in range(seeds):
            record = measure(truth, BENCH, np.random.default_rng([seed, number]))
            prior = first_belief(ACCELERATION_FORM, record, 1e8, START_STD)
            first = filter_problem(ACCELERATION_FORM, prior, record, p, channels=CHANNELS, variances=VARIANCES)
            place = ACCELERATION_FORM.index(BULK_MODULUS)
            for start in STARTS:
                mean = first.mean.copy()
                mean[place] = start / ACCELERATION_FORM.states[place].scale
                yield replace(first, mean=mean, every=samples)


def main(arguments: list[str]) -> int:
    """Print time and memory; return how many of the two targets are missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--samples", type=int, default=100_000)
    options = parser.parse_args(arguments)
    list(filter_batch(filter_problems(1, 100)))
    begin = time.process_time()
    finals = np.array([trace.mean[-1] for trace in filter_batch(filter_problems(options.seeds, options.samples))])
    seconds = time.process_time() - begin
    peak = 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024.0 if sys.platform == "darwin" else 1.0)
    within = np.mean(np.abs(finals / 2.07 - 1.0) < 0.03)
    print(f"{len(finals)} filters x {options.samples} steps, simulation and noise included: {seconds:.2f} s CPU")
    print(f"{1e9 * seconds / (len(finals) * options.samples):.1f} ns a filter-step; peak memory {peak / 1e6:.0f} MB")
    print(f"{100.0 * within:.1f} % of final values within 3 % of the truth")
    print(f"wanted: under {WANTED_SECONDS:g} s and {WANTED_BYTES / 1e6:.0f} MB")
    return int(seconds >= WANTED_SECONDS) + int(peak >= WANTED_BYTES)
