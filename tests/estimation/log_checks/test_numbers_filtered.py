"""Limits at which noise counts as filtered, and how many rows are then left out, kept in `numbers_filtered.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.log_checks import filtered
from plant.arrays import Array
from plant.log.record import Record
from tests.edges import edge
from tests.estimation.log_checks.made_logs import PORTS, POSITION, PRESSURE, noise
from tests.numbers import Numbers, told

NUMBERS = Numbers(__file__)


def averaged(rows: int, count: int = 20_000) -> Array:
    return np.convolve(noise(1e5, count + rows - 1), np.ones(rows) / rows, "valid")


def alike(correlation: float, count: int) -> Array:
    """Return noise whose neighbouring samples share a part."""
    white = noise(1.0, count + 1)
    return white[1:] + correlation * white[:-1]


@NUMBERS.case()
def noise_that_was_filtered() -> dict[str, Any]:
    rows = filtered.independent_rows
    windows = filtered.windows_of(alike(0.4, 2000))
    straight = np.linspace(-40.0, 60.0, filtered.WINDOW)
    holed = averaged(4, 4000)
    holed[[700, 701, 2000]] = np.nan
    return {
        "averages": [rows(averaged(count), 1e-4) for count in (1, 2, 3, 5, 8, 20, 33, 36, 45)],
        "averages of a slow log": [rows(averaged(3), 1.0 / rate) for rate in (599.0, 610.0, 740.0, 760.0, 1000.0)],
        "powers [unit squared]": filtered._powers(windows),  # pyright: ignore[reportPrivateUsage]
        "of an even and an odd count": [filtered._powers(windows[:count]) for count in (8, 9)],  # pyright: ignore[reportPrivateUsage]
        "beside a straight line": filtered._powers(windows + straight),  # pyright: ignore[reportPrivateUsage]
        "flatness": [filtered.flatness(one) for one in (windows, 0.0 * windows, windows[:1])],
        "windows": [
            len(filtered.windows_of(values)) for values in (holed, holed[:63], holed[:64], holed[:95], holed[:96])
        ],
        "white up to a correlation of": [
            edge(lambda one, count=count: filtered.is_white(alike(one, count)), 0.0, 0.9, 16)
            for count in (287, 288, 1000, 2000, 5000, 60_000)
        ],
        "variance": [filtered.independent_variance(one) for one in (averaged(1), holed, holed[:287], holed[:300])],
    }


@NUMBERS.case()
def logs_of_which_samples_are_left_out() -> dict[str, Any]:
    record = Record(1e-3, {POSITION: averaged(4, 3000), PRESSURE: averaged(4, 3000), PORTS[0]: noise(1e5, 3000)})
    found, notes = filtered.without_correlated_noise(record)
    return {
        "notes": told(notes),
        "kept": {name: np.flatnonzero(np.isfinite(found[name]))[[0, 1, -1]] for name in found},
        "from noise of [Pa]": edge(
            lambda size: bool(
                filtered.without_correlated_noise(Record(1e-3, {PRESSURE: 1e-5 * size * averaged(4, 3000)}))[1]
            ),
            1.0,
            1e5,
            30,
        ),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
