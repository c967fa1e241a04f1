"""Which statements of the diaphragm-motor paper's tables hold, and which do not."""

from typing import get_args

import pytest

from experiments.motor_paper.regression import reading
from experiments.motor_paper.tables import (
    efficiency,
    efficiency_readings,
    published_motor,
    relations,
    table_1,
    table_2,
    table_4,
    table_5,
)
from experiments.published import MotorTableName, load


def test_every_table_of_the_motor_can_be_loaded() -> None:
    assert all(len(load(name)) for name in get_args(MotorTableName))


def test_the_efficiency_is_0_850_in_the_one_reading_that_works() -> None:
    found = efficiency(reading("physical"))
    assert found.mean() == pytest.approx(0.850, abs=5e-4)
    assert found.std() < 1e-3 * found.mean()


def test_no_other_reading_has_one_efficiency_of_0_850() -> None:
    table = efficiency_readings().set_index("reading")
    works = (table["variation_percent"] < 0.1) & ((table["mean"] - 0.850).abs() < 1e-3)
    assert works.tolist() == [True, False, False, False, False]


def test_printed_errors_of_table_4_are_relative_to_the_flow_meter() -> None:
    table = table_4()
    assert table["error_by_flowmeter_percent"].round(2).tolist() == table["error_percent"].tolist()
    assert (table["error_by_theory_percent"].round(2) != table["error_percent"]).all()


def test_the_theoretical_flow_of_table_4_fits_one_piston_area_except_in_row_1() -> None:
    table = table_4()
    off = (table["theory_ml_per_min"] / table["theoretical_flow_ml_per_min"] - 1.0).abs()
    assert off.tolist()[0] > 0.01
    assert (off[1:] < 1e-4).all()


def test_table_2_satisfies_equations_17_and_18_and_neither_14_nor_15() -> None:
    holds = relations().set_index("relation")["holds"]
    assert holds[[name for name in holds.index if "equation 17" in name or "equation 18" in name]].all()
    assert not holds[[name for name in holds.index if "equation 14" in name or "equation 15" in name]].any()


def test_equation_18_gives_one_piston_area_except_in_row_4() -> None:
    area = table_2().set_index("row")["piston_area_cm2"]
    assert area.drop(4).tolist() == pytest.approx([3.7934] * 5, rel=1e-4)
    assert area[4] / 3.7934 - 1.0 == pytest.approx(-0.0024, abs=1e-4)


def test_blocking_forces_of_tables_2_and_5_differ_by_ten() -> None:
    assert table_2()["force_ratio"].tolist() == pytest.approx([10.0] * 6)


def test_the_published_velocity_does_not_follow_from_the_published_flow() -> None:
    velocity, piston, pressure = published_motor()["value"].tolist()
    assert velocity == pytest.approx(4.84, abs=0.01)
    assert piston == pytest.approx(10.9, abs=0.05)
    assert pressure == pytest.approx(12.9, abs=0.05)


def test_tables_1_and_5_are_shown_as_printed() -> None:
    assert table_1().drop(columns="remark").equals(load("table1_geometry"))
    assert table_5().drop(columns="most_power_w").equals(load("table5_actuators"))
