"""The circuit's figures show the content of its tables, and its page is a single file."""

import re
import warnings
from collections.abc import Mapping

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from experiments.circuit.figures import CIRCUIT_FIGURES
from experiments.circuit.study import CIRCUIT, circuit_studies
from experiments.page.figure_files import figure_files
from experiments.page.render import render_page
from experiments.page.style import project_style
from experiments.page.tables import html_table
from experiments.running.study import SeedSettings
from plant.eha.circuit_parameters import CircuitParameters

UNIT = re.compile(r"\[[^\[\]]+\]")
TRUTH = 2.07e8


def _estimates() -> pd.DataFrame:
    rows = [
        {
            "form": form,
            "drive": "steps",
            "pressure_logged": form != "acceleration",
            "condition": condition,
            "outcome": "ok" if known else "not_observable",
            "value_pa": value if known else np.nan,
            "ci95_low_pa": value - 1e6,
            "ci95_high_pa": value + 1e6,
            "truth_pa": TRUTH,
        }
        for form, value in (("flow", 2.07e8), ("pressure", 1.99e8), ("acceleration", 0.1e8))
        for condition, known in (("normal", form != "acceleration"), ("minor_leakage", True))
    ]
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def tables() -> Mapping[str, pd.DataFrame]:
    studies = circuit_studies(CircuitParameters(), 1)
    slow = {
        "figure 11 bulk modulus": _estimates(),
        "figure 11 modelled chambers": _chambers(),
        "figure 7 singular values": _singular_values(),
    }
    return {name: slow[name] if name in slow else run() for name, run in studies.items()}


def _chambers() -> pd.DataFrame:
    values = {"value_pa": 2.071e8, "std_pa": 1e5, "error_percent": 0.05, "z": 1.0, "gate_passed": True}
    return pd.DataFrame([{"condition": "normal", **values}])


def _singular_values() -> pd.DataFrame:
    index = np.arange(1, 9)
    values = dict.fromkeys(("hankel", "projected"), 10.0 ** (-index.astype(float)))
    floors = {f"{name}_floor": 3e-3 for name in values}
    return pd.DataFrame({"index": index, **values, **floors, "suggested_order": 2})


@pytest.fixture(scope="module")
def drawn(tables: Mapping[str, pd.DataFrame]) -> Mapping[str, Figure]:
    with project_style():
        return {name: draw(tables) for name, draw in CIRCUIT_FIGURES.items()}


@pytest.mark.parametrize("name", CIRCUIT_FIGURES)
def test_every_figure_has_a_title_and_units_and_stays_inside(name: str, drawn: Mapping[str, Figure]) -> None:
    figure = drawn[name]
    assert figure.get_suptitle()
    labels = [label for axis in figure.axes for label in (axis.get_xlabel(), axis.get_ylabel()) if label]
    assert labels
    assert all(UNIT.search(label) for label in labels), labels
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(box.x0, box.y0) >= -0.02
    assert box.x1 <= width + 0.02
    assert box.y1 <= height + 0.02


def test_figures_3_and_4_mark_the_published_definitions(
    tables: Mapping[str, pd.DataFrame], drawn: Mapping[str, Figure]
) -> None:
    left, right = drawn["figures_3_and_4"].axes
    for axis, published in ((left, {100.0, 75.0, 50.0}), (right, {100.0, 200.0, 300.0})):
        (marks,) = (line for line in axis.lines if line.get_label() == "published definition")
        assert {value for value in np.asarray(marks.get_ydata()).tolist() if np.isfinite(value)} == published
    (curve,) = (line for line in left.lines if line.get_label() == "circuit plant")
    shown = tables["figure 3 velocity against leakage throttle"].sort_values("throttle_a_v")["percent_of_normal"]
    np.testing.assert_array_equal(np.asarray(curve.get_ydata()), shown)


def test_figures_5_and_6_have_one_curve_per_input(
    tables: Mapping[str, pd.DataFrame], drawn: Mapping[str, Figure]
) -> None:
    axes = drawn["figures_5_and_6"].axes
    for axis, name, by in (
        (axes[0], "figure 5 frequency response over input means", "mean_v"),
        (axes[1], "figure 6 frequency response over input amplitudes", "amplitude_v"),
    ):
        assert [line.get_label() for line in axis.lines if len(np.asarray(line.get_xdata())) > 2] == [
            f"{volts:g} V" for volts in sorted(tables[name][by].unique())
        ]


def test_figure_11_writes_not_observable_in_words(drawn: Mapping[str, Figure]) -> None:
    *_, last = drawn["figure_11"].axes
    assert [text.get_text() for text in last.texts] == ["not observable"]


def test_the_page_contains_every_figure_and_loads_nothing(
    tables: Mapping[str, pd.DataFrame], drawn: Mapping[str, Figure]
) -> None:
    # the other figures are empty on this page, since writing them takes as long as the rest of the test
    one = "figure_11"
    drawings = {name: lambda _, name=name: drawn[name] if name == one else Figure((1.0, 1.0)) for name in drawn}
    figures = figure_files(drawings, tables)
    page = render_page(CIRCUIT.template, {**tables, "settings": SeedSettings(7)}, CIRCUIT.columns, figures)
    assert page.count("data:image/svg+xml;base64,") == len(CIRCUIT_FIGURES)
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", page)
    assert all(f'id="{name}"' in page for name in CIRCUIT_FIGURES)
    for number in re.findall(r'href="#(E\d+)"', page):
        assert f'id="{number}"' in page
    assert all(image[:4] == b"\x89PNG" for path, image in figures.items() if path.endswith(".png"))


def test_a_panel_in_which_nothing_is_observable_is_drawn_without_a_warning(tables: Mapping[str, pd.DataFrame]) -> None:
    """Before, the command showed a warning of Matplotlib, since such a panel ranges from the true value to itself."""
    estimates = _estimates()
    hidden = estimates["form"] == "acceleration"
    estimates.loc[hidden, ["value_pa", "ci95_low_pa", "ci95_high_pa"]] = np.nan
    with project_style(), warnings.catch_warnings(action="error"):
        figure = CIRCUIT_FIGURES["figure_11"]({**tables, "figure 11 bulk modulus": estimates})
    low, high = figure.axes[2].get_xlim()
    assert low < 207.0 < high


def test_each_coefficient_of_the_page_has_its_unit(tables: Mapping[str, pd.DataFrame]) -> None:
    """Before, the page said that the coefficients are in SI units, and not in which."""
    page = str(
        html_table(tables["figure 9 friction refitted"], CIRCUIT.columns["figure 9 friction refitted"], "Table.")
    )
    assert "quadratic friction a_1 [N s²/m²]" in page
    assert "Coulomb friction a_3 [N]" in page
    page = str(
        html_table(tables["figure 8 leakage flow refitted"], CIRCUIT.columns["figure 8 leakage flow refitted"], "")
    )
    assert "lumped leakage L_t [m³/(s Pa)]" in page
