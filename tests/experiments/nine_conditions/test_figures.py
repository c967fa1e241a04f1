"""The figures show the content of the tables, with titles and labels."""

import re
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from experiments.nine_conditions.bulk_modulus import PRESSURE_SINE
from experiments.nine_conditions.bulk_modulus import PRESSURE_STEPS as OURS
from experiments.nine_conditions.classification import draw_confusions
from experiments.nine_conditions.convergence import draw_convergence
from experiments.nine_conditions.estimates import draw_estimates, draw_forms
from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.identification import draw_order
from experiments.page.style import project_style, spread_offsets
from experiments.running.study import StudyResult
from faults.conditions import CONDITIONS
from tests.experiments.conftest import SMALL
from tests.thinned import thinned

PRESSURE = "convergence_pressure_form"

SOME_FIGURES = pytest.mark.parametrize(
    "name", thinned(FIGURES, [name for name in FIGURES if not name.startswith("convergence") or name == PRESSURE])
)
"""Of three figures from one function, the fast tests use one."""

UNIT = re.compile(r"\[[^\[\]]+\]")
LETTERS = re.compile(r"(?<!\\)\b[a-z]{3,}")


def _labels_of_numbers(figure: Figure) -> Iterator[str]:
    """Yield the label of each axis with numeric ticks, or that of the figure if its panels share one."""
    for axis in figure.axes:
        for ticks, shared in ((axis.xaxis, figure.get_supxlabel()), (axis.yaxis, figure.get_supylabel())):
            written = [label.get_text() for label in ticks.get_ticklabels() if label.get_visible() and label.get_text()]
            sides = ("labelleft", "labelright") if ticks is axis.yaxis else ("labelbottom", "labeltop")
            inner = not any(ticks.get_tick_params().get(side) for side in sides)
            if axis.get_visible() and written and not inner and not any(LETTERS.search(text) for text in written):
                yield ticks.get_label_text() or shared


def _texts(figure: Figure) -> list[str]:
    return [text.get_text() for axis in figure.axes for text in axis.texts]


@SOME_FIGURES
def test_every_figure_has_a_title_and_units_on_its_numbers(name: str, drawn: Mapping[str, Figure]) -> None:
    figure = drawn[name]
    assert figure.get_suptitle()
    labels = list(_labels_of_numbers(figure))
    assert name == "confusions" or labels
    assert all(UNIT.search(label) for label in labels), labels


@SOME_FIGURES
def test_labels_stay_inside_the_figure(name: str, drawn: Mapping[str, Figure]) -> None:
    figure = drawn[name]
    box = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert box.x0 >= -0.02
    assert box.y0 >= -0.02
    assert box.x1 <= width + 0.02
    assert box.y1 <= height + 0.02


def test_convergence_shows_every_first_guess_in_every_condition(drawn: Mapping[str, Figure]) -> None:
    figure = drawn[PRESSURE]
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert len(titles) == len(CONDITIONS)
    assert "minor leakage + major friction" in titles
    starts = set(SMALL.starts)
    for axis in figure.axes:
        firsts = {1e6 * float(np.asarray(line.get_ydata())[0]) for line in axis.lines if len(line.get_xdata()) > 2}
        assert firsts == starts


def test_the_convergence_figure_draws_the_given_experiment(study: StudyResult) -> None:
    with project_style():
        figure = draw_convergence(OURS, study.series["convergence"], 2.07e8)
    line = max(figure.axes[0].lines, key=lambda curve: len(curve.get_xdata()))
    curves = study.series["convergence"]
    rows = curves[
        (curves["plant"] == OURS.plant)
        & (curves["form"] == OURS.form)
        & (curves["drive"] == OURS.drive)
        & (curves["pressure_logged"] == OURS.pressure_logged)
        & (curves["condition"] == "normal")
    ]
    lasts = {round(value / 1e6, 7) for value in rows.groupby("start_pa")["bulk_modulus_pa"].last()}
    assert round(float(np.asarray(line.get_ydata())[-1]), 7) in lasts


def _only(estimates: pd.DataFrame, **changes: object) -> pd.DataFrame:
    chosen = np.logical_and.reduce([estimates[name] == value for name, value in PRESSURE_SINE._asdict().items()])
    return estimates[chosen].assign(**changes)


