"""Noise and gaps as a log shows them, kept in `numbers_noise.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.log_checks import bridging, measurement_noise
from estimation.log_checks.first_belief import begins_in_motion, first_belief, first_load
from estimation.log_checks.order import median, percentile
from estimation.models.chambers import CHAMBERS
from estimation.models.eha_forms import ACCELERATION_FORM, PRESSURE_FORM
from plant.arrays import Array
from plant.errors import HydrostateError
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.log_checks.made_logs import (
    HEALTHY,
    LOG,
    POSITION,
    PRESSURE,
    ROWS,
    SPEED,
    VELOCITY,
    N,
    T,
    gone,
    noise,
)
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def noise_of_sensors() -> dict[str, Any]:
    variances = measurement_noise.measurement_variances
    of_position = measurement_noise.position_variance
    wave = 0.1 * np.sin(0.03 * ROWS)
    steps = {
        f"rounded to {q:g} deviations": q * 1e-3 * np.rint((wave + noise(1e-3)) / (q * 1e-3))
        for q in (0.1, 1.0, 3.0, 12.0)
    }
    shown = {
        "white": wave + noise(1e-3),
        "smooth": wave,
        "still": np.ones(N),
        "walked": 1e-4 * np.floor(0.3 * ROWS),
        **steps,
        "every third": np.where(ROWS % 3 == 0, wave + noise(1e-3), np.nan),
        "struck": wave + noise(1e-3) + np.where(ROWS % 40 == 0, 0.5, 0.0),
    }
    grouped = measurement_noise._grouped_median  # pyright: ignore[reportPrivateUsage]
    return {
        **{
            name: [variances(Record(T, {"x": values}), ("x",))["x"], of_position(values)]
            for name, values in shown.items()
        },
        "least": variances(
            Record(T, dict.fromkeys((POSITION, VELOCITY, PRESSURE), np.ones(9))), (POSITION, VELOCITY, PRESSURE)
        ),
        "of few": [
            [variances(Record(T, {"x": wave[:count]}), ("x",))["x"], of_position(wave[:count])]
            for count in (1, 2, 3, 6, 7, 8)
        ],
        "windows": [
            of_position(noise(1e-4, count) * (1.0 + np.arange(count) / 200.0)) for count in (199, 399, 410, 605, 806)
        ],
        "medians within a step": [
            grouped(np.array(sizes), step)
            for sizes, step in (
                ([0.0, 1.0, 1.0, 2.0, 3.0], 1.0),
                ([0.0, 0.0, 0.0, 1.0], 1.0),
                ([1.0, 1.2, 1.3, 2.0], 1.0),
                ([1.0, 1.5, 2.0], np.inf),
                ([0.26, 0.26, 0.26], 1.0),
                ([0.24, 0.24, 0.24], 1.0),
                ([2.0, 2.0, 2.0, 3.0, 3.0], 1.0),
                ([1.0, 2.0, 3.0, 4.0], 1.0),
            )
        ],
        "smallest steps": [
            measurement_noise._step(np.array(one))
            for one in ([0.0, 1e-13, 1.0], [0.0, 0.9e-12, 1.0], [0.0, 1.1e-12, 1.0], [2.0, 2.0], [0.0, 1.0, 1.5])
        ],  # pyright: ignore[reportPrivateUsage]
        "quanta": [
            measurement_noise._quantum(np.array(one))
            for one in ([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 3.0], [1.0, 1.0, 1.0], [0.0, 0.0, 2.0])
        ],  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case()
def gaps_that_are_bridged() -> dict[str, Any]:
    speed = np.where(np.isin(np.arange(40), [0, 1, 9, 10, 11, 20, 38, 39]), np.nan, 3.0 * np.sin(0.5 * np.arange(40)))
    slow = np.where(np.arange(40) % 4 == 1, speed, np.nan)
    none = np.full(5, np.nan)
    record = Record(T, {SPEED: speed, POSITION: speed, PRESSURE: np.zeros(40)})

    def opened(model: Any, one: Record) -> Any:
        found, drives, comparable = bridging.with_gap_uncertainty(model, one, HEALTHY)
        return {
            "drives": list(found.drives),
            "sums": drives.sum(axis=0),
            "some": drives[9],
            "comparable": np.flatnonzero(~comparable),
        }

    def refused(values: Array) -> Any:
        try:
            return bridging.bridged(values)
        except HydrostateError as error:
            return str(error)

    return {
        "bridged": bridging.bridged(speed)[[0, 1, 9, 10, 11, 39]],
        "of one": bridging.bridged(gone(none + 0.0, 0) if False else np.array([np.nan, 2.0, np.nan])),
        "none": refused(none),
        "gaps": [
            [one.tolist() for one in bridging.gaps(values)] for values in (speed[:14], slow, np.array([np.nan, 1.0]))
        ],
        "wide from": edge(
            lambda one: bool(
                bridging.gaps(np.where(np.isin(np.arange(90), [*range(0, 40, 4), 36 + round(one)]), 1.0, np.nan))[1][-1]
            ),
            4.0,
            12.0,
            6,
        ),
        "filled": [
            [bridging.bridged_slow_channel(values)[0], bridging.bridged_slow_channel(values)[1]]
            for values in (
                speed[:14],
                slow,
                np.array([1.0, np.nan, 3.0]),
                np.array([1.0, np.nan, 2.0, np.nan, np.nan, np.nan, np.nan, 3.0, np.nan]),
                np.array([np.nan, 1.0]),
                np.where(ROWS[:40] % 5 < 2, speed, np.nan),
            )
        ],
        "unknown angle [rad^2]": [bridging.angle_variance(values, T) for values in (speed, slow)],
        "unknown path [m^2]": [bridging.path_variance(values, T) for values in (speed, slow)],
        "of two and of one sample": [
            bridging.angle_variance(np.array([1.0, np.nan, 2.0]), T),
            bridging.angle_variance(np.array([np.nan, 1.0, np.nan]), T),
            bridging.angle_variance(np.ones(3), T),
            bridging.path_variance(np.ones(3), T),
        ],
        "pressure form": opened(PRESSURE_FORM, record),
        "flow form": opened(CHAMBERS, record),
        "pressure form, whole": opened(PRESSURE_FORM, record.replace(**{SPEED: np.ones(40)})),
        "pressure form, slow": opened(PRESSURE_FORM, record.replace(**{SPEED: slow})),
    }


@NUMBERS.case()
def first_beliefs_and_order() -> dict[str, Any]:
    def loaded(first: float, size: float = 1e4, **given: Any) -> float:
        return first_load(Record(T, {PRESSURE: first + noise(size, 200)}), **given)

    belief = first_belief(PRESSURE_FORM, LOG, 1.5e8, 3e8)
    still = first_belief(
        PRESSURE_FORM, Record(T, {SPEED: np.ones(4), PRESSURE: np.array([np.nan, 4e5, 1.0, 2.0])}), 1.5e8, 3e8
    )
    values = noise(1.0, 11)
    return {
        "mean": belief.mean,
        "deviations": np.sqrt(np.diag(belief.covariance)),
        "mean, without a position": still.mean,
        "load from [Pa]": edge(lambda one: loaded(one) == 0.0, 1e3, 5e5),
        "load from [Pa], quiet": edge(lambda one: loaded(one, 0.0) == 0.0, 1e3, 5e5),
        "load from [Pa], of known noise": edge(
            lambda one: loaded(one, 0.0, variances={PRESSURE: 1e8}) == 0.0, 1e3, 5e5
        ),
        "against": loaded(-5e5),
        "of an acceleration form": np.sqrt(np.diag(first_belief(ACCELERATION_FORM, LOG, 1.5e8, 2e8).covariance)),
        "nothing logged": first_belief(PRESSURE_FORM, Record(T, {POSITION: np.full(3, np.nan)}), 1e8, 1e8).mean,
        "in motion from": edge(
            lambda one: begins_in_motion(Record(T, {SPEED: np.where(np.arange(99) == 0, -one, 10.0)})), 0.1, 9.0
        ),
        "at rest": [
            begins_in_motion(Record(T, {SPEED: values}))
            for values in (np.zeros(9), np.where(np.arange(9) > 3, 1.0, 0.0), np.array([0.5, 0.5, np.nan]))
        ],
        "medians": [median(values[:count]) for count in (1, 2, 3, 4, 11)],
        "percentiles": [percentile(values, percent) for percent in (0.0, 3.0, 33.0, 50.0, 67.0, 95.0, 100.0)],
        "percentiles of far numbers": [
            percentile(np.array([1.0, 1e17]), percent) for percent in (1e-15, 100.0 - 1e-13)
        ],
        "percentiles, as NumPy gives them": [
            percentile(values, percent) - float(np.percentile(values, percent)) for percent in (3.0, 38.0, 77.0)
        ],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
