"""`run_study(settings) -> StudyResult`: the nine-condition study, as tables and series; knows nothing of files."""

import platform
import warnings
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from types import MappingProxyType
from typing import Any

import pandas as pd

from estimation.identification.linear_model import LinearModel
from experiments.streams import stream
from experiments.studies.bulk_modulus import EXPERIMENTS, bulk_modulus_study
from experiments.studies.conditions import condition_table, parameter_table, scalar_table
from experiments.studies.settings import StudySettings
from experiments.studies.transfer_functions import (
    filtering_table,
    identification_study,
    order_table,
    response_curves,
    transfer_function_table,
)
from experiments.studies.validation import VARIANTS, classification_study, validation_study
from faults.conditions import CONDITIONS
from plant.eha import EhaParameters
from plant.errors import LogWarning

STAGES: Mapping[str, str] = MappingProxyType(
    {
        "bulk modulus": "estimating bulk modulus",
        "identification": "identifying transfer functions",
        "validation": "validating on the nine steps",
        "classification": "classifying",
    }
)
"""The study's parts, with the words that a progress bar shows."""


@dataclass(frozen=True, eq=False)
class StudyResult:
    """All that a study found; figures, tables and the report read this and compute nothing.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        Results to read, by name.
    series : Mapping[str, pandas.DataFrame]
        Curves to draw, in long form, by name.
    library : Mapping[str, LinearModel]
        The identified transfer functions at full precision.
    manifest : Mapping[str, Any]
        Settings, parameters, versions: what it takes to run this again.
    """

    tables: Mapping[str, pd.DataFrame]
    series: Mapping[str, pd.DataFrame]
    library: Mapping[str, LinearModel]
    manifest: Mapping[str, Any]


def stage_lengths(settings: StudySettings) -> Mapping[str, int]:
    """Return how many times each stage reports an advance.

    Parameters
    ----------
    settings : StudySettings
        Size of the study.

    Returns
    -------
    Mapping[str, int]
        Count by stage.
    """
    return {
        "bulk modulus": len(EXPERIMENTS) * len(CONDITIONS),
        "identification": len(CONDITIONS),
        "validation": 1,
        "classification": len(VARIANTS) * settings.seeds,
    }


def run_study(settings: StudySettings, advance: Callable[[str], None], rig: EhaParameters | None = None) -> StudyResult:
    """Run the nine-condition study.

    Parameters
    ----------
    settings : StudySettings
        Size and seed.
    advance : callable
        Called with the stage's name whenever a piece of it is done, see `stage_lengths`.
    rig : EhaParameters, optional
        The healthy actuator; the paper's by default.

    Returns
    -------
    StudyResult
        What was found.
    """
    with warnings.catch_warnings():
        # what a fit says of itself stands beside it in the tables; set here, since threads share the filters
        warnings.simplefilter("ignore", LogWarning)
        return _parts(settings, advance, EhaParameters() if rig is None else rig)


def _parts(settings: StudySettings, advance: Callable[[str], None], healthy: EhaParameters) -> StudyResult:
    estimates, convergence = bulk_modulus_study(healthy, settings, lambda: advance("bulk modulus"))
    library, tests = identification_study(healthy, settings, lambda: advance("identification"))
    rmse, runs = validation_study(healthy, library, settings)
    advance("validation")
    classes = classification_study(healthy, library, settings, lambda: advance("classification"))
    conditions = condition_table(healthy)
    tables = {
        "conditions": conditions,
        "parameters": parameter_table(healthy),
        "bulk_modulus": estimates,
        "transfer_functions": transfer_function_table(library),
        "validation_rmse": rmse,
        "filtering": filtering_table(stream(settings.seed, "filtering"), settings.identification_duration),
        "scalars": scalar_table(conditions, library, _mean_estimate(estimates)),
        **classes,
    }
    series = {
        "convergence": convergence,
        "validation_runs": runs,
        "responses": response_curves(library, tests),
        "order": order_table(tests["normal"], stream(settings.seed, "order")),
    }
    return StudyResult(MappingProxyType(tables), MappingProxyType(series), library, _manifest(settings, healthy))


def _mean_estimate(estimates: pd.DataFrame) -> float:
    ours = estimates[(estimates["form"] == "pressure") & estimates["pressure_logged"]]
    return float(ours["value_pa"].mean())


def _manifest(settings: StudySettings, rig: EhaParameters) -> Mapping[str, Any]:
    packages = ("hydrostate", "numpy", "scipy", "numba", "pandas", "control", "filterpy", "matplotlib")
    return MappingProxyType(
        {
            "study": "nine conditions",
            "settings": asdict(settings),
            "parameters": asdict(rig),
            "python": platform.python_version(),
            "versions": {package: version(package) for package in packages},
        }
    )
