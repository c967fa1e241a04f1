"""filterpy's extended Kalman filter beside ours, on the same logs with the same initial state, in nine conditions."""

from collections.abc import Mapping
from itertools import product

import numpy as np
import pandas as pd

from estimation.eha.named_methods import NAMED
from estimation.filters.methods import METHODS
from estimation.filters.run import Estimate, available_channels, run_filter
from estimation.log_checks.first_belief import START_STD, first_belief
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from experiments.nine_conditions.bulk_modulus import (
    PRESSURE_STEPS,
    PUBLISHED_METHOD,
    PUBLISHED_METHOD_STICKING,
    Experiment,
)
from experiments.nine_conditions.settings import StudySettings
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.model import EhaParameters

COMPARED_EXPERIMENTS = (PUBLISHED_METHOD, PUBLISHED_METHOD_STICKING, PRESSURE_STEPS)
"""The published filter with its printed noise, once on the plant that it assumes and once not; and our filter."""

EQUALITY_TOLERANCE = 1e-6
"""Largest relative difference between two tracks of bulk modulus that count as equal [dimensionless]."""


def filterpy_study(rig: EhaParameters, settings: StudySettings, track: Track = without_progress) -> pd.DataFrame:
    """Run filterpy's extended Kalman filter and ours on the same logs.

    Returns
    -------
    pandas.DataFrame
        One row for each experiment and condition: plant, form, drive, pressure_logged, condition, steps, ours_pa and
        filterpy_pa (bulk modulus after the last step), largest_difference (of the two tracks, relative), verdict.
    """

    def compare(case: tuple[Experiment, str]) -> dict[str, object]:
        experiment, name = case
        p = parameters_for(CONDITIONS[name], rig)
        rng = stream(settings.seed, "bulk modulus", experiment.plant, experiment.drive, name)
        record = experiment.record(p, settings, rng)
        record = record.slice(0, settings.filterpy_samples)
        model = FORMS[experiment.form]
        named = NAMED.get(experiment.method)
        channels = tuple(named.variances) if named else available_channels(model, record)
        variances = dict(named.variances) if named else measurement_variances(record, channels)
        noise = dict(named.noise) if named else None
        prior = first_belief(model, record, settings.starts[-1], START_STD)
        ours, theirs = (
            run_filter(METHODS[way], model, prior, record, p, channels=channels, variances=variances, noise=noise)
            for way in ("ekf", "filterpy-ekf")
        )
        head = {**experiment._asdict(), "condition": name, "steps": len(record.time) - 1}
        return {**head, **track_comparison(ours, theirs)}

    cases = list(product(COMPARED_EXPERIMENTS, CONDITIONS))
    done = track(map_in_parallel(compare, cases), len(cases), description="filterpy's filter beside ours")
    return pd.DataFrame(list(done))


def track_comparison(ours: Estimate, theirs: Estimate) -> Mapping[str, object]:
    """Return the comparison of two filters' tracks of bulk modulus.

    Returns
    -------
    Mapping[str, object]
        ours_pa, filterpy_pa, largest_difference, verdict.
    """
    mine, its = ours.track(BULK_MODULUS)[0], theirs.track(BULK_MODULUS)[0]
    lost = int(np.argmax(~np.isfinite(its))) if not np.all(np.isfinite(its)) else None
    scale = ours.model.states[ours.model.index(BULK_MODULUS)].scale
    upto = slice(None, lost)
    apart = np.abs(its[upto] - mine[upto]) / np.maximum(np.abs(mine[upto]), scale)
    most = float(apart.max()) if len(apart) else float("nan")
    if lost is not None:
        verdict = f"filterpy fails at {theirs.time[lost]:.3g} s"
    elif not np.all(np.isfinite(mine)):
        verdict = "ours fails"
    else:
        verdict = "equal" if most <= EQUALITY_TOLERANCE else "differs"
    return {
        "ours_pa": float(mine[-1]),
        "filterpy_pa": float(its[-1]),
        "largest_difference": most,
        "verdict": verdict,
    }


def verdict_counts(frame: pd.DataFrame) -> Mapping[str, int]:
    """Return the number of runs that are equal, differ, or fail."""
    verdicts = frame["verdict"]
    return {
        "equal": int((verdicts == "equal").sum()),
        "differs": int((verdicts == "differs").sum()),
        "fails": int(verdicts.str.contains("fails").sum()),
    }
