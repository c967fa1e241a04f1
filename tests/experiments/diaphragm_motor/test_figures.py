"""The motor's figures show the content of its tables, and its sweeps find the motor's behaviour."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.diaphragm_motor.figures import MOTOR_FIGURES
from experiments.diaphragm_motor.quoted import ML_MIN
from experiments.diaphragm_motor.study import RIG, SWEEPS
from experiments.diaphragm_motor.sweeps import FREQUENCIES, PEAK, PUBLISHED_FLOW, SHARES, SWINGS, blocking_force
from experiments.page.frames import Tables
from experiments.page.style import project_style
from plant.diaphragm_motor.flow import operate


@pytest.fixture(scope="module")
def drawn(motor_tables: Tables) -> Mapping[str, Figure]:
    with project_style():
        return {name: draw(motor_tables) for name, draw in MOTOR_FIGURES.items()}


def test_flow_and_electrodes_are_drawn_over_frequency_and_voltage(
    motor_tables: Tables, drawn: Mapping[str, Figure]
) -> None:
    for figure, table in (("frequency", "frequency sweep"), ("voltage", "voltage sweep")):
        flow, sensing = drawn[figure].axes
        rows = motor_tables[table]
        assert np.asarray(flow.lines[0].get_ydata()) == pytest.approx(rows["flow_m3_s"].to_numpy() / ML_MIN)
        for line in sensing.lines:
            assert np.asarray(line.get_ydata()).tolist() == rows[f"{str(line.get_label()).lower()}_v"].tolist()
    assert motor_tables["frequency sweep"]["frequency_hz"].tolist() == list(FREQUENCIES)
    assert motor_tables["voltage sweep"]["voltage_v"].tolist() == list(SWINGS)


def test_the_best_frequency_of_each_load_is_marked(motor_tables: Tables, drawn: Mapping[str, Figure]) -> None:
    right = drawn["load"].axes[1]
    marks = [float(np.asarray(line.get_xdata())[0]) for line in right.lines if line.get_marker() == "o"]
    table = motor_tables["load and frequency"]
    best = [rows.loc[rows["velocity_m_s"].idxmax(), "frequency_hz"] for _, rows in table.groupby("load_n")]
    assert marks == best


def test_the_phases_of_the_spool_valve_are_labelled_in_order(drawn: Mapping[str, Figure]) -> None:
    (axis,) = drawn["reversal"].axes
    assert [text.get_text() for text in axis.texts] == ["extends", "holds", "retracts", "holds"]


def test_every_run_under_control_has_a_panel(motor_tables: Tables, drawn: Mapping[str, Figure]) -> None:
    assert [axis.get_title("left") for axis in drawn["control"].axes] == motor_tables["control"]["run"].tolist()
    for axis in drawn["control"].axes:
        assert [line.get_label() for line in axis.lines] == ["as the controller sees it", "true", "wanted"]


def test_two_pump_cycles_have_three_panels_and_the_averaged_motor_agrees_with_the_fast_one(
    motor_tables: Tables, drawn: Mapping[str, Figure]
) -> None:
    assert [len(axis.lines) for axis in drawn["pump_cycle"].axes] == [3, 2, 4]
    cycle = motor_tables["pump cycle"]
    assert cycle["time_s"].max() == pytest.approx(2.0 / PEAK, rel=0.01)
    course = motor_tables["averaged"]
    assert len(drawn["averaged"].axes[0].lines) == 2
    settled = course[course["time_s"].between(0.05, 0.09) | course["time_s"].between(0.15, 0.19)]
    assert settled["averaged_m_s"].to_numpy() == pytest.approx(settled["fast_m_s"].to_numpy(), rel=0.05)


def test_the_piston_stops_at_its_blocking_force_and_moves_below_it(motor_tables: Tables) -> None:
    table = motor_tables["load sweep"]
    assert len(table) == 3 * len(SHARES)
    for _, rows in table.groupby("voltage_v"):
        speed = rows.set_index(rows["load_n"] / rows["blocking_n"])["velocity_m_s"]
        assert speed.iloc[0] > 50.0 * abs(speed.iloc[-1])
        assert speed.iloc[:-1].min() > 0.0
    found = blocking_force(RIG, PEAK, 100.0)
    assert operate(replace(RIG, load_force=found - 0.1), PEAK, 100.0).velocity > 1e-5
    assert operate(replace(RIG, load_force=found + 0.1), PEAK, 100.0).velocity < 1e-5


@pytest.mark.slow
def test_other_sets_of_plates_give_the_published_peak_with_other_blocking_forces() -> None:
    sets = SWEEPS["other sets"](RIG)
    assert sets["frequency_hz"].to_numpy() == pytest.approx(PEAK, abs=5.0)
    assert sets["flow_m3_s"].to_numpy() == pytest.approx(PUBLISHED_FLOW, rel=0.01)
    assert sets["blocking_n"].max() > 3.0 * sets["blocking_n"].min()


def test_gas_lowers_the_best_frequency_and_bulk_modulus_hardly_moves_the_flow(motor_tables: Tables) -> None:
    table = motor_tables["sensitivity"].set_index("change")
    assert table.loc["0.1 to 2 %", "frequency_hz"] < -30.0
    assert table.loc["halved", "flow_percent"] == pytest.approx(0.0, abs=0.2)


def test_the_table_of_claims_marks_the_one_that_fails(motor_tables: Tables) -> None:
    table = motor_tables["reproduced"]
    assert table.loc[~table["holds"], "claim"].tolist() == [
        "the same to 0.95 of blocking, where valves leak and friction smooths"
    ]
