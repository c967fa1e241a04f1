"""Forecasts and alarms on simulated fleets: coverage of crossing times, lead time of alarms, false alarms.

Growth does not follow the filter's model: it is steady, exponential, of varying rate, in bursts, or stops short of the
limit. Healthy actuators stay constant, or drift with oil and weather. Each log has its own standard deviation, scatters
beyond it, and has a gross error once in a hundred. A forecast is evaluated every fifth log from the alarm to the
crossing. An alarm is false if nothing has grown over the last ten logs. Alarms on growth that stops short of the limit
are counted separately.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from benchmarks.targets import check_target, misses
from faults.trend.trend import Series, trends
from plant.arrays import Array

GROWING_KINDS = ("steady", "exponential", "wandering rate", "bursts", "stopping")
SOUND_KINDS = ("healthy", "wandering level")
LOGS, AHEAD = 60, 240
"""Observed logs, and further logs over which the truth continues [count]."""

RECENT_LOGS = 10
"""Number of recent logs in which a true alarm must have seen growth [count]."""


def level(kind: str, rng: np.random.Generator) -> Array:
    """Return the true severity, 0 when healthy and 1 at the limit, shape (LOGS + AHEAD,)."""
    log = np.arange(LOGS + AHEAD)
    age = np.maximum(log - rng.integers(5, 25), 0)
    rate = np.exp(rng.uniform(np.log(0.012), np.log(0.05)))
    match kind:
        case "steady":
            return rate * age
        case "exponential":
            return 0.1 * np.expm1(2.0 * rate * age)
        case "wandering rate":
            return np.cumsum((age > 0) * rate * np.exp(np.cumsum(0.15 * rng.standard_normal(len(log)))))
        case "bursts":
            return np.cumsum((age > 0) * 4.0 * rate * (rng.random(len(log)) < 0.25))
        case "stopping":
            return rate * np.minimum(age, rng.integers(15, 60))
        case "wandering level":
            shocks, found = 0.03 * rng.standard_normal(len(log)), np.zeros(len(log))
            for place in range(1, len(log)):
                found[place] = 0.8 * found[place - 1] + shocks[place]
            return found
        case _:
            return np.zeros(len(log))


def measured(truth: Array, rng: np.random.Generator) -> Series:
    """Return the logged values of a severity."""
    shape = LOGS
    stds = np.exp(rng.uniform(np.log(0.02), np.log(0.1)) + 0.3 * rng.standard_normal(shape))
    wrong = np.where(rng.random(shape) < 0.01, 0.7 * rng.standard_normal(shape), 0.0)
    noise = stds * rng.standard_normal(shape) + rng.uniform(0.0, 0.05) * rng.standard_normal(shape)
    return Series(np.arange(shape, dtype=np.float64), truth[:shape] + noise + wrong, stds, 0.0, 1.0)


@dataclass
class Tally:
    """Results of the actuators of one kind."""

    logs: int = 0
    false: int = 0
    early: int = 0
    leads: list[float] = field(default_factory=list[float])
    in90: list[bool] = field(default_factory=list[bool])
    in50: list[bool] = field(default_factory=list[bool])


def judge(kind: str, rng: np.random.Generator, tally: Tally) -> None:
    """Watch one actuator until it crosses its limit, and add the result."""
    truth = level(kind, rng)
    crossed = _crossing(truth)
    alarm: int | None = None
    for trend in trends(measured(truth, rng)):
        if trend.place >= crossed:
            break
        tally.logs += 1
        if alarm is None and trend.alarm:
            alarm = trend.place
            grown = truth[alarm] - truth[max(alarm - RECENT_LOGS, 0)] > 0.0 and kind in GROWING_KINDS
            tally.false += not grown
            tally.early += grown and not np.isfinite(crossed)
        if alarm is not None and (trend.place - alarm) % 5 == 0 and np.isfinite(crossed) and trend.crossing:
            least, low, _, high, most = trend.crossing.quantiles
            tally.in90.append(bool(least <= crossed - trend.place <= most))
            tally.in50.append(bool(low <= crossed - trend.place <= high))
    if crossed < LOGS:
        tally.leads.append(0.0 if alarm is None else crossed - alarm)


def _crossing(truth: Array) -> float:
    """Return when the truth first reaches the limit [log], with linear interpolation between two logs."""
    past = np.flatnonzero(truth >= 1.0)
    if not len(past):
        return np.inf
    last = int(past[0])
    return last - float((truth[last] - 1.0) / (truth[last] - truth[last - 1]))


def _all_values(tallies: dict[str, Tally], name: str) -> Iterator[float]:
    return (value for tally in tallies.values() for value in getattr(tally, name))


def main(arguments: list[str]) -> int:
    """Print the figures with their targets; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--actuators", type=int, default=800, help="200 have no more than 270 forecasts, which are alike"
    )
    parser.add_argument("--seed", type=int, default=5)
    options = parser.parse_args(arguments)
    misses.clear()
    rng = np.random.default_rng(options.seed)
    tallies = {kind: Tally() for kind in (*GROWING_KINDS, *SOUND_KINDS)}
    for number in range(options.actuators):
        half = number % 2
        kinds = SOUND_KINDS if half else GROWING_KINDS
        kind = kinds[number // 2 % len(kinds)]
        judge(kind, rng, tallies[kind])
    for kind, one in tallies.items():
        said = f"{kind}: {one.logs} logs, {one.false} false alarms, {one.early} where it stops short"
        if one.leads:
            said += f", median lead {np.median(one.leads):.0f} logs"
        if one.in90:
            inside = [100.0 * float(np.mean(one)) for one in (one.in90, one.in50)]
            said += f", {len(one.in90)} forecasts, 90 % covers {inside[0]:.0f} %, 50 % {inside[1]:.0f} %"
        print(said)
    covered = 100.0 * float(np.mean(list(_all_values(tallies, "in90"))))
    check_target("90 % intervals cover [%]", covered, 85.0, most=False)
    check_target("90 % intervals cover [%]", covered, 95.0)
    check_target(
        "median lead of alarms [logs]", float(np.median(list(_all_values(tallies, "leads")))), 10.0, most=False
    )
    false, logs = (sum(getattr(one, name) for one in tallies.values()) for name in ("false", "logs"))
    check_target("false alarms in 1,000 logs", 1000.0 * false / logs, 1.0)
    sound = [tallies[kind] for kind in SOUND_KINDS]
    print(f"of them on sound actuators: {sum(one.false for one in sound)} in {sum(one.logs for one in sound)} logs")
    return len(misses)
