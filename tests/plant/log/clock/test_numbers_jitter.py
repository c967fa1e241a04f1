"""How stamps with jitter or rounding are treated, kept in `numbers_jitter.json`."""

from typing import Any

import numpy as np
import pytest

from plant.arrays import Array
from plant.log.clock.jitter import grid_of, resampled, rounded_clock, usual_step
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
T = 2e-3
NOISE = np.random.default_rng(41).uniform(-1.0, 1.0, 60)
TICKS = np.arange(60.0)


def jittering(share: float, begin: float = 0.5, count: int = 60) -> Array:
    """Return stamps that jitter by at most a share of the sample time."""
    return begin + T * (TICKS + share * NOISE)[:count]


@NUMBERS.case()
def uniform_clock_of_stamps() -> dict[str, Any]:
    made = {
        "jitter of 4 %": jittering(0.04),
        "jitter of 32 %": jittering(0.32),
        "of two": np.array([0.5, 0.9]),
        "of three, one left out": np.array([0.0, 0.2, 0.4, 0.8]),
        "two left out": np.delete(jittering(0.1), [20, 21]),
    }
    return {
        name: {
            "sample time [s]": grid.sample_time,
            "widest step [s]": grid.widest,
            "scatter": grid.scatter,
            "most": grid.most,
            "times [s]": grid.times[[0, 1, -1]],
            "count": len(grid.times),
            "lacking": np.flatnonzero(grid.lacking(stamps)),
        }
        for name, stamps in made.items()
        for grid in [grid_of(stamps)]
    }


@NUMBERS.case()
def times_that_nothing_is_near() -> dict[str, Any]:
    grid = grid_of(jittering(0.05, 0.0, 20))
    shifted = {"by half a step": 0.48, "by more": 0.55, "by a step and more": 1.6}
    apart = {f"a gap of {size} steps": size for size in (1.2, 1.4, 1.6, 2.0, 2.3)}
    return {
        **{f"begins later {name}": np.flatnonzero(grid.lacking(grid.times + T * by)) for name, by in shifted.items()},
        **{f"ends earlier {name}": np.flatnonzero(grid.lacking(grid.times - T * by)) for name, by in shifted.items()},
        **{
            name: np.flatnonzero(grid.lacking(np.concatenate((grid.times[:8], grid.times[7] + T * size + grid.times))))
            for name, size in apart.items()
        },
    }


@NUMBERS.case()
def usual_steps() -> dict[str, Any]:
    steps = {
        "even": np.array([1.0, 1.0, 1.0, 1.0]),
        "one of four": np.array([0.1, 0.2, 0.3, 4.0]),
        "spread": 1.0 + 0.9 * NOISE[:21],
        "half as long again": np.array([1.0, 1.0, 1.5, 1.51, 0.5, 0.49]),
        "of a few": np.array([5.0, 3.0]),
        "a third short": np.array([0.1, 0.1, 0.1, 1.0, 1.0, 1.1, 1.2]),
        "a third long": np.array([4.0, 1.0, 4.0, 1.0, 1.1, 4.0, 1.2]),
    }
    return {name: usual_step(step) for name, step in steps.items()}


@NUMBERS.case()
def channels_on_a_uniform_clock() -> dict[str, Any]:
    time = jittering(0.2, 3.0, 16)
    grid = grid_of(time)
    smooth = np.sin(400.0 * time) + 0.01 * NOISE[:16]
    gappy = {f"{len(gone)} missing": gone for gone in ([7], [7, 8], [6, 7, 8], [1, 14], list(range(4, 16)))}
    few = {f"{count} alone": list(range(count, 16)) for count in (1, 2, 4, 5)}
    without: dict[str, Array] = {}
    for name, gone in {**gappy, **few}.items():
        without[name] = smooth.copy()
        without[name][gone] = np.nan
    return {name: resampled(grid, time, values) for name, values in {"whole": smooth, **without}.items()}


