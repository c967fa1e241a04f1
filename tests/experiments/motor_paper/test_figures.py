"""The figures show the content of the study's tables."""

from collections.abc import Mapping

import numpy as np
import pytest
from matplotlib.figure import Figure

from experiments.motor_paper.sensing import FAULTS
from experiments.motor_paper.study import MOTOR_PAPER_FIGURES
from experiments.page.frames import Tables
from experiments.page.style import project_style


@pytest.fixture(scope="module")
def tables(motor_paper_tables: Tables) -> Tables:
    return motor_paper_tables


@pytest.fixture(scope="module")
def drawn(tables: Tables) -> Mapping[str, Figure]:
    with project_style():
        return {name: draw(tables) for name, draw in MOTOR_PAPER_FIGURES.items()}


def curves(figure: Figure, panel: int) -> dict[str, np.ndarray]:
    """Return the curves of a panel by their text in the legend."""
    return {str(line.get_label()): np.asarray(line.get_ydata()) for line in figure.axes[panel].lines}


@pytest.mark.parametrize("name", MOTOR_PAPER_FIGURES)
def test_every_figure_has_a_title_and_a_label_below_each_column(name: str, drawn: Mapping[str, Figure]) -> None:
    assert drawn[name].get_suptitle()
    assert all(axis.get_xlabel() for axis in drawn[name].axes if axis.get_subplotspec().is_last_row())


def test_the_bode_plot_shows_each_model_s_gain(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    shown = curves(drawn["bode"], 0)
    for name, rows in tables["vibration responses"].groupby("model"):
        assert shown[str(name)].tolist() == rows["gain"].tolist()


def test_only_the_equations_as_printed_have_unstable_poles(drawn: Mapping[str, Figure]) -> None:
    crosses = [line for line in drawn["poles"].axes[0].lines if line.get_marker() == "x"]
    unstable = [line.get_label() for line in crosses if float(np.asarray(line.get_xdata())[0]) > 0.0]
    assert len(crosses) == 3
    assert unstable == ["1 and 2, as printed"]


def test_a_loop_s_step_is_drawn_in_micrometres(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    shown = curves(drawn["loop"], 0)
    for name, rows in tables["loop runs"].groupby("controller"):
        np.testing.assert_array_equal(shown[str(name)], 1e6 * rows["output_m"])


def test_each_hysteresis_law_has_one_curve_per_frequency(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    for panel, law in enumerate(("mended", "printed")):
        rows = tables["hysteresis loops"].groupby("law").get_group(law)
        shown = curves(drawn["hysteresis_loops"], panel)
        assert list(shown) == [f"{f:g} Hz" for f in sorted(rows["frequency_hz"].unique())]
        assert max(np.max(np.abs(one)) for one in shown.values()) == rows["hysteresis_v"].abs().max()


def test_dots_of_sampled_orders_lie_on_the_exact_lines(drawn: Mapping[str, Figure]) -> None:
    for axis in drawn["fractional"].axes:
        lines = axis.lines
        assert len(lines) == 6
        for exact, dots in zip(lines[::2], lines[1::2], strict=True):
            at, there = np.asarray(dots.get_xdata(), float), np.asarray(dots.get_ydata(), float)
            here = np.interp(at, np.asarray(exact.get_xdata(), float), np.asarray(exact.get_ydata(), float))
            assert np.max(np.abs(there - here)) < 0.02 * np.max(np.abs(here))


def test_residuals_of_every_reading_are_drawn(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    rows = tables["regression residuals"]
    for axis in drawn["residuals"].axes:
        marks = [line for line in axis.lines if line.get_marker() in {"x", "o", "s"}]
        assert np.concatenate([line.get_ydata() for line in marks]).tolist() == rows["residual"].tolist()


def test_line_fits_use_the_reading_of_figure_12(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    rows = tables["regression residuals"].query("reading == 'anova'")
    shown = curves(drawn["line_fits"], 0)
    assert shown["Table 2"].tolist() == rows["flow"].tolist()
    assert shown["fitted"].tolist() == rows["predicted"].tolist()


def test_every_pair_has_a_bar_as_long_as_its_r_square(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    (axis,) = drawn["circle"].axes
    assert [bar.get_width() for bar in axis.patches] == tables["circularity"]["r_square"].tolist()[::-1]


def test_every_fault_has_a_bar_for_each_of_two_regressions(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    (axis,) = drawn["sensing_faults"].axes
    assert [label.get_text() for label in axis.get_yticklabels()] == [*reversed(FAULTS), "none"]
    wanted = 1e3 * tables["sensing faults"].iloc[::-1]["A3, A4, A5, as the paper wants"]
    assert [bar.get_width() for bar in axis.patches][:5] == wanted.tolist()


def test_every_drive_has_its_points_and_every_signal_its_harmonics(tables: Tables, drawn: Mapping[str, Figure]) -> None:
    assert [label for label in curves(drawn["sensing"], 1) if label.endswith("V")] == [
        f"{volts:g} V" for volts in (100, 150, 200, 250, 300)
    ]
    rows = tables["motor spectra"].query("peak_to_peak_v == 200.0 and harmonic > 0")
    for axis, (_, part) in zip(drawn["spectra"].axes, rows.groupby("signal", sort=False), strict=True):
        assert [bar.get_height() for bar in axis.patches] == part["relative_percent"].tolist()
