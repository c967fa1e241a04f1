"""The circuit study: every experiment by the name of its table, and how the report shows them."""

from collections.abc import Callable, Mapping
from dataclasses import asdict

import pandas as pd

from experiments.circuit.dynamic_experiments import (
    AMPLITUDE_INPUTS,
    MEAN_INPUTS,
    bulk_modulus_on_circuit,
    frequency_responses,
    order_study,
    validation_input,
)
from experiments.circuit.figures import CIRCUIT_FIGURES
from experiments.circuit.first_tests import first_tests
from experiments.circuit.modelled_chambers import modelled_chambers
from experiments.circuit.steady_experiments import (
    FRICTION_SWEEP,
    LEAKAGE_SWEEP,
    friction_points,
    friction_refit,
    leakage_points,
    leakage_refit,
    points_table,
    throttle_curve,
)
from experiments.nine_conditions.settings import StudySettings
from experiments.page.numbers import pretty_unit
from experiments.page.tables import Column, Columns, interval, name_in_words
from experiments.page.words import CONDITION
from experiments.running.progress import Track
from experiments.running.random_streams import stream
from experiments.running.study import Study, StudyResult
from plant.eha.circuit_parameters import CircuitParameters
from plant.units import notes


def circuit_studies(
    rig: CircuitParameters, seed: int, settings: StudySettings | None = None
) -> Mapping[str, Callable[[], pd.DataFrame]]:
    """Return the experiments, by the name of their table.

    Parameters
    ----------
    settings : StudySettings, optional
        First guesses and duration of the runs of Figures 10 and 11; by default the paper's.

    Returns
    -------
    Mapping[str, callable]
        Each returns its table when called.
    """
    settings = settings or StudySettings(seed=seed)
    return {
        "figure 3 velocity against leakage throttle": lambda: throttle_curve(rig, LEAKAGE_SWEEP),
        "figure 4 pressure against friction throttle": lambda: throttle_curve(rig, FRICTION_SWEEP),
        "section 4 first tests": lambda: first_tests(rig, seed),
        "figure 5 frequency response over input means": lambda: frequency_responses(rig, seed, MEAN_INPUTS),
        "figure 6 frequency response over input amplitudes": lambda: frequency_responses(rig, seed, AMPLITUDE_INPUTS),
        "figure 7 singular values": lambda: order_study(rig, seed),
        "figure 8 leakage points": lambda: points_table(rig, stream(seed, "leakage refit"), leakage_points),
        "figure 8 leakage flow refitted": lambda: leakage_refit(rig, stream(seed, "leakage refit")),
        "figure 9 friction points": lambda: points_table(rig, stream(seed, "friction refit"), friction_points),
        "figure 9 friction refitted": lambda: friction_refit(rig, stream(seed, "friction refit")),
        "figure 10 validation input": lambda: validation_input(rig, settings),
        "figure 11 bulk modulus": lambda: bulk_modulus_on_circuit(rig, settings),
        "figure 11 modelled chambers": lambda: modelled_chambers(rig, seed, settings.duration),
    }


def _find(settings: StudySettings, track: Track) -> StudyResult:
    studies = circuit_studies(RIG, settings.seed, settings)
    return StudyResult({name: run() for name, run in track(studies.items(), description="experiments on the circuit")})


RIG = CircuitParameters()


def _coefficient(name: str) -> str:
    """Return a coefficient as the rig file calls it, with its unit."""
    note = notes(CircuitParameters)[name]
    return f"{note.meaning} [{pretty_unit(note.unit)}]"


_PERCENT_COLUMNS = (
    Column("percent_of_normal", "circuit", "% of normal", digits=3),
    Column("published_percent", "published", "% of normal", digits=3),
)
_REFIT_COLUMNS = (
    "level",
    Column("coefficient", of_row=lambda row: _coefficient(str(row["coefficient"]))),
    "published",
    Column("went_in", "simulated with"),
    "refitted",
    Column("low", "95 % interval", of_row=interval("low", "high")),
    Column("covered", "interval covers"),
)

_IN_FULL: Mapping[str, str] = {
    "gain spread": "largest gain over smallest",
    "means from 2 V": "mean inputs from 2 V up",
    "amplitudes from 2 V": "amplitudes from 2 V up",
    "amplitudes from 0.5 V": "amplitudes from 0.5 V up",
    "mean 2 V over mean 7 V, least": "that at mean 2 V over that at 7 V, least",
}
"""Full names of first tests whose short names are unclear outside the table."""


def _in_full(name: str) -> str:
    return _IN_FULL.get(name, name_in_words(name))


COLUMNS: Mapping[str, Columns] = {
    "section 4 first tests": (
        Column("test", words=_in_full),
        Column("at", words=_in_full),
        Column("value", "circuit"),
        Column("expected", "implied by Tables 2 to 4"),
        "published",
        Column("unit", words=lambda unit: "ratio" if unit == "1" else unit),
    ),
    "figure 3 velocity against leakage throttle": (
        Column("throttle_a_v", "throttle A"),
        Column("velocity_m_s", "settles at"),
        *_PERCENT_COLUMNS,
    ),
    "figure 4 pressure against friction throttle": (
        Column("throttle_b_v", "throttle B"),
        Column("differential_pressure_pa", "settles at"),
        *_PERCENT_COLUMNS,
    ),
    "figure 8 leakage flow refitted": _REFIT_COLUMNS,
    "figure 9 friction refitted": _REFIT_COLUMNS,
    "figure 11 modelled chambers": (
        CONDITION,
        Column("value_pa", "bulk modulus", "MPa", 1e-6, 5),
        Column("std_pa", "standard deviation", "MPa", 1e-6, 3),
        Column("error_percent", "error", "%", digits=2),
        Column("z", "error over deviation", digits=2),
        Column("gate_passed", "passes the check"),
    ),
}

CIRCUIT = Study("circuit", "circuit/report.html", _find, CIRCUIT_FIGURES, COLUMNS, asdict(RIG))
