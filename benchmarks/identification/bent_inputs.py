"""A dead zone, a saturation and a backlash at a plant's input: whether they are found, and interval coverage.

Each log has fresh inputs and noise. `identify_channels` is given the order of the linear part (2, one sample of dead
time) but nothing about the nonlinearity. `--order auto` leaves the order to the data as well, which takes longer.
"""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.targets import check_target, misses
from estimation.arrays import Array
from estimation.finding import NORMAL_95
from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.input_nonlinearity import NONLINEARITIES
from estimation.identification.model.recursion import filtered

SAMPLES = 1500
NOISE = 0.05
"""Standard deviation of the sensor's noise relative to that of the output."""

LEVEL, OFFSET = 2.0, 5.0
"""Mean level of the input, and output at rest [their units]."""


@dataclass(frozen=True)
class PlantedNonlinearity:
    """A nonlinearity with its values in units of the input."""

    kind: str
    values: Mapping[str, float]
    drive: Callable[[np.random.Generator], Array]


def _steps(rng: np.random.Generator) -> Array:
    return np.repeat(rng.normal(size=SAMPLES // 10), 10)


def _slow_noise(rng: np.random.Generator) -> Array:
    slow = filtered([1.0], [1.0, -0.95], rng.normal(size=SAMPLES))
    return slow / slow.std()


PLANTED_NONLINEARITIES = (
    PlantedNonlinearity("dead-zone", {"lower": LEVEL - 0.4, "upper": LEVEL + 0.6}, _steps),
    PlantedNonlinearity("saturation", {"lower": LEVEL - 1.0, "upper": LEVEL + 0.8}, _steps),
    PlantedNonlinearity("backlash", {"half_width": 0.3}, _slow_noise),
)


def draw_log(planted: PlantedNonlinearity, seed: int) -> Channels:
    """Return a log of one plant."""
    rng = np.random.default_rng([seed, PLANTED_NONLINEARITIES.index(planted)])
    u = LEVEL + planted.drive(rng)
    bent, _ = NONLINEARITIES[planted.kind].apply(u, np.array(list(planted.values.values())), float(u[0]))
    y = filtered([0.0, 0.1, 0.05], [1.0, -1.6, 0.75], bent)[100:]
    noisy = OFFSET + y + NOISE * y.std() * rng.normal(size=y.size)
    return channels_from([u[100:, None]], [noisy], 0.01, ["u"], "y")


def main(arguments: list[str] | None = None) -> int:
    """Count what is found and covered; return how many targets are missed."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seeds", type=int, default=100)
    options.add_argument("--order", default="2")
    chosen = options.parse_args(arguments)
    form: dict[str, Any] = {} if chosen.order == "auto" else {"order": int(chosen.order), "delay": 1}
    misses.clear()
    for planted in PLANTED_NONLINEARITIES:
        found = [_scaled_errors(planted, seed, form) for seed in range(chosen.seeds)]
        hits = {name: np.array([one[name] for one in found if one]) for name in planted.values}
        check_target(f"{planted.kind}: found [%]", 100.0 * sum(map(bool, found)) / chosen.seeds, 100.0, most=False)
        for name, scores in hits.items():
            covered = 100.0 * float(np.mean(np.abs(scores) <= NORMAL_95))
            print(f"{planted.kind}, {name}: error over its deviation {scores.mean():.2f} +- {scores.std():.2f}")
            check_target(f"{planted.kind}, {name}: intervals that cover [%]", covered, 90.0, most=False)
            check_target(f"{planted.kind}, {name}: intervals that cover [%]", covered, 98.0)
    return len(misses)


def _scaled_errors(planted: PlantedNonlinearity, seed: int, form: Mapping[str, Any]) -> dict[str, float]:
    """Return the errors divided by their standard deviations; empty if another kind is found."""
    model = identify_channels(draw_log(planted, seed), structure="hammerstein", **form).model
    if not isinstance(model.dynamics, HammersteinDynamics) or model.dynamics.at_input != planted.kind:
        return {}
    said = model.dynamics.nonlinearity(model.scaling)
    return {
        name: (said[name]["value"] - value) / (said[name]["std"] or np.inf) for name, value in planted.values.items()
    }
