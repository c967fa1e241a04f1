"""Cases of a study whose actuator is not the gear-pump one: its registered kind simulates and analyses them."""

import json
from collections.abc import Iterator

from estimation.finding import Finding
from experiments.actuator_kind import ActuatorKind, LogVerb
from experiments.actuators import verb_of_kind
from experiments.batch.rows import Row
from experiments.batch.series import Simulated
from experiments.batch.study_file import Runs
from experiments.log_pages.entries import quantity_entry
from plant.eha.rig import Rig
from plant.log.record import Record
from plant.notes import distinct


def simulated_series(kind: ActuatorKind, runs: Runs) -> Iterator[Simulated]:
    """Yield the series of runs, every condition with every seed.

    Yields
    ------
    Simulated
        Without a drive and severities, which are the gear-pump actuator's.
    """
    options = verb_of_kind(kind, "simulate").options
    given = {
        name: getattr(runs, f"{name}_s") for name in ("duration", "sample_time") if f"{name}_s" in runs.model_fields_set
    }
    times = {name: float(given.get(name) or options.get(name) or 0.0) for name in ("duration", "sample_time")}
    healthy = kind.conditions[:1] or ("healthy",)
    names = runs.conditions or (kind.conditions if "condition" in options else healthy)
    for sensors in runs.sensors:
        for name in names:
            for seed in runs.seed_list:
                yield Simulated(kind.name, "", sensors, name, 0.0, 0.0, seed, times["duration"], times["sample_time"])


def simulated_run(kind: ActuatorKind, series: Simulated, rig: Rig) -> Record:
    """Simulate a run and return its log.

    Parameters
    ----------
    series : Simulated
        A series from `simulated_series`.
    """
    simulation = verb_of_kind(kind, "simulate")
    asked = {
        "condition": series.condition,
        "sensors": series.sensors,
        "duration": series.duration_s or None,
        "sample_time": series.sample_time_s or None,
    }
    options = {**simulation.options, **{name: value for name, value in asked.items() if name in simulation.options}}
    return simulation.run(rig, {**options, "seed": series.seed, "plant": None}).record


def analyse_to_row(kind: ActuatorKind, verb: str, record: Record, rig: Rig) -> Row:
    """Estimate or diagnose a log, and return the findings as entries of a row.

    Returns
    -------
    Row
        Outcome, reason, the condition if one is named, and every quantity.
    """
    asked: LogVerb = verb_of_kind(kind, verb)
    return finding_row(asked.run(record, *asked.prepare(rig, {**asked.options, "seed": 0})))


def finding_row(found: Finding) -> Row:
    """Return a finding as entries of a row.

    Returns
    -------
    Row
        As `analyse_to_row` returns them.
    """
    reasons = [str(note) for note in distinct((*found.against, *found.gate.reasons, *found.notes))]
    shares = sorted(found.probabilities.items(), key=lambda item: -item[1])
    quantities = {name: quantity_entry(one) for name, one in {**found.quantities, **found.severities}.items()}
    row: Row = {
        "outcome": found.outcome.value,
        "reason": "; ".join(reasons) or None,
        "trusted": found.gate.passed and not found.unknown,
        "found_condition": None if found.unknown else " or ".join(found.named) or None,
        "quantities": json.dumps(quantities),
    }
    if len(shares) > 1:
        row |= {"runner_up": shares[1][0], "margin": shares[0][1] / max(shares[1][1], 1e-300)}
    return row
