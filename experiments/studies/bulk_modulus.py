"""Effective bulk modulus in nine conditions, from many first guesses: Figure 11, and where its method fails."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd

from estimation.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from estimation.eha import BULK_MODULUS
from experiments.executors import side_by_side
from experiments.streams import stream
from experiments.studies.settings import StudySettings
from faults.conditions import CONDITIONS, parameters_for
from plant.eha import EhaParameters
from plant.record import Record
from plant.sensors import BENCH
from plant.signals import make_drive
from plant.simulate import PLANTS, simulate


@dataclass(frozen=True)
class Experiment:
    """One way to estimate bulk modulus.

    Parameters
    ----------
    plant : str
        Plant that is simulated.
    form : str
        Process model that is believed.
    drive : str
        Drive signal.
    pressure_logged : bool
        Whether differential pressure is in the log.
    claim : str
        What this experiment shows.
    """

    plant: str
    form: str
    drive: str
    pressure_logged: bool
    claim: str


EXPERIMENTS = (
    Experiment("reduced", "acceleration", "sine", False, "The published method on the plant that it assumes."),
    Experiment("lumped", "acceleration", "sine", False, "The published method on a plant that sticks (errata E9)."),
    Experiment("lumped", "pressure", "sine", True, "Our method on the plant that sticks, pressure logged."),
    Experiment("lumped", "pressure", "steps", True, "Our method on the nine steps, pressure logged."),
    Experiment("lumped", "pressure", "steps", False, "Our method on the nine steps, position and velocity alone."),
    Experiment(
        "lumped", "flow", "steps", True, "The flow balance alone: condition unknown, leakage found along with it."
    ),
    Experiment("lumped", "pressure", "sine", False, "Stuck, position and velocity hold nothing (errata E13)."),
)
"""The study's experiments."""

TRACK_POINTS = 200
"""Points of a convergence curve that are kept."""


def bulk_modulus_study(
    rig: EhaParameters, settings: StudySettings, advance: Callable[[], None]
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Estimate bulk modulus in every experiment, condition, and from every first guess.

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    settings : StudySettings
        Size and seed.
    advance : callable
        Called once a condition of an experiment.

    Returns
    -------
    tuple of pandas.DataFrame
        One row an estimate; and the convergence curves in long form.
    """

    def estimate(case: tuple[Experiment, str]) -> list[tuple[dict[str, object], pd.DataFrame]]:
        experiment, name = case
        parameters = parameters_for(CONDITIONS[name], rig)
        record = _run(experiment, name, parameters, settings)
        known = rig if experiment.form == "flow" else parameters
        results: list[tuple[dict[str, object], pd.DataFrame]] = []
        for start in _starts(experiment, settings):
            found = estimate_bulk_modulus(record, known, form=experiment.form, start=start)
            row = _row(experiment, name, start, parameters.bulk_modulus, found)
            results.append((row, _curve(experiment, name, start, found)))
        return results

    rows: list[dict[str, object]] = []
    curves: list[pd.DataFrame] = []
    for results in side_by_side(estimate, product(EXPERIMENTS, CONDITIONS)):
        rows += [row for row, _ in results]
        curves += [curve for _, curve in results]
        advance()
    return pd.DataFrame(rows), pd.concat(curves, ignore_index=True)


def _starts(experiment: Experiment, settings: StudySettings) -> tuple[float, ...]:
    """Return the first guesses; the flow form tries starts of its own beside one, so the lowest is enough."""
    return settings.starts[:1] if experiment.form == "flow" else settings.starts


def _run(experiment: Experiment, condition: str, parameters: EhaParameters, settings: StudySettings) -> Record:
    rng = stream(settings.seed, "bulk modulus", experiment.plant, experiment.drive, condition)
    drive = make_drive(experiment.drive, settings.duration, settings.sample_time, parameters, rng)
    record = simulate(PLANTS[experiment.plant], drive, settings.sample_time, parameters, sensors=BENCH, rng=rng)
    return record if experiment.pressure_logged else record.replace(differential_pressure_pa=None)


def _row(
    experiment: Experiment, condition: str, start: float, truth: float, found: BulkModulusEstimate
) -> dict[str, object]:
    low, high = found.interval or (None, None)
    settled, std = (found.value, found.std) if found.estimate is None else found.estimate.settled(BULK_MODULUS)
    return {
        "plant": experiment.plant,
        "form": experiment.form,
        "drive": experiment.drive,
        "pressure_logged": experiment.pressure_logged,
        "condition": condition,
        "start_pa": start,
        "outcome": found.outcome.value,
        "value_pa": found.value,
        "std_pa": found.std,
        "ci95_low_pa": low,
        "ci95_high_pa": high,
        "error_percent": None if found.value is None else 100.0 * (found.value / truth - 1.0),
        "bound_percent": 100.0 * found.bound,
        "filter_settled_at_pa": settled,
        "filter_std_pa": std,
        "gate_passed": found.gate.passed,
        "reasons": "; ".join(found.gate.reasons),
        "claim": experiment.claim,
    }


def _curve(experiment: Experiment, condition: str, start: float, found: BulkModulusEstimate) -> pd.DataFrame:
    if found.first_pass is None:
        return pd.DataFrame()
    mean, std = found.first_pass.track(BULK_MODULUS)
    every = max(1, len(mean) // TRACK_POINTS)
    time = found.first_pass.time
    early = np.unique(np.concatenate([np.geomspace(1, len(mean), 60).astype(int) - 1, np.arange(0, len(mean), every)]))
    return pd.DataFrame(
        {
            "plant": experiment.plant,
            "form": experiment.form,
            "drive": experiment.drive,
            "pressure_logged": experiment.pressure_logged,
            "condition": condition,
            "start_pa": start,
            "time_s": time[early],
            "bulk_modulus_pa": mean[early],
            "std_pa": std[early],
        }
    )
