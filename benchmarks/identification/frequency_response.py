"""Frequency responses: interval coverage, and whether the distortion level of a known cubic is found.

The local polynomial method gets one log of a lightly damped linear plant with noise and transients. The multisine
method gets several periods of odd multisines, with one line in four left out at random, through a filter and a cubic,
one log for each of six realisations. The true distortion is the variance of the output's lines over noiseless
realisations. A level from a single log scatters more, in particular behind a resonance, where few lines hold all the
power. Its scatter is printed too, with how often its interval covers the truth and the period that it recommends.
"""

import argparse
from collections.abc import Sequence

import numpy as np

from benchmarks.targets import check_target, misses
from estimation.arrays import Array, IntArray
from estimation.identification.model.recursion import filtered
from estimation.identification.signals.distortion import best_linear_approximation
from estimation.identification.signals.local_polynomial import local_polynomial_response

NUMERATOR, DENOMINATOR = [0.0, 0.1, 0.05], [1.0, -1.6, 0.75]
DAMPED = [1.0, -1.1, 0.4]
"""Denominator of the plant with the cubic; the other one is tried too."""

PERIOD, PERIODS, HIGHEST = 8192, 5, 3200
"""Samples in a period, number of periods, of which the first settles, and the highest line."""

CUBIC, NOISE = 0.3, 0.02
"""Coefficient of the cubic on the normalised filter output, and relative standard deviation of the noise [fraction]."""

SAMPLES, LOGS = 4096, 6
"""Samples of a log with noise, and number of multisine logs for estimating a level."""


def odd_lines(rng: np.random.Generator) -> IntArray:
    """Return the odd lines of a multisine, with one in every four left out at random."""
    groups = np.arange(1, HIGHEST, 2)[: HIGHEST // 8 * 4].reshape(-1, 4)
    kept = np.ones(groups.shape, dtype=bool)
    kept[np.arange(len(groups)), rng.integers(0, 4, len(groups))] = False
    return groups[kept]


def multisine(lines: IntArray, rng: np.random.Generator) -> Array:
    """Return one period with unit power."""
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    one = np.fft.irfft(spectrum)
    return one / one.std()


def plant_output(u: Array, denominator: Sequence[float]) -> Array:
    """Return the plant's output: a filter, then a cubic."""
    inner = filtered(NUMERATOR, denominator, u)
    size = inner[PERIOD:].std()
    return inner / size + CUBIC * (inner / size) ** 3


def _true_level(realisations: int, denominator: Sequence[float]) -> float:
    """Return the variance of the output's excited lines over realisations, averaged over lines."""
    rng = np.random.default_rng(99)
    lines = odd_lines(rng)
    ratios = np.empty((realisations, len(lines)), dtype=np.complex128)
    for row in ratios:
        u = multisine(lines, rng)
        y = plant_output(np.tile(u, 2), denominator)[PERIOD:]
        row[:] = np.fft.rfft(y)[lines] / np.fft.rfft(u)[lines]
    size = 1.0 / (2.0 * len(lines))  # |U/N|^2 of a multisine of unit power
    return float(np.mean(np.var(ratios, axis=0, ddof=1)) * size)


def main(arguments: Sequence[str] | None = None) -> int:
    """Count, and return how many targets are missed."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", type=int, default=50)
    options.add_argument("--realisations", type=int, default=400)
    chosen = options.parse_args(arguments)
    misses.clear()
    covered: list[float] = []
    for seed in range(chosen.seeds):
        rng = np.random.default_rng(seed)
        u = rng.normal(size=SAMPLES + 50)
        y = filtered(NUMERATOR, DENOMINATOR, u)[50:] + 0.1 * rng.normal(size=SAMPLES)
        found = local_polynomial_response(u[50:], y, 1.0)
        z = np.exp(-2j * np.pi * found.frequency)
        truth = np.polyval(NUMERATOR[::-1], z) / np.polyval(DENOMINATOR[::-1], z)
        covered.append(float(np.mean(np.abs(found.response - truth) <= found.radius())))
    share = 100.0 * float(np.mean(covered))
    check_target("local polynomial: circles that cover [%]", share, 93.0, most=False)
    check_target("local polynomial: circles that cover [%]", share, 97.0)
    for name, denominator in (("damped", DAMPED), ("resonant", DENOMINATOR)):
        every = [[_distortion_levels(seed, one, denominator) for one in range(LOGS)] for seed in range(chosen.seeds)]
        truth, levels = _true_level(chosen.realisations, denominator), np.mean(np.array(every)[:, :, :2], axis=1)
        single, away = (10.0 * np.log10(one / truth) for one in (np.array(every)[:, 0, 0], levels[:, 0]))
        print(f"planted cubic, {name}: error of its odd level {away.mean():.2f} +- {away.std():.2f} dB")
        print(f"planted cubic, {name}: the same of one log alone {single.mean():.2f} +- {single.std():.2f} dB")
        logs = np.array(every).reshape(-1, 5)
        near = 100.0 * float(np.mean(np.abs(10.0 * np.log10(logs[:, 0] / truth)) <= 1.0))
        held = 100.0 * float(np.mean((logs[:, 2] <= truth) & (truth <= logs[:, 3])))
        print(
            f"planted cubic, {name}: single logs within 1 dB {near:.0f} %, wanted periods {np.median(logs[:, 4]):.0f}"
        )
        check_target(f"planted cubic, {name}: intervals of single logs that hold the level [%]", held, 90.0, most=False)
        check_target(f"planted cubic, {name}: intervals of single logs that hold the level [%]", held, 98.0)
        if name == "damped":
            check_target("planted cubic: largest error of its odd level [dB]", float(np.abs(away).max()), 1.0)
            even = float(np.abs(levels[:, 1]).max() / truth)
            check_target("planted cubic: even level, which is not there, over the odd one", even, 0.05)
    return len(misses)


def _distortion_levels(seed: int, log: int, denominator: Sequence[float]) -> tuple[float, ...]:
    """Return the odd and even levels from one log, the odd one's interval, and the recommended period."""
    rng = np.random.default_rng([seed, log])
    y = plant_output(u := np.tile(multisine(odd_lines(rng), rng), PERIODS), denominator)
    told = best_linear_approximation(u, y + NOISE * y.std() * rng.normal(size=len(u)), 1.0)
    ends = told.level_interval(odd=True)
    return told.level(odd=True), told.level(odd=False), *ends, float(told.period_wanted(odd=True) or np.nan)
