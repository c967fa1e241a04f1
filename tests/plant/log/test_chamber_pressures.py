"""The pressures of both chambers give the differential pressure; one alone does not."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from plant.errors import LogError
from plant.log.chamber_pressures import (
    CHAMBERS,
    PRESSURE,
    has_pressure_difference,
    require_one_reference,
    with_pressure_difference,
)
from plant.log.files import read_record

A, B = (np.array([3.0, 5.0, 8.0]), np.array([1.0, 1.0, np.nan]))
BOTH = dict(zip(CHAMBERS, (A, B), strict=True))


def test_both_chambers_give_their_difference_as_the_last_channel() -> None:
    found = with_pressure_difference(BOTH)
    assert list(found) == [*CHAMBERS, PRESSURE]
    np.testing.assert_array_equal(found[PRESSURE], [2.0, 4.0, np.nan])


def test_a_logged_differential_pressure_is_kept_and_one_chamber_pressure_adds_none() -> None:
    logged = {**BOTH, PRESSURE: np.zeros(3)}
    alone = {CHAMBERS[0]: A}
    assert with_pressure_difference(logged) is logged
    assert with_pressure_difference(alone) is alone
    assert [has_pressure_difference(one) for one in (BOTH, logged, alone, {})] == [True, True, False, False]


@pytest.mark.parametrize(("a", "b"), [("psig", "psia"), ("bar(a)", "bar"), ("-MPa abs", "kPa")])
def test_one_absolute_pressure_is_refused_with_what_takes_the_atmosphere_off(a: str, b: str) -> None:
    with pytest.raises(LogError, match=r"count from one zero, .* --columns 'pressure_._pa=.:1 \w+ - 1.013 bar'"):
        require_one_reference(dict(zip(CHAMBERS, (a, b), strict=True)), dict(zip(CHAMBERS, "AB", strict=True)), "a.csv")


@pytest.mark.parametrize(("a", "b"), [("psia", "bar abs"), ("barg", "bar"), ("", "bar"), ("1 psi - 1.013 bar", "psig")])
def test_pressures_that_count_from_one_zero_are_taken(a: str, b: str) -> None:
    require_one_reference(dict(zip(CHAMBERS, (a, b), strict=True)), dict(zip(CHAMBERS, "AB", strict=True)), "a.csv")


def test_the_refusal_of_one_absolute_pressure_is_settled_by_its_own_option(tmp_path: Path) -> None:
    rows = np.arange(50.0)
    bar, atmosphere = 5.0 + np.sin(rows), 1.013
    log = {"time_s": 1e-3 * rows, "motor_speed_rad_s": rows, "position_m": 1e-3 * rows}
    log |= {"Pressure A [barg]": bar, "Pressure B [bara]": 2.0 + atmosphere + 0.0 * rows}
    pd.DataFrame(log).to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError) as refused:
        read_record(tmp_path / "log.csv")
    channel, _, spec = str(refused.value).rpartition("--columns '")[2].rstrip("'").partition("=")
    record = read_record(tmp_path / "log.csv", columns={channel: spec})
    np.testing.assert_allclose(record[PRESSURE], 1e5 * (bar - 2.0), rtol=1e-12)
