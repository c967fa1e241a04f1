"""A log that is estimated and diagnosed in one batch is estimated once, and each case has the same row as alone."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from estimation.eha.estimate import estimate_log
from experiments.batch import work
from experiments.batch.cases import Plan, Task, plan_study
from experiments.batch.series import Group
from experiments.batch.study_file import parse_study
from experiments.eha.entries import estimate_message
from faults.conditions import severity
from plant.eha.drives import make_drive
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.files import write_record
from plant.sensors.sensors import BENCH
from tests.experiments.batch.test_work import table_of

METHODS = [{"verb": "estimate"}, {"verb": "diagnose"}, {"verb": "estimate", "form": "pressure"}]


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    rng, p = np.random.default_rng(8), severity(0.6, 0.0)
    record = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    pressure = record["differential_pressure_pa"].copy()
    pressure[700] = 9e7  # an outlier: it is left out, with a warning
    write_record(record.replace(differential_pressure_pa=pressure), tmp_path / "log.csv")
    return plan_of(tmp_path)


def plan_of(tmp_path: Path) -> Plan:
    study = parse_study({"name": "logs", "logs": [{"glob": "*.csv", "methods": METHODS}]}, "logs.toml")
    return plan_study(study, tmp_path)


def rows_of(plan: Plan, places: list[int]) -> pa.Table:
    (series, keys, works) = plan.groups[0]
    group = Group(series, tuple(keys[place] for place in places), tuple(works[place] for place in places))
    return table_of(work.run_task(Task(plan.rig, (group,))))


def test_cases_that_share_an_estimate_get_the_same_rows_as_alone(plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = pa.concat_tables([rows_of(plan, [place]) for place in range(len(METHODS))])
    made: list[int] = []
    usual = work.checked_estimate

    def counted(*given: object) -> object:
        made.append(1)
        return usual(*given)  # pyright: ignore[reportArgumentType] -- as it came

    monkeypatch.setattr(work, "checked_estimate", counted)
    for order in ([0, 1, 2], [1, 0, 2]):
        assert rows_of(plan, order).equals(alone.take(order).combine_chunks())
    assert len(made) == 2
    assert alone["warnings"].to_pylist()[0]


@pytest.mark.parametrize("place", [[0], [0, 1]])
def test_a_row_without_a_bulk_modulus_gives_the_reason_of_the_verb_estimate(tmp_path: Path, place: list[int]) -> None:
    rng, p = np.random.default_rng(8), severity(0.6, 0.0)
    record = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    reversed_speed = record.replace(motor_speed_rad_s=-record["motor_speed_rad_s"])
    write_record(reversed_speed, tmp_path / "log.csv")
    row = rows_of(plan_of(tmp_path), place).to_pylist()[0]
    assert row["outcome"] == "mismatch"
    assert row["reason"] == estimate_message(estimate_log(reversed_speed, Rig()))
    assert "the sign of motor_speed_rad_s is wrong" in row["reason"]
