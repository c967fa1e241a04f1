from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from experiments.batch import work
from experiments.batch.cases import Plan, Task, plan_study
from experiments.batch.series import Group
from experiments.batch.study_file import parse_study
from experiments.batch.work import DETERMINISTIC_DRIVES, Part, lost_task, run_task
from experiments.cli import app
from plant.eha.drives import DRIVES
from plant.eha.model import EhaParameters
from tests.experiments.batch.conftest import FILTER, small_plan


def table_of(part: Part) -> pa.Table:
    return pq.read_table(BytesIO(part.content), use_threads=False)


def test_a_case_run_alone_has_exactly_the_row_of_the_whole_study(reference: pa.Table) -> None:
    plan = small_plan()
    for place in (0, 7, 23):
        series, keys, works = plan.groups[place // 3]
        alone = run_task(Task(plan.rig, (Group(series, (keys[place % 3],), (works[place % 3],)),)))
        assert table_of(alone).equals(reference.slice(place, 1))


def test_neither_order_nor_grouping_of_series_changes_a_row(reference: pa.Table) -> None:
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


def test_the_filter_estimates_bulk_modulus_within_1_percent_on_its_own_model() -> None:
    (task,) = small_plan(duration_s=0.5, conditions=["normal"], seeds=1, starts_pa=[2e8]).tasks(set(), 1)
    row = table_of(run_task(task)).to_pylist()[0]
    assert row["outcome"] == "ok"
    assert abs(row["error_percent"]) < 1.0
    assert row["error_percent"] == pytest.approx(100.0 * (row["bulk_modulus_pa"] / row["true_bulk_modulus_pa"] - 1.0))


def test_each_case_of_a_series_that_cannot_be_run_is_a_failed_row_with_the_reason() -> None:
    plan = small_plan(seeds=1)
    good, bad = plan.groups
    impossible = replace(bad.series, drive="nothing")  # pyright: ignore -- simulated, not a log
    part = run_task(Task(plan.rig, (good, bad._replace(series=impossible))))
    outcomes = table_of(part)["outcome"].to_pylist()
    assert outcomes == ["ok"] * 3 + ["failed"] * 3
    assert len(part.failures) == 3
    assert "drive must be one of sine" in part.failures[0].reason


def test_a_log_that_cannot_be_read_is_a_row_and_the_others_are_diagnosed(tmp_path: Path) -> None:
    time = np.arange(0.0, 0.5, 1e-3)
    lines = [f"{t:.4f},{100.0 * np.sin(20.0 * t):.6f},{0.03 * np.sin(20.0 * t):.6f}" for t in time]
    good = "time_s,motor_speed_rad_s,velocity_m_s\n" + "\n".join(lines) + "\n"
    for name, text in (("a.csv", good), ("b.csv", good.replace("0.00", "zero.00")), ("c.csv", ""), ("d.csv", good)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    logs = [{"glob": "*.csv", "methods": [{"verb": "diagnose"}]}]
    plan = plan_study(parse_study({"name": "logs", "logs": logs}, "logs.toml"), tmp_path)
    (tmp_path / "d.csv").unlink()
    rows = table_of(run_task(Task(plan.rig, plan.groups))).to_pylist()
    assert [row["file"] for row in rows] == ["a.csv", "b.csv", "c.csv", "d.csv"]
    assert [row["outcome"] for row in rows] == ["mismatch", "failed", "failed", "failed"]
    assert "none of the nine conditions fits" in rows[0]["reason"]
    assert "the file is empty" in rows[2]["reason"]
    assert not any(str(tmp_path) in row["reason"] for row in rows)  # the row already names its log
    assert "there is no such file" in rows[3]["reason"]


def test_a_log_that_was_changed_after_the_study_began_fails(tmp_path: Path) -> None:
    text = "time_s,motor_speed_rad_s,velocity_m_s\n" + "".join(f"{0.001 * k:.3f},1,0\n" for k in range(50))
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    logs = [{"glob": "*.csv", "methods": [{"verb": "diagnose"}]}]
    plan = plan_study(parse_study({"name": "logs", "logs": logs}, "logs.toml"), tmp_path)
    (tmp_path / "a.csv").write_text(text.replace("1,0", "2,0"), encoding="utf-8")
    (failure,) = run_task(Task(plan.rig, plan.groups)).failures
    assert "was changed after the study began" in failure.reason


def test_exactly_the_drives_drawn_once_are_the_same_for_every_seed() -> None:
    for name, drive in DRIVES.items():
        one, other = (drive(1.0, 1e-3, EhaParameters(), np.random.default_rng(seed)) for seed in (1, 2))
        assert np.array_equal(one, other) == (name in DETERMINISTIC_DRIVES), name


def test_a_filter_without_lanes_gives_the_same_estimate() -> None:
    methods = [FILTER, {**FILTER, "method": "filterpy-ekf"}]
    (task,) = small_plan(seeds=1, conditions=["normal"], starts_pa=[2e8], methods=methods).tasks(set(), 1)
    ours, theirs = table_of(run_task(task))["bulk_modulus_pa"].to_pylist()
    assert ours == pytest.approx(theirs, rel=1e-6)


def test_a_diverged_filter_is_a_row_without_numbers_and_the_others_keep_theirs() -> None:
    methods = [FILTER, {**FILTER, "start_std_pa": 1e150}]
    plan = small_plan(seeds=1, conditions=["normal"], starts_pa=[2e8], methods=methods)
    fine, diverged = table_of(run_task(Task(plan.rig, plan.groups))).to_pylist()
    assert (fine["outcome"], diverged["outcome"]) == ("ok", "diverged")
    assert diverged["reason"] == "the estimate stopped being finite"
    numbers = ("bulk_modulus_pa", "bulk_modulus_std_pa", "error_percent", "nis_position", "log_likelihood")
    assert [diverged[name] for name in numbers] == [None] * 5
    assert None not in [fine[name] for name in numbers]


def rows_of(plan: Plan) -> list[dict[str, Any]]:
    return table_of(run_task(Task(plan.rig, plan.groups, plan.study.plant))).to_pylist()


def test_a_filter_uses_pressure_only_if_allowed_and_starts_from_the_rig_s_guess_by_default() -> None:
    pressure = {"verb": "filter", "form": "pressure", "method": "ekf"}
    methods = [pressure, {**pressure, "pressure": False}]
    change = {"plants": ["lumped"], "drives": ["steps"], "conditions": ["normal"], "seeds": 1, "duration_s": 0.5}
    told = rows_of(
        small_plan(**change, methods=methods, starts_pa=[EhaParameters().bulk_modulus, 1e8], sample_time_s=1e-3)
    )
    own = rows_of(small_plan(**change, methods=methods, starts_pa=[], sample_time_s=1e-3))
    assert [row["nis_pressure"] is None for row in own] == [False, True]
    by_use = {pressure: [row for row in told if row["pressure"] is pressure] for pressure in (True, False)}
    for row in own:
        same, other = by_use[row["pressure"]]
        assert row["bulk_modulus_pa"] == pytest.approx(same["bulk_modulus_pa"], rel=1e-12)
        assert row["bulk_modulus_pa"] != other["bulk_modulus_pa"]


def test_a_filter_is_given_the_simulated_condition_or_the_healthy_rig_as_the_study_says() -> None:
    filters = [{**FILTER, "told": told} for told in ("condition", "healthy")]
    change = {"conditions": ["major_leakage"], "seeds": 1, "starts_pa": [2e8], "duration_s": 0.5}
    knowing, healthy = rows_of(small_plan(**change, methods=filters))
    assert (knowing["told"], healthy["told"]) == ("condition", "healthy")
    assert 5.0 * abs(knowing["error_percent"]) < abs(healthy["error_percent"])


def test_the_row_of_a_simulated_run_has_the_error_and_the_innovations_of_its_filter() -> None:
    change = {"plants": ["lumped"], "drives": ["steps"], "conditions": ["normal"], "seeds": 1}
    asked = [{"verb": "estimate", "form": "pressure", "method": "ekf"}, {"verb": "estimate"}]
    plan = small_plan(**change, duration_s=1.0, sample_time_s=1e-3, starts_pa=[], methods=asked)
    filtered, fitted = rows_of(plan)
    for row in (filtered, fitted):
        truth = EhaParameters().bulk_modulus
        assert row["true_bulk_modulus_pa"] == truth
        assert row["error_percent"] == pytest.approx(100.0 * (row["bulk_modulus_pa"] / truth - 1.0))
    assert filtered["nis_pressure"] > 0.0


def log_of(seconds: float = 0.5, **changes: np.ndarray) -> str:
    """Return a log with motion, as CSV."""
    time = np.arange(0.0, seconds, 1e-3)
    columns = {
        "motor_speed_rad_s": 100.0 * np.sin(20.0 * time),
        "position_m": -1.5e-3 * np.cos(20.0 * time),
        "velocity_m_s": 0.03 * np.sin(20.0 * time),
        **changes,
    }
    rows = np.column_stack([time, *columns.values()])
    lines = [",".join(f"{one:.9g}" if np.isfinite(one) else "" for one in row) for row in rows]
    return "\n".join([",".join(["time_s", *columns]), *lines]) + "\n"


def logs_plan(folder: Path, *methods: dict[str, Any], plant: str = "eha") -> Plan:
    content = {"name": "logs", "plant": plant, "logs": [{"glob": "*.csv", "methods": list(methods)}]}
    return plan_study(parse_study(content, "logs.toml"), folder)


def test_warnings_of_reading_a_log_are_in_each_of_its_rows(tmp_path: Path) -> None:
    speed = 100.0 * np.sin(20.0 * np.arange(0.0, 0.5, 1e-3))
    speed[100:103] = np.nan
    (tmp_path / "a.csv").write_text(log_of(motor_speed_rad_s=speed), encoding="utf-8")
    (tmp_path / "b.csv").write_text(log_of(), encoding="utf-8")
    rows = rows_of(logs_plan(tmp_path, FILTER, {"verb": "estimate", "form": "acceleration", "method": "ekf"}))
    assert [row["file"] for row in rows] == ["a.csv", "a.csv", "b.csv", "b.csv"]
    holed, whole = rows[:2], rows[2:]
    assert all("motor_speed_rad_s is missing in 3" in row["warnings"] for row in holed)
    assert not any("missing in" in (row["warnings"] or "") for row in whole)
    assert whole[0]["true_bulk_modulus_pa"] is None
    assert whole[0]["error_percent"] is None
    assert whole[0]["duration_s"] == pytest.approx(0.5, abs=2e-3)


def test_a_method_that_fails_on_a_log_is_a_failed_row_and_the_others_are_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("by nothing")

    (tmp_path / "a.csv").write_text(log_of(), encoding="utf-8")
    monkeypatch.setattr(work, "diagnose_to_row", broken)
    rows = rows_of(logs_plan(tmp_path, {"verb": "diagnose"}, FILTER))
    outcomes = {row["verb"]: row["outcome"] for row in rows}
    assert outcomes == {"diagnose": "failed", "filter": "ok"}
    (reason,) = (row["reason"] for row in rows if row["verb"] == "diagnose")
    assert reason == "an internal error, ZeroDivisionError: by nothing"


def test_a_study_of_another_actuator_has_simulated_and_found_conditions_of_that_kind(tmp_path: Path) -> None:
    methods = [{"verb": "diagnose"}]
    runs = [{"conditions": ["normal"], "duration_s": 0.03, "methods": methods}]
    content = {"name": "stack", "plant": "piezo-stack", "runs": runs}
    (simulated,) = rows_of(plan_study(parse_study(content, "stack.toml"), tmp_path))
    assert (simulated["plant"], simulated["condition"]) == ("piezo-stack", "normal")
    assert simulated["found_condition"] == "normal"
    out = tmp_path / "run.csv"
    words = ["simulate", "--plant", "piezo-stack", "--duration", "0.03", "--fault", "major_leakage", "--out", str(out)]
    assert CliRunner().invoke(app, words).exit_code == 0
    (logged,) = rows_of(logs_plan(tmp_path, *methods, plant="piezo-stack"))
    assert (logged["plant"], logged["file"], logged["found_condition"]) == ("piezo-stack", "run.csv", "major_leakage")


def test_cases_of_a_worker_that_ended_become_failed_rows_with_their_keys() -> None:
    plan = small_plan(seeds=1)
    task = Task(plan.rig, plan.groups)
    part = lost_task(task, "the worker ended")
    rows = table_of(part).to_pylist()
    assert [row["key"] for row in rows] == list(plan.keys)
    assert {(row["outcome"], row["reason"]) for row in rows} == {("failed", "the worker ended")}
    assert part.failures[0] == ("reduced sine normal seed 0", "filter", "the worker ended")
    assert len(part.failures) == len(rows)
