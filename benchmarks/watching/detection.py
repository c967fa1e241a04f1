"""Online detection on the circuit: delay after an abrupt fault, false alarms at a set rate, time per sample.

A watch learns the healthy running of one seed; faults and false alarms are evaluated with drive and noise of other
seeds. ``--hours`` sets the healthy running to evaluate (30 for acceptance), ``--seeds`` the faults for each condition,
``--streams`` the number of one-hour streams watched after two minutes.
"""

import argparse
from statistics import median
from time import process_time

import numpy as np

from benchmarks.diagnosis.scores import alarm_rate, median_delay
from benchmarks.targets import Check, keep_figure
from benchmarks.watching.watching import PIECE, SAMPLE_TIME, CircuitStream, detect_fault, false_alarms, learnt_watch
from faults.watch.events import Alarm
from faults.watch.watch import LEARNING, Watch
from plant.eha.circuit_parameters import CircuitParameters

FAULTS = ("minor_leakage", "minor_friction")
LONGEST_DELAY = 0.5
FEWEST, MOST = 20.0 / 30.0, 41.0 / 30.0
LEARNING_HOURS = 1.0
FAST_SAMPLE_TIME = 1e-4
SEED = 2031


def delay_misses(seeds: int) -> int:
    """Print the delay of every fault; return the number of misses."""
    running, watch = learnt_watch(SEED, LEARNING_HOURS)
    misses = 0
    for condition in FAULTS:
        found = [detect_fault(running, watch, condition, seed) for seed in range(seeds)]
        middle, (low, high) = median_delay([one.delay for one in found])
        covered = np.mean([one.covered for one in found])
        missed = sum(one.delay == float("inf") for one in found)
        right = keep_figure(Check(f"{condition}: median delay [s]", middle, most=LONGEST_DELAY)).met
        misses += not right
        print(
            f"{condition}: median delay {middle:.3f} s (95 % {low:.3f} to {high:.3f}, target {LONGEST_DELAY:g}), "
            f"longest {max(one.delay for one in found):.3f} s, not found {missed} of {seeds}, time in its interval "
            f"{100.0 * covered:.0f} %: {'met' if right else 'MISSED'}"
        )
    return misses


def false_alarm_miss(hours: float) -> int:
    """Print the false alarms at one per hour; return whether they miss the target."""
    running, watch = learnt_watch(SEED + 1, LEARNING_HOURS)
    count = len(false_alarms(running, watch, hours))
    rate, (low, high) = alarm_rate(count, hours)
    right = keep_figure(Check("false alarms an hour, set to one", rate, FEWEST, MOST)).met
    print(
        f"set to 1 false alarm an hour, {LEARNING_HOURS:g} h learnt: {count} in {hours:g} h, {rate:.2f} an hour "
        f"(95 % {low:.2f} to {high:.2f}, target {FEWEST:.2f} to {MOST:.2f}): {'met' if right else 'MISSED'}"
    )
    return int(not right)


def print_cold_alarms(streams: int) -> None:
    """Print the false alarms of one-hour streams watched after two minutes; there is no target."""
    counts, hours = {True: 0, False: 0}, streams * (1.0 - LEARNING / 3600.0)
    for seed in range(SEED + 2, SEED + 2 + streams):
        running = CircuitStream(seed)
        watches = {logged: Watch(CircuitParameters(), SAMPLE_TIME, pressure=logged) for logged in counts}
        for _ in range(round(3600.0 / PIECE)):
            samples = running.run(PIECE)
            for logged, watch in watches.items():
                counts[logged] += sum(isinstance(event, Alarm) for event in watch.take(samples))
    for logged, count in counts.items():
        rate, (low, high) = alarm_rate(count, hours)
        print(
            f"the same, {LEARNING:g} s learnt, {'with' if logged else 'without'} pressure: {count} in {hours:.1f} h, "
            f"{rate:.2f} an hour (95 % {low:.2f} to {high:.2f})"
        )


def speed() -> int:
    """Print the CPU time per sample at 10 kHz, in blocks of one second; return whether one core cannot keep up."""
    samples = np.repeat(CircuitStream(SEED).run(PIECE), round(SAMPLE_TIME / FAST_SAMPLE_TIME), axis=0)
    watch = Watch(CircuitParameters(), FAST_SAMPLE_TIME)
    watch.take(samples[:20000])
    count, spent = round(1.0 / FAST_SAMPLE_TIME), []
    for first in range(20000, len(samples) - count, count):
        begin = process_time()
        watch.take(samples[first : first + count])
        spent.append(process_time() - begin)
    load = median(spent)
    print(f"10 kHz: {1e9 * load / count:.0f} ns a sample, {100.0 * load:.2g} % of a core (target under 100 %)")
    return int(load >= 1.0)


def main(arguments: list[str]) -> int:
    """Print the figures with their targets; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=30.0)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--streams", type=int, default=10)
    options = parser.parse_args(arguments)
    misses = delay_misses(options.seeds) + false_alarm_miss(options.hours) + speed()
    if options.streams:
        print_cold_alarms(options.streams)
    return misses