@NUMBERS.case()
def values_on_quanta_of_a_sensor() -> dict[str, Any]:
    time = jittering(0.2, 0.0, 12)
    grid = grid_of(time)
    counts = np.array([3.0, 3.0, 4.0, 6.0, 7.0, 7.0, 6.0, 4.0, 3.0, 1.0, 0.0, 0.0])
    far = np.array([0.0, 1.0, 2.0, 5.0, 9.0, 12.0, 10.0, 7.0, 5.0, 4.0, 3.0, 3.0])
    fine = {f"quantum of {share:g} of the range": share for share in (1.5e-12, 0.6e-12, 5e-11)}
    ends = np.array([0.0, 1.0, *np.zeros(10)])
    return {
        "in quanta": resampled(grid, time, 0.25 * counts + 10.0),
        "from below": resampled(grid, time, 0.25 * counts - 10.0),
        **{
            f"off by {off:g} of a quantum": resampled(grid, time, 0.25 * far + off * 0.25 * (TICKS[:12] == 4.0))[:6]
            for off in (8e-4, 1.5e-3, 0.05)
        },
        **{
            name: np.diff(resampled(grid, time, np.where(TICKS[:12] == 5.0, 1.0 / round(1.0 / share), ends)))[:3]
            for name, share in fine.items()
        },
    }


@NUMBERS.case()
def clocks_whose_stamps_were_rounded() -> dict[str, Any]:
    def clock(sample: float, quantum: float, count: int = 60, off: float = 0.0, begin: float = 0.0) -> Any:
        whole = np.floor((begin + sample * TICKS[:count]) / quantum + 0.5)
        found = rounded_clock(quantum * (whole + off * (np.arange(count) == 7)), TICKS[:count])
        return None if found is None else list(found)

    odd = 1e-3 * np.rint(0.37 * TICKS) + 1e-3 * (np.arange(60) % 19 == 5)
    return {
        "three samples a quantum": clock(1e-3 / 3.0, 1e-3),
        "four, late": clock(0.25e-3, 1e-3, begin=7.3e-3),
        "2.7 a quantum": clock(1e-3 / 2.7, 1e-3),
        "1.4 a quantum": clock(1e-3 / 1.4, 1e-3),
        "a quantum and a half": clock(1.5e-3, 1e-3),
        "three quanta and a bit": clock(3.1e-3, 1e-3),
        "no step differs": clock(1e-3, 1e-3),
        **{f"{count} samples": clock(0.4e-3, 1e-3, count) for count in (10, 12, 14, 16, 24, 30)},
        **{
            f"steps off by {off:g} of a quantum": list(
                rounded_clock(1e-3 * (np.rint(1.5 * TICKS) + off * TICKS), TICKS) or ()
            )
            for off in (0.006, 0.015, 0.05)
        },
        **{f"stamps of {begin:g} s": clock(0.4e-3, 1e-3, begin=begin) for begin in (1e3, 1e9, 1.6e12, 1e13)},
        "strays within": (lambda found: None if found is None else list(found))(rounded_clock(odd, TICKS)),
        "slots left out": list(rounded_clock(1e-3 * np.rint(0.4 * TICKS[10:]), TICKS[10:]) or ()),
        "standing": rounded_clock(np.ones(60), TICKS),
        "back": rounded_clock(-1e-3 * np.rint(0.4 * TICKS), TICKS),
        **{
            f"fine steps of {step:g} s": rounded_clock(np.cumsum(np.where(TICKS % 3 == 0, 1.0, 1.0 + step)), TICKS)
            is None
            for step in (0.6e-9, 1.5e-9, 1e-8, 3e-7)
        },
        **{
            f"spread of {spread:g} quanta": rounded_clock(
                1e-3 * np.rint(3.0 * TICKS + spread * np.sin(0.8 * TICKS)), TICKS
            )
            for spread in (0.3, 0.52, 0.6, 1.1, 1.6)
        },
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
