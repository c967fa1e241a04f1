"""Effective bulk modulus in nine conditions, from many first guesses: Figure 11, and where its method fails."""

from collections.abc import Mapping
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd

from estimation.eha.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from estimation.filters.run import Estimate
from estimation.models.eha_forms import BULK_MODULUS
from experiments.nine_conditions.settings import StudySettings
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import PLANTS, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH


class Experiment(NamedTuple):
    """One way to estimate bulk modulus, identified by the columns of the tables."""

    plant: str
    form: str
    drive: str
    pressure_logged: bool

    @property
    def method(self) -> str:
        """Filter of the form: the published one with the published noise."""
        return "published-ekf" if self.form == "acceleration" else "auto"

    def record(self, p: EhaParameters, settings: StudySettings, rng: np.random.Generator) -> Record:
        """Return a run of the experiment as the bench would log it."""
        drive = make_drive(self.drive, settings.duration, settings.sample_time, p, rng)
        record = simulate(PLANTS[self.plant], drive, settings.sample_time, p, sensors=BENCH, rng=rng)
        return record if self.pressure_logged else record.replace(differential_pressure_pa=None)


PUBLISHED_METHOD = Experiment("reduced", "acceleration", "sine", False)
"""The published filter on the plant that it assumes."""

PUBLISHED_METHOD_STICKING = Experiment("lumped", "acceleration", "sine", False)
"""The published filter on a plant that sticks (errata E9)."""

PRESSURE_SINE = Experiment("lumped", "pressure", "sine", True)
"""Our filter on the paper's sine, pressure logged."""

PRESSURE_STEPS = Experiment("lumped", "pressure", "steps", True)
"""Our filter on the nine steps, pressure logged."""

POSITION_STEPS = Experiment("lumped", "pressure", "steps", False)
"""Our filter on the nine steps, with position and velocity only."""

POSITION_SINE = Experiment("lumped", "pressure", "sine", False)
"""Our filter on the paper's sine, with position and velocity only (errata E13)."""

EXPERIMENTS: Mapping[Experiment, str] = {
    PUBLISHED_METHOD: "The published method on the plant that it assumes.",
    PUBLISHED_METHOD_STICKING: "The published method on a plant that sticks (errata E9).",
    PRESSURE_SINE: "Our method on the plant that sticks, pressure logged.",
    PRESSURE_STEPS: "Our method on the nine steps, pressure logged.",
    POSITION_STEPS: "Our method on the nine steps, position and velocity alone.",
    Experiment("lumped", "flow", "steps", True): (
        "The flow balance alone: condition unknown, leakage found along with it."
    ),
    POSITION_SINE: "Stuck, position and velocity hold nothing (errata E13).",
}

TRACK_POINTS = 200
"""Number of points kept of a convergence curve."""


def bulk_modulus_study(
    rig: EhaParameters, settings: StudySettings, track: Track = without_progress
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Estimate bulk modulus in every experiment and condition, from every first guess.

    Returns
    -------
    tuple of pandas.DataFrame
        One row for each estimate; and the convergence curves in long form.
    """

    def estimate(case: tuple[Experiment, str]) -> list[tuple[dict[str, object], pd.DataFrame]]:
        experiment, name = case
        p = parameters_for(CONDITIONS[name], rig)
        rng = stream(settings.seed, "bulk modulus", experiment.plant, experiment.drive, name)
        record = experiment.record(p, settings, rng)
        flow = experiment.form == "flow"  # the estimator adds starts of its own, so the lowest guess is enough
        results: list[tuple[dict[str, object], pd.DataFrame]] = []
        for start in settings.starts[:1] if flow else settings.starts:
            found = estimate_bulk_modulus(
                record, rig if flow else p, form=experiment.form, method=experiment.method, start=start
            )
            head = {**experiment._asdict(), "condition": name, "start_pa": start}
            row = head | estimate_entries(found, p.bulk_modulus) | {"claim": EXPERIMENTS[experiment]}
            results.append((row, _curve(found.first_pass, head)))
        return results

    cases = list(product(EXPERIMENTS, CONDITIONS))
    done = track(map_in_parallel(estimate, cases), len(cases), description="estimating bulk modulus")
    rows, curves = zip(*(one for results in done for one in results), strict=True)
    return pd.DataFrame(rows), pd.concat(curves, ignore_index=True)


def estimate_entries(found: BulkModulusEstimate, truth: float) -> dict[str, object]:
    """Return an estimate as entries of a table's row.

    Parameters
    ----------
    truth : float
        Simulated bulk modulus [Pa].

    Returns
    -------
    dict[str, object]
        Outcome, value, interval, error, bound, the value that the filter settles at, and the gate.
    """
    low, high = found.interval or (None, None)
    settled, std = (found.value, found.std) if found.estimate is None else found.estimate.settled(BULK_MODULUS)
    return {
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
        "reasons": "; ".join(map(str, found.gate.reasons)),
    }


def _curve(run: Estimate | None, head: Mapping[str, object]) -> pd.DataFrame:
    if run is None:
        return pd.DataFrame()
    mean, std = run.track(BULK_MODULUS)
    every = max(1, len(mean) // TRACK_POINTS)
    early = np.unique(np.concatenate([np.geomspace(1, len(mean), 60).astype(int) - 1, np.arange(0, len(mean), every)]))
    return pd.DataFrame({**head, "time_s": run.time[early], "bulk_modulus_pa": mean[early], "std_pa": std[early]})
