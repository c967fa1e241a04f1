"""Tests of MATLAB structs, in the ways in which users put logs into them."""

from typing import Any

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.formats.mat import tables_of
from plant.log.tables import gather_channels

TIME = 0.01 * np.arange(50)
SPEED, WAY = 10.0 * TIME, 2.0 * TIME


def names(content: Any) -> dict[str, list[str]]:
    return {table.label: [one.name for one in table.headings] for table in tables_of(content, "a.mat")}


def read(content: Any) -> Any:
    return gather_channels(tables_of(content, "a.mat"), None, (), "a.mat").columns


def test_a_nested_struct_with_its_own_time_is_a_table() -> None:
    rod = {"time_s": TIME[::2], "position_m": WAY[::2]}
    test = {"bench": "2", "motor": {"time_s": TIME, "motor_speed_rad_s": SPEED}, "rod": rod}
    assert names({"test": test}) == {
        "test.motor": ["time_s", "motor_speed_rad_s"],
        "test.rod": ["time_s", "position_m"],
    }
    np.testing.assert_allclose(read({"test": test})["position_m"][::2], WAY[:-1:2])


@pytest.mark.parametrize("timed", [True, False])
def test_an_array_of_signal_structs_gives_a_column_with_unit_for_each(timed: bool) -> None:
    own = {"time_s": TIME} if timed else {}
    signals = [
        {"Name": "motor speed", "Unit": "rpm", "Data": SPEED, **own},
        {"Name": "position", "Unit": "mm", "Data": WAY, **own},
    ]
    found = read({"signals": signals} if timed else {"signals": signals, "time_s": TIME})
    np.testing.assert_allclose(found["position_m"], 1e-3 * WAY)
    np.testing.assert_allclose(found["motor_speed_rad_s"], SPEED * np.pi / 30.0)


def test_two_signals_with_the_same_name_are_refused() -> None:
    signals = [{"name": "position_m", "data": WAY}, {"name": "position_m", "data": SPEED}]
    with pytest.raises(LogError, match="'signals' and 'signals\\(2\\)' both give position_m"):
        read({"signals": signals, "time_s": TIME})


def test_an_array_of_one_struct_per_sample_is_a_table() -> None:
    rows = [
        {"time_s": np.array([t]), "position_m": np.array([[w]]), "said": "ok"} for t, w in zip(TIME, WAY, strict=True)
    ]
    np.testing.assert_allclose(read({"rows": rows})["position_m"], WAY)


def test_an_array_of_tests_is_a_table_each() -> None:
    one = {"time_s": TIME, "position_m": WAY}
    assert names({"log": [one, one]}) == {f"log({place})": ["time_s", "position_m"] for place in (1, 2)}
