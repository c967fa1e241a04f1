"""The study's figures by name. They read stored tables and series, and compute nothing."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from experiments.nine_conditions.bulk_modulus import POSITION_STEPS, PRESSURE_STEPS, PUBLISHED_METHOD
from experiments.nine_conditions.classification import draw_confusions, draw_scores
from experiments.nine_conditions.convergence import draw_convergence
from experiments.nine_conditions.definitions import draw_definitions
from experiments.nine_conditions.estimates import draw_estimates, draw_forms
from experiments.nine_conditions.findings import truth_of
from experiments.nine_conditions.identification import draw_bode, draw_gains, draw_order
from experiments.nine_conditions.validation_figure import draw_rmse, draw_validation_run
from experiments.page.figure_files import Drawings
from experiments.page.frames import Tables

SHOWN_RUN = "minor_friction"


def _confusions(tables: Tables) -> Figure:
    summary = tables["classification"]
    pairs = summary[["bank", "variant"]].itertuples(index=False, name=None)
    matrices: Mapping[tuple[str, str], pd.DataFrame] = {
        (bank, variant): tables[f"confusion {bank} {variant}"] for bank, variant in pairs
    }
    return draw_confusions(matrices, summary)


FIGURES: Drawings = {
    "convergence_pressure_form": lambda of: draw_convergence(PRESSURE_STEPS, of["convergence"], truth_of(of)),
    "convergence_without_pressure": lambda of: draw_convergence(POSITION_STEPS, of["convergence"], truth_of(of)),
    "convergence_acceleration_form": lambda of: draw_convergence(PUBLISHED_METHOD, of["convergence"], truth_of(of)),
    "forms_on_sticking_plant": lambda of: draw_forms(of["bulk_modulus"], truth_of(of)),
    "estimates": lambda of: draw_estimates(of["bulk_modulus"], truth_of(of)),
    "bode": lambda of: draw_bode(of["responses"], of["conditions"]),
    "order": lambda of: draw_order(of["order"]),
    "gains": lambda of: draw_gains(of["transfer_functions"]),
    "validation_run": lambda of: draw_validation_run(of["validation_runs"], SHOWN_RUN),
    "rmse": lambda of: draw_rmse(of["validation_rmse"]),
    "confusions": _confusions,
    "scores": lambda of: draw_scores(of["score_example"]),
    "definitions": lambda of: draw_definitions(of["conditions"]),
}
