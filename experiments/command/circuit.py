"""What `hydrostate circuit` does: the paper's experiments on the circuit plant, as a folder with a report."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.progress import track

from experiments.figures.circuit import CIRCUIT_FIGURES
from experiments.figures.tables import figure_files
from experiments.report.circuit import render_circuit_report
from experiments.store import check_target, write_tables
from experiments.streams import stream
from experiments.studies.circuit_curves import (
    FRICTION_SWEEP,
    LEAKAGE_SWEEP,
    friction_points,
    friction_refit,
    leakage_points,
    leakage_refit,
    points_table,
    throttle_curve,
)
from experiments.studies.circuit_experiments import (
    AMPLITUDE_INPUTS,
    MEAN_INPUTS,
    bulk_modulus_on_circuit,
    frequency_responses,
    order_study,
    validation_input,
)
from experiments.studies.circuit_first_tests import first_tests
from experiments.studies.settings import StudySettings
from plant.circuit_parameters import CircuitParameters


def circuit_studies(rig: CircuitParameters, seed: int) -> Mapping[str, Callable[[], pd.DataFrame]]:
    """Return the experiments, by the name of their table.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    seed : int
        Seed of every random stream.

    Returns
    -------
    Mapping[str, callable]
        Each returns its table when called.
    """
    settings = StudySettings(seed=seed)
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
    }


def circuit_command(out: Path, seed: int, console: Console) -> Path:
    """Run the circuit studies and write their tables, figures and report.

    Parameters
    ----------
    out : Path
        Folder of the result; replaced whole if it holds an earlier study.
    seed : int
        Seed of every random stream.
    console : rich.console.Console
        Where progress goes.

    Returns
    -------
    Path
        The manifest, ``manifest.json``; the report stands beside it as ``report.html``.

    Raises
    ------
    HydrostateError
        If the folder cannot be written, or holds something that is not a study.
    """
    check_target(out)
    rig = CircuitParameters()
    studies = circuit_studies(rig, seed)
    tables = {name: run() for name, run in track(studies.items(), "experiments on the circuit", console=console)}
    manifest = {"study": "circuit", "settings": {"seed": seed}, "parameters": asdict(rig)}
    figures = figure_files(CIRCUIT_FIGURES, tables)
    files = {"report.html": render_circuit_report(tables, figures["svg"], seed).encode()}
    files |= {f"figures/{name}.{kind}": image for kind, images in figures.items() for name, image in images.items()}
    return write_tables(tables, manifest, out, files)