def test_estimates_that_are_not_observable_are_labelled_in_words(study: StudyResult) -> None:
    rows = _only(study.tables["bulk_modulus"], outcome="not_observable", value_pa=np.nan, error_percent=np.nan)
    with project_style():
        assert _texts(draw_estimates(rows, 2.07e8)).count("not observable") == len(CONDITIONS)


def test_an_estimate_off_the_axis_is_labelled_with_its_error(study: StudyResult) -> None:
    rows = _only(study.tables["bulk_modulus"], outcome="ok", value_pa=0.2e8, error_percent=-90.0)
    with project_style():
        assert _texts(draw_estimates(rows, 2.07e8)).count("off the axis: -90 %") == len(CONDITIONS)


def test_figures_are_drawn_even_if_every_filter_diverged(study: StudyResult) -> None:
    table = study.tables["bulk_modulus"]
    rows = table[(table["plant"] == PRESSURE_SINE.plant) & (table["drive"] == PRESSURE_SINE.drive)].assign(
        outcome="diverged", value_pa=np.nan, error_percent=np.nan, filter_settled_at_pa=np.nan
    )
    with project_style():
        draw_forms(rows, 2.07e8).draw_without_rendering()
        figure = draw_estimates(rows, 2.07e8)
        figure.draw_without_rendering()
    cells = rows.groupby(["plant", "form", "drive", "pressure_logged", "condition"]).ngroups
    assert _texts(figure).count("diverged") == cells


def test_the_confusion_figure_writes_counts_and_accuracy() -> None:
    matrix = pd.DataFrame(np.diag(np.arange(1, 10)), index=list(CONDITIONS), columns=list(CONDITIONS))
    matrix.iloc[2, 5] = 17
    summary = pd.DataFrame({"bank": ["a"], "variant": ["nominal"], "accuracy": [0.5]})
    with project_style():
        figure = draw_confusions({("a", "nominal"): matrix}, summary)
    assert sorted(_texts(figure), key=int) == [*map(str, range(1, 10)), "17"]
    assert "50.0 % right" in figure.axes[0].get_title(loc="left")


def test_the_scores_figure_frames_the_smallest_score_of_each_row(
    study: StudyResult, drawn: Mapping[str, Figure]
) -> None:
    axis = drawn["scores"].axes[0]
    framed = [(round(patch.get_y() + 0.5), round(patch.get_x() + 0.5)) for patch in axis.patches]
    assert framed == list(enumerate(study.tables["score_example"].to_numpy().argmin(axis=1)))


def test_each_panel_of_singular_values_counts_those_above_its_noise(study: StudyResult) -> None:
    order = study.series["order"]
    edges = {"hankel_floor": order["hankel"].nlargest(3).iloc[-1], "projected_floor": order["projected"].max() / 2.0}
    with project_style():
        hankel, projected = draw_order(order.assign(**edges)).axes
    above = int((order["projected"] > edges["projected_floor"]).sum())
    assert [axis.get_title(loc="left").split(": ")[1] for axis in (hankel, projected)] == [
        "2 above the noise",
        f"{above} above the noise",
    ]


def test_drawing_figures_does_not_change_the_tables(study: StudyResult) -> None:
    rows = _only(study.tables["bulk_modulus"])
    before = rows.copy(deep=True)
    with project_style():
        draw_estimates(rows, 2.07e8)
    pd.testing.assert_frame_equal(rows, before)


def test_the_truth_is_the_simulated_parameter(study: StudyResult) -> None:
    parameters = study.tables["parameters"]
    other = parameters.assign(value=parameters["value"].where(parameters["parameter"] != "bulk_modulus", 1.5e8))
    with project_style():
        figure = FIGURES["forms_on_sticking_plant"]({**study.frames, "parameters": other})
    assert "truth 150" in _texts(figure)


def test_marks_in_one_row_are_spread_evenly_around_it() -> None:
    assert spread_offsets(1, 0.5) == [0.0]
    assert sum(spread_offsets(7, 0.5)) == pytest.approx(0.0)
