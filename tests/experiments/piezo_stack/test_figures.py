"""The stack's figures show the content of its tables, and its tables that of the runs."""

from collections.abc import Mapping

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.page.frames import Tables
from experiments.page.style import project_style
from experiments.piezo_stack.card import SENSOR_SETS
from experiments.piezo_stack.figures import STACK_FIGURES
from experiments.piezo_stack.flow import LIMITS, LOOP_FREQUENCIES, best_points
from plant.units import LITRE_PER_MINUTE


@pytest.fixture(scope="module")
def drawn(stack_tables: Tables) -> Mapping[str, Figure]:
    with project_style():
        return {name: draw(stack_tables) for name, draw in STACK_FIGURES.items()}


def test_figure_10_has_one_loop_per_frequency_and_a_curve_of_their_widths(
    stack_tables: Tables, drawn: Mapping[str, Figure]
) -> None:
    left, right = drawn["figure_10"].axes
    assert [line.get_label() for line in left.lines] == [f"{f:g} Hz" for f in LOOP_FREQUENCIES]
    widths = stack_tables["figure 10 loop widths"]["width_percent"]
    assert np.asarray(right.lines[0].get_ydata()).tolist() == widths.tolist()
    assert widths.iloc[0] < widths.iloc[-1]


@pytest.mark.parametrize(
    ("figure", "panel", "table", "by"),
    [
        ("figures_11_and_12", 0, "figure 11 flow over bias pressure", "bias_pressure_pa"),
        ("figures_11_and_12", 1, "figure 12 flow over voltage", "voltage_v"),
        ("figures_13_and_14", 0, "figure 13 flow with fixed weight", "load_kg"),
        ("figures_13_and_14", 1, "figure 14 flow over load", "frequency_hz"),
    ],
)
def test_flows_are_drawn_in_litres_per_minute_with_one_curve_per_setting(
    figure: str, panel: int, table: str, by: str, stack_tables: Tables, drawn: Mapping[str, Figure]
) -> None:
    curves = [line for line in drawn[figure].axes[panel].lines if line.get_marker() == "o"]
    for line, (_, rows) in zip(curves, stack_tables[table].groupby(by), strict=True):
        assert np.asarray(line.get_ydata()) == pytest.approx(rows["flow_m3_s"].to_numpy() / LITRE_PER_MINUTE)


def test_the_flow_that_the_paper_quotes_is_marked_within_its_panel(drawn: Mapping[str, Figure]) -> None:
    for name, panel, flow in (
        ("figures_11_and_12", 0, 1.6),
        ("figures_11_and_12", 1, 1.6),
        ("figures_13_and_14", 0, 1.0),
    ):
        axis = drawn[name].axes[panel]
        (mark,) = (line for line in axis.lines if line.get_label() == "quoted by the paper")
        assert np.asarray(mark.get_ydata()).tolist() == [flow]
        assert flow < axis.get_ylim()[1]


def test_stages_of_the_pump_cycle_are_shaded_in_every_panel_and_named_in_the_first(
    stack_tables: Tables, drawn: Mapping[str, Figure]
) -> None:
    first, *others = drawn["pump_cycle"].axes
    stage = stack_tables["pump cycle"]["stage"]
    changes = int((stage != stage.shift()).sum())
    assert [len(axis.patches) for axis in drawn["pump_cycle"].axes] == [changes] * 3
    assert {text.get_text() for text in first.texts} == {"compression", "discharge", "expansion", "intake"}
    assert not any(axis.texts for axis in others)


def test_the_part_that_limits_the_flow_most_is_at_the_top(stack_tables: Tables, drawn: Mapping[str, Figure]) -> None:
    (axis,) = drawn["limits"].axes
    names = [label.get_text() for label in axis.get_yticklabels()]
    assert sorted(names) == sorted(LIMITS)
    table = stack_tables["what limits the flow"].set_index("part").abs().max(axis=1)
    assert names[-1] == table.idxmax()
    assert table.loc[names].is_monotonic_increasing


def test_design_maps_share_one_colour_scale_and_name_their_bias_pressures(drawn: Mapping[str, Figure]) -> None:
    *maps, scale = drawn["design_maps"].axes
    assert [axis.get_title("left") for axis in maps] == ["bias pressure 0.6 MPa", "bias pressure 1 MPa", "", ""]
    limits = {axis.collections[0].get_clim() for axis in maps}
    assert len(limits) == 1
    assert scale.get_ylim()[0] == 0.0


def test_best_points_satisfy_both_limits_and_have_the_largest_flow_within_them(stack_tables: Tables) -> None:
    design = stack_tables["design map"]
    power = float(design["stack_power_w"].median())
    best = best_points(design, 120.0, power)
    assert len(best) > 0
    assert best["voltage_v"].max() <= 120.0
    assert best["stack_power_w"].max() <= power
    allowed = design[(design["voltage_v"] <= 120.0) & (design["stack_power_w"] <= power) & (design["flow_m3_s"] > 0.0)]
    for (bias, load), rows in allowed.groupby(["bias_pressure_pa", "load_kg"]):
        mine = best[(best["bias_pressure_pa"] == bias) & (best["load_kg"] == load)]
        assert mine["flow_m3_s"].tolist() == [rows["flow_m3_s"].max()]


def test_all_four_sensors_are_never_less_informative_than_fewer(stack_tables: Tables) -> None:
    for _, rows in stack_tables["identifiability"].groupby("frequency_hz"):
        card = rows.set_index("sensors").drop(columns="frequency_hz")
        assert list(card.index) == list(SENSOR_SETS)
        for name in SENSOR_SETS:
            assert (card.loc["all four"] <= card.loc[name] * (1.0 + 1e-6)).all(), name


def test_hysteresis_parameters_are_fitted_within_5_percent_with_correct_coverage_flags(
    stack_tables: Tables,
) -> None:
    table = stack_tables["hysteresis parameters"].set_index("parameter")
    assert (table["low"] < table["fitted"]).all()
    assert (table["fitted"] < table["high"]).all()
    assert ((table["low"] <= table["truth"]) & (table["truth"] <= table["high"])).tolist() == table["covered"].tolist()
    assert table["error_percent"].abs().max() < 5.0
    told = stack_tables["what loops tell"].groupby("loop")
    assert set(told.groups) == {"one loop that begins at rest", "one closed loop", "three loops that begin at rest"}


def test_quoted_numbers_have_a_role_and_a_verdict(stack_tables: Tables) -> None:
    table = stack_tables["quoted numbers"]
    assert set(table["role"]) <= {"calibration target", "prediction", "computed"}
    assert (table.loc[table["verdict"] == "calibrated", "role"] == "calibration target").all()
    assert (table.loc[table["verdict"] == "predicted", "role"] == "prediction").all()
    missed = table[table["verdict"] == "not reproduced"]["claim"]
    assert missed.tolist() == ["frequency of the maximum at 1.0 MPa", "frequency of the maximum at 0.6 MPa"]
