"""The published tables load as printed, agree with the parameters, and support the errata."""

from dataclasses import FrozenInstanceError, replace
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest

from experiments import published
from experiments.published import SCALARS, TableName, load
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.units import conversion_to

CONDITIONS = tuple(load("conditions")["condition"])


@pytest.mark.parametrize("name", ["conditions", "rmse", "transfer_functions"])
def test_tables_by_condition_have_exactly_the_nine_conditions(name: TableName) -> None:
    table = load(name)
    assert len(table) == 9
    assert set(table["condition"]) == set(CONDITIONS)


def test_conditions_are_the_product_of_leakage_and_friction() -> None:
    levels = load("leakage")["leakage"].tolist(), load("friction")["friction"].tolist()
    assert levels == (["none", "minor", "major"],) * 2
    pairs = load("conditions")[["leakage", "friction"]]
    assert set(pairs.itertuples(index=False, name=None)) == {(a, b) for a in levels[0] for b in levels[1]}


def test_default_parameters_are_those_of_tables_2_to_4() -> None:
    printed = load("parameters").set_index("name")["value"]
    leakage = load("leakage").set_index("leakage").loc["none"]
    friction = load("friction").set_index("friction").loc["none"]
    by_name = {name: printed[name] for name in printed.index if name in EhaParameters.__dataclass_fields__}
    assert len(by_name) == 7
    from_tables = replace(
        EhaParameters(),
        **by_name,
        leakage_coefficient=leakage["leakage_coefficient_m3_per_s_pa"],
        flow_bias=leakage["flow_bias_m3_per_s"],
        friction_quadratic=friction["a1_n_s2_per_m2"],
        friction_linear=friction["a2_n_s_per_m"],
        friction_coulomb=friction["a3_n"],
    )
    assert from_tables == EhaParameters()


def test_a_table_is_a_fresh_copy_at_each_call() -> None:
    table = load("rmse")
    table["condition"] = "spoiled"
    assert "spoiled" not in set(load("rmse")["condition"])


def test_an_unknown_table_is_refused_by_name() -> None:
    with pytest.raises(HydrostateError, match=r"one of conditions, parameters, .*, got 'table7'"):
        load("table7")  # pyright: ignore[reportArgumentType] - the refusal is the claim


@pytest.mark.parametrize("name", SCALARS)
def test_a_scalar_in_si_units_is_the_converted_printed_value(name: str) -> None:
    scalar = SCALARS[name]
    factor, offset = conversion_to(scalar.unit, scalar.si_unit)
    assert scalar.si_value == pytest.approx(scalar.value * factor + offset, rel=1e-12)
    assert scalar.where.startswith("section")


def test_scalars_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        SCALARS["bandwidth"].value = 30.0  # pyright: ignore[reportAttributeAccessIssue] - frozen is the claim
    with pytest.raises(TypeError):
        SCALARS["bandwidth"] = SCALARS["bulk_modulus"]  # pyright: ignore[reportIndexIssue] - likewise


def _dc_gain_intervals(table: pd.DataFrame) -> pd.DataFrame:
    """Return the range of the gains at z = 1, given Table 6's four significant digits (errata E14)."""
    printed = table.set_index("condition")
    half_digit = printed.map(lambda value: 0.5 * 10.0 ** (np.floor(np.log10(abs(value))) - 3.0))
    numerator, denominator = ["b0", "b1", "b2"], ["a1", "a2"]
    top, top_slack = printed[numerator].sum(axis=1), half_digit[numerator].sum(axis=1)
    bottom, bottom_slack = 1.0 + printed[denominator].sum(axis=1), half_digit[denominator].sum(axis=1)
    least, most = (top - top_slack) / (bottom + bottom_slack), (top + top_slack) / (bottom - bottom_slack)
    return pd.DataFrame({"least": least, "most": most})


