"""One reading reproduces figure 12 to every printed digit, and Table 3's rules are applied to all three readings."""

import numpy as np
import pytest

from experiments.motor_paper.regression import (
    FLOW,
    READINGS,
    VELOCITY,
    anova,
    anova_table,
    circularity,
    decisions,
    fit,
    inflations,
    predictive_r_square,
    reading,
    residual_table,
)
from experiments.published import load
from plant.errors import HydrostateError


def test_every_number_of_figure_12_is_reproduced() -> None:
    table = anova_table()
    assert len(table) == 22
    assert table["relative_difference"].max() < 1e-6


def test_the_intervals_of_figure_12_are_those_of_its_regression() -> None:
    printed = [[-0.074924071, 0.07625904], [-0.001613371, 0.019799738], [2.389416288, 4.48304371]]
    assert fit(reading("anova")).conf_int().to_numpy() == pytest.approx(np.array(printed), rel=1e-6)


def test_no_other_reading_reproduces_figure_12() -> None:
    table = anova_table().set_index("quantity")
    for name in ("as_printed", "physical"):
        assert abs(table.loc["f", name] / table.loc["f", "published"] - 1.0) > 0.4, name


@pytest.mark.parametrize(
    ("name", "r_square", "f"),
    [("as_printed", 0.962842352, 38.86853971), ("physical", 0.990184678, 151.32228514)],
)
def test_the_other_readings_have_the_fits_of_the_errata(name: str, r_square: float, f: float) -> None:
    numbers = anova(fit(reading(name)))
    assert numbers["r_square"] == pytest.approx(r_square, rel=1e-8)
    assert numbers["f"] == pytest.approx(f, rel=1e-8)


def test_each_reading_changes_only_its_listed_cells() -> None:
    printed = load("table2")
    for name, changes in READINGS.items():
        changed = {(row, column) for row, column in np.argwhere((reading(name) != printed).to_numpy()).tolist()}
        assert changed == {(row, printed.columns.get_loc(column)) for row, column in changes}, name


def test_an_unknown_reading_is_refused() -> None:
    with pytest.raises(HydrostateError, match="one of as_printed, anova, physical, got 'best'"):
        reading("best")


def test_deformation_fails_the_rule_of_table_3_on_the_data_of_figure_12() -> None:
    table = decisions().set_index(["reading", "quantity"])
    assert table.loc[("anova", "P of deformation"), "decision"] == "remove"
    assert table.loc[("physical", "P of deformation"), "decision"] == "retain"
    assert table.loc[("anova", "adjusted R²"), "decision"] == "use for control"
    assert len(table) == 3 * 7


def test_regressors_are_not_redundant_and_predictions_are_worse_than_the_fit() -> None:
    assert inflations(fit(reading("anova")))[0] == pytest.approx(1.16, abs=0.005)
    assert predictive_r_square(fit(reading("anova"))) == pytest.approx(0.951, abs=5e-4)
    assert predictive_r_square(fit(reading("physical"))) == pytest.approx(0.933, abs=5e-4)


def test_residuals_are_those_of_least_squares() -> None:
    for _, rows in residual_table().groupby("reading"):
        residual = rows["residual"].to_numpy()
        assert abs(residual.sum()) < 1e-12
        assert abs(residual @ rows["velocity"].to_numpy()) < 1e-12
        assert rows["leverage"].sum() == pytest.approx(3.0)
        assert rows["percentile"].tolist() == pytest.approx([100.0 / 12.0 * (2 * k + 1) for k in range(6)])


def test_the_probability_output_shows_which_flow_was_fitted() -> None:
    table = residual_table()
    assert table.loc[table["reading"] == "anova", "sorted_flow"].tolist()[2] == 0.0868


def test_flow_and_velocity_are_the_same_data_and_the_claimed_fits_are_far_lower() -> None:
    table = circularity()
    assert table["r_square"].tolist()[0] > 0.99999
    claimed = table.loc[table["meaning"] == "what the text claims", "r_square"]
    assert claimed.tolist() == pytest.approx([0.729, 0.506], abs=5e-4)


def test_table_2_has_columns_for_flow_and_velocity() -> None:
    assert {FLOW, VELOCITY} <= set(load("table2").columns)
