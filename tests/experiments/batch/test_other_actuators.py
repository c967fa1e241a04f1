"""A batch study of other actuators: its runs, and a finding as a row."""

import json

import numpy as np
import pytest

from experiments.actuators import actuator
from experiments.batch.other_actuators import analyse_to_row, simulated_run, simulated_series
from experiments.batch.study_file import Runs, parse_study


def runs_of(plant: str, **given: object) -> Runs:
    content = {"name": "a", "plant": plant, "runs": [{"methods": [{"verb": "diagnose"}], **given}]}
    return parse_study(content, "study.toml").runs[0]


def test_every_condition_is_run_with_every_seed_and_sensor_set() -> None:
    kind = actuator("piezo-stack")
    runs = runs_of("piezo-stack", sensors=["bench"], seeds=2)
    series = list(simulated_series(kind, runs))
    assert [(one.condition, one.seed) for one in series] == [
        (name, seed) for name in kind.conditions for seed in (0, 1)
    ]
    assert {one.plant for one in series} == {"piezo-stack"}


def test_a_duration_in_the_study_replaces_that_of_the_kind_of_actuator() -> None:
    kind = actuator("piezo-stack")
    own = next(simulated_series(kind, runs_of("piezo-stack", conditions=["normal"])))
    given = next(simulated_series(kind, runs_of("piezo-stack", conditions=["normal"], duration_s=0.03)))
    assert own.sample_time_s == given.sample_time_s == kind.simulate.options["sample_time"]
    assert (own.duration_s, given.duration_s) == (0.0, 0.03)


def test_a_row_contains_the_condition_that_the_kind_s_diagnosis_found() -> None:
    kind = actuator("piezo-stack")
    rig = kind.rig
    (one,) = simulated_series(kind, runs_of("piezo-stack", conditions=["major_leakage"], duration_s=0.03))
    record = simulated_run(kind, one, rig)
    assert record.duration == pytest.approx(0.03)
    row = analyse_to_row(kind, "diagnose", record, rig)
    assert (row["outcome"], row["found_condition"], row["trusted"]) == ("ok", "major_leakage", True)
    quantities = json.loads(row["quantities"])
    assert all(np.isfinite(one["value"]) for one in quantities.values() if one["value"] is not None)


def test_a_diagnosis_row_has_the_runner_up_and_its_margin() -> None:
    kind = actuator("diaphragm-motor")
    rig = kind.rig
    (one,) = simulated_series(kind, runs_of("diaphragm-motor", duration_s=0.15))
    assert one.condition == kind.conditions[0]
    row = analyse_to_row(kind, "diagnose", simulated_run(kind, one, rig), rig)
    assert row["found_condition"] == "healthy"
    assert row["margin"] > 1.0
    assert row["runner_up"] in set(kind.conditions) - {"healthy"}
