"""The study's figures by name. They read stored tables and series, and compute nothing."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType

import pandas as pd
from matplotlib.figure import Figure

from experiments.figures.classification import draw_confusions, draw_scores
from experiments.figures.convergence import Convergence, draw_convergence
from experiments.figures.definitions import draw_definitions
from experiments.figures.estimates import draw_estimates, draw_forms
from experiments.figures.identification import draw_bode, draw_gains, draw_order
from experiments.figures.style import styled
from experiments.figures.validation import draw_rmse, draw_validation_run
from experiments.study import StudyResult

SHOWN_RUN = "minor_friction"
"""The condition whose validation run is drawn."""


@dataclass(frozen=True)
class FigureKind:
    """One of the study's figures.

    Parameters
    ----------
    caption : str
        What to look at, for the report.
    draw : callable
        From a study's result to the figure.
    """

    caption: str
    draw: Callable[[StudyResult], Figure]


def draw(name: str, result: StudyResult) -> Figure:
    """Draw one of `FIGURES`.

    Parameters
    ----------
    name : str
        Key in `FIGURES`.
    result : StudyResult
        What a study found.

    Returns
    -------
    Figure
        Drawn in the project's look; save it inside `styled` too.
    """
    with styled():
        return FIGURES[name].draw(result)


def _convergence(shown: Convergence, result: StudyResult) -> Figure:
    return draw_convergence(shown, result.series["convergence"], _truth(result))


def _truth(result: StudyResult) -> float:
    return float(result.manifest["parameters"]["bulk_modulus"])


def _confusions(result: StudyResult) -> Figure:
    summary = result.tables["classification"]
    pairs = summary[["bank", "variant"]].itertuples(index=False, name=None)
    matrices: Mapping[tuple[str, str], pd.DataFrame] = {
        (bank, variant): result.tables[f"confusion {bank} {variant}"] for bank, variant in pairs
    }
    return draw_confusions(matrices, summary)


OURS = Convergence(
    "lumped", "pressure", "steps", True, "Pressure form, plant that sticks, nine steps, differential pressure logged"
)
WITHOUT_PRESSURE = Convergence(
    "lumped", "pressure", "steps", False, "Pressure form, plant that sticks, nine steps, position and velocity alone"
)
PUBLISHED = Convergence(
    "reduced",
    "acceleration",
    "sine",
    False,
    "Acceleration form (the published one), plant without sticking, 10 Hz sine",
)

FIGURES: Mapping[str, FigureKind] = MappingProxyType(
    {
        "convergence_pressure_form": FigureKind(
            "The analogue of the paper's Figure 11, by our filter. Dots on the left are the first guesses; curves that "
            "meet on the dashed line have found the simulated bulk modulus.",
            partial(_convergence, OURS),
        ),
        "convergence_without_pressure": FigureKind(
            "The same without the pressure sensor. The estimate moves where the piston starts, stops and rings; "
            "in between there is nothing to learn from, and the guesses wait for the next step.",
            partial(_convergence, WITHOUT_PRESSURE),
        ),
        "convergence_acceleration_form": FigureKind(
            "The published filter on the plant whose equation it assumes (5.14), driven by the paper's sine.",
            partial(_convergence, PUBLISHED),
        ),
        "forms_on_sticking_plant": FigureKind(
            "One dot a first guess. The published form differentiates friction, which jumps when the piston stops "
            "(errata E9); the pressure form does not.",
            lambda result: draw_forms(result.tables["bulk_modulus"], _truth(result)),
        ),
        "estimates": FigureKind(
            "One dot a first guess, with its 95 % interval; shaded, 1 % around the truth. Orange-red where the "
            "residuals contradict the model. Hatched: no number is given, or it lies off the axis.",
            lambda result: draw_estimates(result.tables["bulk_modulus"], _truth(result)),
        ),
        "bode": FigureKind(
            "The analogue of the paper's Figures 5 and 6. Thin curves scatter where the drive holds "
            "little power; empirical phase is left out where coherence is low.",
            lambda result: draw_bode(result.series["responses"], result.tables["conditions"]),
        ),
        "order": FigureKind(
            "The analogue of the paper's Figure 7: how many singular values stand above what noise alone would give.",
            lambda result: draw_order(result.series["order"]),
        ),
        "gains": FigureKind(
            "Table 6 is printed with four digits; in the normal condition these hardly fix the gain (errata E14).",
            lambda result: draw_gains(result.tables["transfer_functions"]),
        ),
        "validation_run": FigureKind(
            "Motor speed, and the velocity that follows. At a reversal the piston stands still until the pressure has "
            "turned round; a linear model cannot do that.",
            lambda result: draw_validation_run(result.series["validation_runs"], SHOWN_RUN),
        ),
        "rmse": FigureKind(
            "The longer a line, the more the mathematical model gains over the transfer function. Both panels share "
            "one axis; sensors and plants differ, so compare the order within a panel rather than values across.",
            lambda result: draw_rmse(result.tables["validation_rmse"]),
        ),
        "confusions": FigureKind(
            "Counts on the diagonal are right. Nominal: parameters as in the tables. Spread: leakage, flow bias and "
            "friction within 10 %, bulk modulus within 20 %, at random.",
            _confusions,
        ),
        "scores": FigureKind(
            "One run a row. The further the smallest score lies below the others, the surer the class.",
            lambda result: draw_scores(result.tables["score_example"]),
        ),
        "definitions": FigureKind(
            "Diamonds are the published definitions of minor and major. No one voltage gives all four from the "
            "published tables (errata E7); the simulations follow the tables.",
            lambda result: draw_definitions(result.tables["conditions"]),
        ),
    }
)
"""The study's figures, in the report's order."""
