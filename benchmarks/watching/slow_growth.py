"""Slow leakage with warming oil: false alarms in healthy running, and delays when leakage grows to minor.

One healthy circuit runs while its oil warms and cools. It is watched with and without pressure, at one false alarm per
hour and one per day. At intervals it is copied, and in the copy leakage grows to minor over 1, 10 and 60 minutes.
``--hours`` sets the healthy running after one hour of learning (30 for acceptance), ``--seeds`` the number of copies
spread over it (50).
"""

import argparse
from copy import deepcopy
from dataclasses import dataclass
from statistics import median

from scipy.stats import poisson

from benchmarks.targets import Check, keep_figure
from benchmarks.watching.watching import PIECE, SAMPLE_TIME, CircuitStream
from experiments.running.random_streams import stream
from faults.watch.events import LOSS_BALANCE, Alarm
from faults.watch.watch import Watch
from plant.eha.circuit_parameters import CircuitParameters

SEED = 2041
LEARNING = 3600.0
RATES = {"one an hour": 1.0, "one a day": 1.0 / 24.0}
"""Rates of false alarms [1/h]."""

MINUTES = (1, 10, 60)
"""Times over which leakage grows to minor [min]."""

MINUTES_AFTER = 10
"""How long a leak is watched after it has become minor [min]."""

Watches = dict[tuple[bool, str], Watch]


@dataclass(frozen=True)
class GrowthReport:
    """Reports of a watch on growing leakage.

    Parameters
    ----------
    delay : float
        Delay from the beginning of growth to the alarm of lost flow [s]; infinite if there was none.
    sooner : bool
        Whether a balance raised an alarm earlier.
    covered : bool
        Whether the interval for the beginning covers it.
    """

    delay: float = float("inf")
    sooner: bool = False
    covered: bool = False


def watch_growth(
    running: CircuitStream, watches: dict[bool, Watch], minutes: int, seed: int
) -> dict[bool, GrowthReport]:
    """Let leakage grow in a copy of a healthy stream until every watch has reported it; return the reports."""
    running, watches = deepcopy((running, watches))
    running.reseed(stream(seed, "growth", str(minutes)))
    running.growth = 1.0 / (60.0 * minutes)
    begun = {logged: watch.last for logged, watch in watches.items()}
    told: dict[bool, GrowthReport] = {}
    sooner = dict.fromkeys(watches, False)
    for _ in range(minutes + MINUTES_AFTER):
        samples = running.run(PIECE)
        for logged in [one for one in watches if one not in told]:
            for event in watches[logged].take(samples):
                if isinstance(event, Alarm) and event.balance == LOSS_BALANCE and logged not in told:
                    low, high = event.interval
                    covered = low <= begun[logged] <= high
                    told[logged] = GrowthReport(event.time - begun[logged], sooner[logged], covered)
                sooner[logged] |= isinstance(event, Alarm)
        if len(told) == len(watches):
            break
    return {logged: told.get(logged, GrowthReport()) for logged in watches}


def check_false_alarms(count: int, rate: float, hours: float, balances: dict[str, int], which: str) -> int:
    """Print false alarms with the band that holds 95 % of counts at the rate; return whether they are outside."""
    low, high = (int(end) for end in poisson.interval(0.95, rate * hours))
    right = keep_figure(Check(f"{which}: false alarms in {hours:g} h", count, low, high)).met
    said = ", ".join(f"{name} {times}" for name, times in balances.items() if times) or "none"
    print(f"{count} in {hours:g} h (95 % band {low} to {high}; {said}): {'met' if right else 'MISSED'}")
    return int(not right)


def main(arguments: list[str]) -> int:
    """Print the figures with their targets; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=30.0)
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args(arguments)
    running = CircuitStream(options.seed)
    watches: Watches = {
        (logged, name): Watch(CircuitParameters(), SAMPLE_TIME, pressure=logged, false_alarms=rate, learning=LEARNING)
        for logged in (True, False)
        for name, rate in RATES.items()
    }
    raised: dict[tuple[bool, str], list[Alarm]] = {which: [] for which in watches}
    found: dict[tuple[int, bool], list[GrowthReport]] = {
        (minutes, logged): [] for minutes in MINUTES for logged in (True, False)
    }
    pieces, learning = round(3600.0 * options.hours / PIECE), round(LEARNING / PIECE)
    copies = {learning + round((k + 0.5) * pieces / options.seeds): k for k in range(options.seeds)}
    for piece in range(learning + pieces):
        samples = running.run(PIECE)
        for which, watch in watches.items():
            raised[which] += [event for event in watch.take(samples) if isinstance(event, Alarm)]
        if piece in copies:
            rare = {logged: watches[logged, "one a day"] for logged in (True, False)}
            for minutes in MINUTES:
                for logged, told in watch_growth(running, rare, minutes, options.seed + copies[piece]).items():
                    found[minutes, logged].append(told)
    misses = 0
    for (logged, name), alarms in raised.items():
        which = f"set to {name}, {'with' if logged else 'without'} pressure"
        print(f"{which}: ", end="")
        balances = {one: sum(alarm.balance == one for alarm in alarms) for one in watches[logged, name].balances}
        misses += check_false_alarms(len(alarms), RATES[name], options.hours, balances, which)
    for (minutes, logged), told in found.items():
        if told:
            misses += _delays(minutes, logged, told)
    return misses


def _delays(minutes: int, logged: bool, told: list[GrowthReport]) -> int:
    delays = sorted(one.delay for one in told)
    missed = sum(one.delay == float("inf") for one in told)
    which = f"minor in {minutes} min, {'with' if logged else 'without'} pressure"
    keep_figure(Check(f"{which}: not found, of {len(told)}", missed, most=0))
    print(
        f"{which}, one false alarm a day: found in "
        f"{len(told) - missed} of {len(told)}, delay {delays[0]:.0f} s at the least, {median(delays):.0f} s median, "
        f"{delays[-1]:.0f} s at most; a balance was sooner in {sum(one.sooner for one in told)}; beginning in its "
        f"interval {sum(one.covered for one in told)}: {'MISSED' if missed else 'met'}"
    )
    return missed
