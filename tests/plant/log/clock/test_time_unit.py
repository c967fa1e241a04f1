import numpy as np
import pytest

from plant.log.clock.time_unit import likely_unit, usual_units


@pytest.mark.parametrize(
    ("step", "rows", "begin", "unit"),
    [
        (0.1, 600, 0.0, "s"),
        (0.1, 600, 1_000.0, "s"),
        (0.2, 600, 0.0, "s"),
        (0.5, 400, 0.0, "s"),
        (0.05, 900, 0.0, "s"),
        (0.1, 60_000, 0.0, "ms"),  # 10 kHz for 6 s, or 10 Hz for 100 minutes
        (1.0, 600, 0.0, "ms"),
        (10.0, 600, 0.0, "ms"),
        (1e-3, 600, 0.0, "s"),
        (1e-3 / 86_400.0, 600, 0.4, "d"),
    ],
)
def test_a_time_in_fractions_is_seconds_rather_than_a_very_short_log(
    step: float, rows: int, begin: float, unit: str
) -> None:
    assert likely_unit(begin + step * np.arange(float(rows))) == unit


@pytest.mark.parametrize("begin", [0.0, 1_000.0, 3_333.3])
def test_seconds_at_10_hz_stay_seconds_whatever_rounding_does_to_a_step(begin: float) -> None:
    times = begin + 0.1 * np.arange(60_000.0)
    for step in (0.09999999999990905, 0.1, 0.10000000000013642):
        assert usual_units(times, step)[0] == "s"


def test_a_time_without_a_usual_step_is_in_seconds() -> None:
    assert usual_units(np.zeros(5), 0.0) == ["s"]
    assert usual_units(np.arange(60_000.0) / 5.0, 0.2) == ["ms"]
    assert likely_unit(np.zeros(5)) is None


def test_a_time_of_day_as_a_fraction_of_it_is_in_days() -> None:
    rows = np.arange(600.0)
    assert usual_units(0.4271 + rows / 86.4e6, 1.0 / 86.4e6) == ["d"]
    assert usual_units(rows, 0.0) == ["ms"]
