"""Limits at which a pressure is said to be dead or clipped, kept in `numbers_clipping.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.log_checks import sensor_check
from plant.arrays import Array
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.log_checks.made_logs import (
    HEALTHY,
    PORTS,
    PRESSURE,
    ROWS,
    SPEED,
    N,
    T,
    accused,
    first_with,
    names,
    noise,
)
from tests.numbers import Numbers, told

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def pressures_that_show_nothing() -> dict[str, Any]:
    smooth = 1e5 * np.sin(0.05 * ROWS)
    return {
        "noise alone": accused(**{PRESSURE: noise(4e3)}),
        "noise beside a wave of, at most": edge(
            lambda one: len(accused(**{PRESSURE: noise(4e3) + one * smooth})), 1e-3, 1.0, 14
        ),
        "few samples": [names(**{PRESSURE: np.where(count > ROWS, noise(4e3), np.nan)}) for count in (19, 20, 21)],
        "a pump that stands": accused(**{PRESSURE: noise(4e3), SPEED: np.full(N, 5.0)}),
        "without a pump": accused(**{PRESSURE: noise(4e3), SPEED: None}),
    }


@NUMBERS.case()
def pressures_at_the_end_of_a_range() -> dict[str, Any]:
    base = 8e5 * np.sin(0.06 * ROWS) + noise(3e3)

    def cut(values: Array, **of: Any) -> Any:
        found, notes = sensor_check.without_saturated(Record(T, {PRESSURE: values}), replace(HEALTHY, **of))
        return [told(notes), int(np.isnan(found[PRESSURE]).sum())]

    def levels(values: Array, **of: Any) -> Any:
        return sensor_check._clipping_levels(values, replace(HEALTHY, **of), both=True)  # pyright: ignore[reportPrivateUsage]

    coarse = 2e4 * np.rint(base / 2e4)
    quiet = 8e5 * np.sin(0.06 * ROWS)
    slow = 8e5 * np.sin(0.011 * ROWS)
    ports = {PORTS[0]: 1e6 + np.minimum(base, 5e5), PORTS[1]: 1e6 - 0.5 * base}
    both = Record(T, {**ports, PRESSURE: ports[PORTS[0]] - ports[PORTS[1]]})
    cleaned, notes = sensor_check.without_saturated(both, HEALTHY)
    own, _ = sensor_check.without_saturated(both.replace(**{PRESSURE: base}), HEALTHY)
    return {
        "sound": [cut(base), cut(coarse), cut(quiet)],
        "clipped above": cut(np.minimum(base, 6e5)),
        "clipped on both sides": cut(np.clip(base, -5e5, 6e5)),
        "clipped, coarse": cut(np.clip(coarse, -5e5, 6e5)),
        "clipped, quiet": cut(np.minimum(quiet, 6e5)),
        "clipped once": [
            len(levels(np.where(ROWS < 60, np.minimum(base, limit), 0.2 * base))) for limit in (6e5, 7.5e5, 7.9e5)
        ],
        "clipped from [Pa]": edge(lambda one: len(levels(np.minimum(base, one))), 5e5, 8.2e5, 14),
        "clipped from [Pa], quiet": edge(lambda one: len(levels(np.minimum(quiet, one))), 5e5, 8.2e5, 14),
        "clipped from [Pa], slow": edge(lambda one: len(levels(np.minimum(slow, one))), 5e5, 8.2e5, 14),
        "at the relief valve, noisy": [
            len(levels(np.minimum(2e4 * np.rint(4.0 * base / 2e4), 2.4e6), relief_pressure=2.4e6 * one))
            for one in (0.97, 0.985, 1.0, 1.015, 1.03)
        ],
        "at the relief valve, flat": [
            len(levels(np.minimum(1e5 * np.rint(4.0 * quiet / 1e5), 2.4e6), relief_pressure=2.4e6 * one))
            for one in (0.9, 0.97, 0.985, 1.0, 1.015, 1.03, 1.1)
        ],
        "stays of": [len(levels(np.where(count > ROWS % 300, 9e5, base))) for count in (1, 2, 3, 4, 6, 8)],
        "samples": [len(levels(np.minimum(base, 3e5)[:count])) for count in (18, 19, 20, 21, 40)],
        "again, of a coarse one": [
            len(levels(np.minimum(q * np.rint(base / q), 6e5))) for q in (5e2, 5e3, 1e4, 2e4, 5e4, 1e5)
        ],
        "again, of a quiet coarse one": [
            len(levels(np.minimum(q * np.rint(slow / q), 7.9e5))) for q in (5e2, 5e3, 1e4, 2e4, 5e4, 1e5)
        ],
        "again, from a stay of": [
            first_with(
                lambda count, q=q: levels(np.where((ROWS > 300) & (300 + count > ROWS), 9e5, q * np.rint(base / q))),
                1,
                90,
            )
            for q in (1.0, 1e4, 4e4)
        ],
        "steps that bend, noise from [Pa]": edge(
            lambda one: len(
                levels(np.where((ROWS % 100 < 8), 9e5, 8.99e5 * np.cos(0.0126 * (ROWS % 100) * 5) + one * noise(1.0)))
            ),
            1.0,
            1e5,
            12,
        ),
        "heaped over those close by": edge(
            lambda one: len(
                levels(np.where((base > 5e5) & (one < ROWS % 97), 5.99e5 + noise(200.0), np.minimum(base, 6e5)))
            ),
            1.0,
            96.0,
            8,
        ),
        "a pressure that creeps there": len(levels(np.minimum(9e5 * (1.0 - np.exp(-(ROWS % 300) / 20.0)), 8.9999e5))),
        "around it": [
            cut(np.minimum(np.where(ROWS % 500 < 250, -3e5, 5.96e5) + noise(4e3), limit))[1] for limit in (5.9e5, 6e5)
        ],
        "of two ports": [told(notes), [int(np.isnan(cleaned[name]).sum()) for name in cleaned]],
        "beside a sensor of its own": [int(np.isnan(own[name]).sum()) for name in own],
        "lower end of a port": sensor_check._clipping_levels(np.maximum(base, -3e5), HEALTHY, both=False),  # pyright: ignore[reportPrivateUsage]
        "comes on the move": [
            sensor_check._moves(np.array(depth), 2.0)  # pyright: ignore[reportPrivateUsage]
            for depth in ([0.0, 1.0], [0.0, 1.0, 1.9], [0.0, 1.0, 2.1])
        ],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
