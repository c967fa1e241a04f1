"""Classification results: confusion matrices, and the scores behind one of them."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from experiments.nine_conditions.findings import bank_in_words
from experiments.page.style import BLUE, VERMILION, Margins, panels
from experiments.page.words import condition_in_short, condition_in_words

DARK = 0.25
"""Share of the colour scale below which white text is more legible."""

COUNTS = LinearSegmentedColormap.from_list("counts", ["white", BLUE])
"""Colours from no run to all runs."""

ERRORS = LinearSegmentedColormap.from_list("errors", [BLUE, "#dbe8f0", "white", "#f5ddcc"])
"""Colours from the smallest error to the largest."""


def draw_confusions(confusions: Mapping[tuple[str, str], pd.DataFrame], accuracy: pd.DataFrame) -> Figure:
    """Draw one confusion matrix for each bank and variant.

    Parameters
    ----------
    confusions : Mapping[tuple of str, pandas.DataFrame]
        By bank and variant: one row for each true condition, one column for each found condition [count].
    accuracy : pandas.DataFrame
        The table ``classification``.

    Returns
    -------
    Figure
        One row of panels for each variant, one column for each bank.
    """
    banks = list(dict.fromkeys(accuracy["bank"]))
    variants = list(dict.fromkeys(accuracy["variant"]))
    margins = Margins(left=1.6, top=0.7, bottom=1.45, down=0.5)
    title = "Class found against true class: counts of runs"
    rows, columns = len(variants), len(banks)
    figure, axes = panels(title, rows, columns, 3.2 * rows + 1.3, margins, sharex=True, sharey=True)
    right = accuracy.set_index(["bank", "variant"])["accuracy"]
    order = [(bank, variant) for variant in variants for bank in banks]
    for place, (axis, (bank, variant)) in enumerate(zip(axes, order, strict=True)):
        matrix = confusions[bank, variant]
        _counts(axis, matrix.to_numpy())
        score = 100.0 * float(right.loc[(bank, variant)])
        axis.set(title=f"{bank_in_words(bank)}\n{variant} parameters: {score:.1f} % right")
        _class_ticks(axis, list(matrix.columns))
        axis.set(ylabel="" if place % columns else "true class")
        axis.set(xlabel="class found" if place >= len(order) - columns else "")
    return figure


def draw_confusion(matrix: pd.DataFrame, share: float) -> Figure:
    """Draw one confusion matrix.

    Parameters
    ----------
    matrix : pandas.DataFrame
        One row for each true condition, one column for each found condition [count].
    share : float
        Share of right classes, between 0 and 1 [fraction].
    """
    title = f"Class found against true class: {100.0 * share:.1f} % right"
    figure, (axis,) = panels(title, 1, 1, 5.6, Margins(left=2.2, bottom=1.45))
    _counts(axis, matrix.to_numpy())
    _class_ticks(axis, list(matrix.columns))
    axis.set(ylabel="true class", xlabel="class found")
    return figure


def _counts(axis: Axes, counts: np.ndarray) -> None:
    largest = max(1, int(counts.max()))
    axis.imshow(counts, cmap=COUNTS, vmin=0, vmax=largest, aspect="equal")
    for (row, column), count in np.ndenumerate(counts):
        if count:
            ink = "white" if count > 0.55 * largest else VERMILION if row != column else "black"
            axis.text(column, row, str(count), ha="center", va="center", fontsize=8, color=ink)


def _class_ticks(axis: Axes, names: Sequence[str]) -> None:
    places = range(len(names))
    axis.set_xticks(
        places, [condition_in_short(name) for name in names], rotation=55, ha="right", rotation_mode="anchor"
    )
    axis.set_yticks(places, [condition_in_short(name) for name in names])
    axis.tick_params(length=0)
    axis.grid(visible=False)
    for side in ("top", "right", "bottom", "left"):
        axis.spines[side].set_color("#c4c4c4")
        axis.spines[side].set_visible(True)


def draw_scores(scores: pd.DataFrame) -> Figure:
    """Draw one run's scores in every condition; the smallest score in a row gives the class.

    Parameters
    ----------
    scores : pandas.DataFrame
        The table ``score_example``: one row for each true condition, one column for each model [dimensionless].

    Returns
    -------
    Figure
        A heatmap with the scores written in and the smallest of each row framed.
    """
    title = "Score of every model on one run in every condition: the smallest names the class"
    figure, (axis,) = panels(title, 1, 1, 5.4, Margins(left=2.2, right=-0.3, top=0.4, bottom=1.05))
    values = scores.to_numpy(dtype=float)
    image = axis.imshow(values, cmap=ERRORS, norm=LogNorm(values.min(), values.max()), aspect="auto")
    shade = np.asarray(image.norm(values))
    best = values.argmin(axis=1)
    for row, column in enumerate(best):
        axis.add_patch(Rectangle((column - 0.5, row - 0.5), 1, 1, fill=False, linewidth=1.6, clip_on=False))
    for (row, column), value in np.ndenumerate(values):
        ink = "white" if shade[row, column] < DARK else "black"
        weight = "bold" if column == best[row] else "normal"
        words = f"{value:.{2 if value >= 0.1 else 3}f}"
        axis.text(column, row, words, ha="center", va="center", color=ink, fontweight=weight)
    _class_ticks(axis, list(scores.columns))
    axis.set_xticks(range(len(scores.columns)), [condition_in_short(name) for name in scores.columns], rotation=30)
    axis.set_yticks(range(len(scores)), [condition_in_words(str(name)) for name in scores.index])
    axis.set(xlabel="model", ylabel="true condition")
    figure.colorbar(image, ax=axis, label="error over the size of the signals [ratio]", pad=0.01, aspect=30)
    return figure
