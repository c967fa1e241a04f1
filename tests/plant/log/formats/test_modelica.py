"""Results of Modelica's simulations are read by the names and units of their variables."""

from itertools import zip_longest

import numpy as np

from plant.log.formats.modelica import modelica_columns

TIMES = np.array([0.0, 0.1, 0.2])
NAMES = ["time", "pump.p", "der(x)", "back", "mass"]
SAID = ["Time in [s]", "Pressure of the port [Pa|bar]", "Speed [m/s]:#(type=Real)", "", "Mass [kg]"]
INFO = np.array([[0, 1, 0, -1], [2, 2, 0, -1], [2, 3, 0, -1], [2, -2, 0, -1], [1, 2, 0, -1]])
COURSES = np.column_stack([TIMES, [5.0, 6.0, 7.0], [0.5, 0.25, 0.0]])


def turned(texts: list[str]) -> list[str]:
    return ["".join(row) for row in zip_longest(*texts, fillvalue=" ")]


PLAIN = {
    "Aclass": ["Atrajectory", "1.1", "", "binNormal"],
    "name": NAMES,
    "description": SAID,
    "dataInfo": INFO,
    "data_1": np.ones((2, 2)),
    "data_2": COURSES,
}
TURNED = {
    **PLAIN,
    "Aclass": ["Atrajectory", "1.1", "", "binTrans"],
    "name": turned(NAMES),
    "description": turned(SAID),
    "dataInfo": INFO.T,
    "data_2": COURSES.T,
}


def test_courses_have_their_names_units_and_signs_in_both_layouts() -> None:
    for content in (PLAIN, TURNED):
        columns, units = modelica_columns(content)
        assert list(columns) == ["time", "pump.p", "der(x)", "back"]
        assert units == {"time": "s", "pump.p": "Pa", "der(x)": "m/s", "back": None}
        np.testing.assert_array_equal(columns["time"], TIMES)
        np.testing.assert_array_equal(columns["back"], [-5.0, -6.0, -7.0])


def test_other_variables_and_damaged_tables_are_no_simulation() -> None:
    assert modelica_columns({"x": TIMES}) == ({}, {})
    for name, value in (
        ("dataInfo", INFO[:2]),
        ("dataInfo", None),
        ("name", NAMES[:1]),
        ("Aclass", ["A", "1.1", "", ""]),
    ):
        assert modelica_columns({**PLAIN, name: value}) == ({}, {})


def test_a_place_outside_the_table_is_left_out() -> None:
    beyond = INFO.copy()
    beyond[1, 1] = 9
    assert list(modelica_columns({**PLAIN, "dataInfo": beyond})[0]) == ["time", "der(x)", "back"]