def test_rounding_leaves_the_normal_dc_gain_uncertain_by_a_factor_of_twenty() -> None:
    intervals = _dc_gain_intervals(load("transfer_functions"))
    assert intervals.loc["normal"].to_numpy() == pytest.approx([0.32e-4, 7.8e-4], rel=0.02)
    others = intervals.drop("normal")
    assert (others["most"] < 3.0 * others["least"]).all()


def test_published_dc_gains_need_an_input_in_radians_a_second() -> None:
    ideal = EhaParameters().pump_displacement / EhaParameters().piston_area
    table = load("transfer_functions")
    gains = table[["b0", "b1", "b2"]].sum(axis=1) / (1.0 + table[["a1", "a2"]].sum(axis=1))
    per_rad_s = gains.to_numpy() / ideal
    assert np.all((per_rad_s > 0.25) & (per_rad_s < 1.0))
    assert np.all(per_rad_s / conversion_to("rpm", "rad/s")[0] > 2.0)


def test_eight_published_models_do_not_roll_off() -> None:
    table = load("transfer_functions")
    gains = table[["b0", "b1", "b2"]].sum(axis=1) / (1.0 + table[["a1", "a2"]].sum(axis=1))
    jump = (table["b0"] / gains).set_axis(table["condition"])
    assert jump.pop("minor_leakage") < 0.02
    assert jump.between(0.79, 1.93).all()


AS_TYPED = {
    "eha_scalars.csv": "5406ae193d9948ae",
    "eha_table1_conditions.csv": "da4e0d79ad48cfd8",
    "eha_table2_parameters.csv": "8d536a37b27df639",
    "eha_table3_leakage.csv": "1eec74bbe7081e84",
    "eha_table4_friction.csv": "ddc8282b2be7549e",
    "eha_table5_rmse.csv": "cb5473d7b9b55d0f",
    "eha_table6_transfer_functions.csv": "a6a8496a78946208",
    "motor_fig12_anova.csv": "ee216c3dbb8c23f6",
    "motor_table1_geometry.csv": "74445d4d1bc04253",
    "motor_table2.csv": "063de2be7cc94762",
    "motor_table4_flow.csv": "c6edc73105a62f41",
    "motor_table5_actuators.csv": "01ec1c543a80babe",
}
"""First 16 digits of the SHA-256 of each published table as it was typed from the paper and proofread."""


def test_the_files_of_the_published_tables_are_unchanged() -> None:
    found = {
        path.name: sha256(path.read_bytes()).hexdigest()[:16] for path in Path(str(files(published))).glob("*.csv")
    }
    assert found == AS_TYPED


def test_table_5_has_the_printed_digits() -> None:
    table = load("rmse").set_index("condition")
    in_tenths_of_a_millimetre = (1e4 * table).round(9)
    assert in_tenths_of_a_millimetre["rmse_system_id_m_per_s"].tolist() == [23, 23, 35, 27, 44, 18, 12, 32, 29]
    assert in_tenths_of_a_millimetre["rmse_mathematical_m_per_s"].tolist() == [15, 18, 14, 11, 13, 13, 11, 7, 11]


def test_published_mathematical_models_have_the_smaller_error_in_every_condition() -> None:
    table = load("rmse")
    assert (table["rmse_mathematical_m_per_s"] < table["rmse_system_id_m_per_s"]).all()


def test_the_quoted_normal_pressure_occurs_at_3_49_v() -> None:
    p = EhaParameters()
    drop = SCALARS["normal_differential_pressure"].si_value
    push = p.piston_area * drop - p.friction_coulomb
    root = np.sqrt(p.friction_linear**2 + 4.0 * p.friction_quadratic * push)
    velocity = (root - p.friction_linear) / (2.0 * p.friction_quadratic)
    flow = p.piston_area * velocity + p.leakage_coefficient * drop + p.flow_bias
    assert flow / p.pump_displacement / p.motor_speed_per_volt == pytest.approx(3.49, abs=0.005)


def test_every_table_is_named_once() -> None:
    assert len({tuple(load(name).columns) for name in get_args(TableName)}) == 6
