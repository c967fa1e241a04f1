from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from experiments.batch.cases import Task, plan_study
from experiments.batch.series import Group
from experiments.batch.study_file import parse_study
from experiments.batch.work import DRAWN_ONCE, Part, run_task
from plant.eha.drives import DRIVES
from plant.eha.model import EhaParameters
from tests.experiments.batch.conftest import FILTER, small_plan


def table_of(part: Part) -> pa.Table:
    return pq.read_table(BytesIO(part.content), use_threads=False)


def test_one_seed_reproduces_one_case_alone_to_the_last_bit(reference: pa.Table) -> None:
    plan = small_plan()
    for place in (0, 7, 23):
        series, keys, works = plan.groups[place // 3]
        alone = run_task(Task(plan.rig, (Group(series, (keys[place % 3],), (works[place % 3],)),)))
        assert table_of(alone).equals(reference.slice(place, 1))


def test_neither_order_nor_grouping_changes_a_bit(reference: pa.Table) -> None:
    plan = small_plan()
    for pieces in (1, 3, 8):
        shuffled = np.random.default_rng(pieces).permutation(len(plan.groups))
        parts = [
            table_of(run_task(Task(plan.rig, tuple(plan.groups[place] for place in chosen))))
            for chosen in np.array_split(shuffled, pieces)
        ]
        table = pa.concat_tables(parts)
        order = {key: place for place, key in enumerate(table["key"].to_pylist())}
        assert table.take([order[key] for key in plan.keys]).combine_chunks().equals(reference)


def test_the_filter_finds_bulk_modulus_on_its_own_plant() -> None:
    (task,) = small_plan(duration_s=0.5, conditions=["normal"], seeds=1, starts_pa=[2e8]).tasks(set(), 1)
    row = table_of(run_task(task)).to_pylist()[0]
    assert row["outcome"] == "ok"
    assert abs(row["error_percent"]) < 1.0
    assert row["error_percent"] == pytest.approx(100.0 * (row["bulk_modulus_pa"] / row["true_bulk_modulus_pa"] - 1.0))


def test_a_series_that_cannot_be_run_is_rows_with_their_reason() -> None:
    plan = small_plan(seeds=1)
    good, bad = plan.groups
    impossible = replace(bad.series, drive="nothing")  # pyright: ignore -- simulated, not a log
    part = run_task(Task(plan.rig, (good, bad._replace(series=impossible))))
    outcomes = table_of(part)["outcome"].to_pylist()
    assert outcomes == ["ok"] * 3 + ["failed"] * 3
    assert len(part.failures) == 3
    assert "drive must be one of sine" in part.failures[0][1]


def test_a_log_that_cannot_be_read_is_a_row_and_the_others_are_diagnosed(tmp_path: Path) -> None:
    time = np.arange(0.0, 0.5, 1e-3)
    lines = [f"{t:.4f},{100.0 * np.sin(20.0 * t):.6f},{0.03 * np.sin(20.0 * t):.6f}" for t in time]
    good = "time_s,motor_speed_rad_s,velocity_m_s\n" + "\n".join(lines) + "\n"
    for name, text in (("a.csv", good), ("b.csv", good.replace("0.0000", "zero", 1)), ("c.csv", ""), ("d.csv", good)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    logs = [{"glob": "*.csv", "methods": [{"verb": "diagnose"}]}]
    plan = plan_study(parse_study({"name": "logs", "logs": logs}, "logs.toml"), tmp_path)
    (tmp_path / "d.csv").unlink()
    rows = table_of(run_task(Task(plan.rig, plan.groups))).to_pylist()
    assert [row["file"] for row in rows] == ["a.csv", "b.csv", "c.csv", "d.csv"]
    assert [row["outcome"] for row in rows] == ["mismatch", "failed", "failed", "failed"]
    assert "in none of the nine conditions" in rows[0]["reason"]
    assert "the file is empty" in rows[2]["reason"]
    assert "there is no such file" in rows[3]["reason"]


def test_a_log_that_changes_after_the_study_began_is_not_taken_for_what_it_was(tmp_path: Path) -> None:
    text = "time_s,motor_speed_rad_s,velocity_m_s\n" + "".join(f"{0.001 * k:.3f},1,0\n" for k in range(50))
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    logs = [{"glob": "*.csv", "methods": [{"verb": "diagnose"}]}]
    plan = plan_study(parse_study({"name": "logs", "logs": logs}, "logs.toml"), tmp_path)
    (tmp_path / "a.csv").write_text(text.replace("1,0", "2,0"), encoding="utf-8")
    ((_, reason),) = run_task(Task(plan.rig, plan.groups)).failures
    assert "was changed after the study began" in reason


def test_drives_that_are_drawn_once_hold_nothing_random() -> None:
    for name, drive in DRIVES.items():
        one, other = (drive(1.0, 1e-3, EhaParameters(), np.random.default_rng(seed)) for seed in (1, 2))
        assert np.array_equal(one, other) == (name in DRAWN_ONCE), name


def test_a_filter_without_lanes_gives_rows_too() -> None:
    methods = [FILTER, {**FILTER, "method": "filterpy-ekf"}]
    (task,) = small_plan(seeds=1, conditions=["normal"], starts_pa=[2e8], methods=methods).tasks(set(), 1)
    ours, theirs = table_of(run_task(task))["bulk_modulus_pa"].to_pylist()
    assert ours == pytest.approx(theirs, rel=1e-6)


def test_a_filter_that_diverges_beside_others_is_a_row_without_numbers() -> None:
    methods = [FILTER, {**FILTER, "start_std_pa": 1e150}]
    plan = small_plan(seeds=1, conditions=["normal"], starts_pa=[2e8], methods=methods)
    fine, diverged = table_of(run_task(Task(plan.rig, plan.groups))).to_pylist()
    assert (fine["outcome"], diverged["outcome"]) == ("ok", "diverged")
    assert diverged["reason"] == "the estimate stopped being finite"
    numbers = ("bulk_modulus_pa", "bulk_modulus_std_pa", "error_percent", "nis_position", "log_likelihood")
    assert [diverged[name] for name in numbers] == [None] * 5
    assert None not in [fine[name] for name in numbers]
