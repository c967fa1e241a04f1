from dataclasses import replace
from pathlib import Path

import pytest

from estimation.engine.kernels import LANES
from experiments.batch import cases
from experiments.batch.cases import Plan, config_hash, plan_study
from experiments.batch.study_file import StudyError, parse_study
from tests.experiments.batch.conftest import small_plan

DIAGNOSE = {"verb": "diagnose"}


def test_a_study_has_every_combination_once() -> None:
    plan = small_plan()
    assert len(plan) == len(set(plan.keys)) == 2 * 4 * 3


def test_a_changed_study_keeps_the_keys_of_its_unchanged_cases() -> None:
    before, more_seeds = set(small_plan().keys), set(small_plan(seeds=5).keys)
    other_starts = set(small_plan(starts_pa=[2e8, 3e8]).keys)
    assert before < more_seeds
    assert len(before & other_starts) == 8
    assert not before & set(small_plan(duration_s=0.06).keys)


def test_keys_depend_on_the_rig() -> None:
    plan = small_plan()
    parameters = replace(plan.rig.parameters, moving_mass=21.0)
    assert not set(plan.keys) & set(replace(plan, rig=replace(plan.rig, parameters=parameters)).keys)


def test_keys_depend_on_what_was_measured_on_the_bench() -> None:
    """Before, results stayed those of a volume known to 15 % after the rig file said that it was measured."""
    plan = small_plan()
    measured = replace(plan, rig=replace(plan.rig, measured=("chamber_volume",)))
    assert not set(plan.keys) & set(measured.keys)
    names = ("piston_area", "chamber_volume")
    one, other = (replace(plan, rig=replace(plan.rig, measured=order)) for order in (names, names[::-1]))
    assert one.keys == other.keys


@pytest.mark.parametrize("workers", [1, 2, 40])
def test_tasks_contain_every_unfinished_case_exactly_once(workers: int) -> None:
    plan = small_plan()
    done = set(plan.keys[3:9])
    given = [key for task in plan.tasks(done, workers) for key in task.keys]
    assert sorted(given) == sorted(set(plan.keys) - done)


def test_a_task_contains_one_condition_and_fills_its_filter_lanes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "MOST_CASES", 2048)
    tasks = list(small_plan(seeds=64).tasks(set(), 2))
    conditions = [{group.series.condition for group in task.groups} for task in tasks]  # pyright: ignore -- simulated, not logs
    sizes = [len(task.keys) for task in tasks]
    assert max(map(len, conditions)) == 1
    assert sum(-(-size // LANES) for size in sizes) == 2 * 64 * 3 // LANES


def test_a_study_can_give_severities_instead_of_conditions() -> None:
    plan = small_plan(conditions=None, severities=[[0.5, 0.0], [1.0, 1.5]])
    places = {(one.condition, one.leakage_severity, one.friction_severity) for one in plan.blocks[0][0]}  # pyright: ignore
    assert places == {(None, 0.5, 0.0), (None, 1.0, 1.5)}


def test_the_key_of_a_log_depends_on_its_content_and_not_on_its_folder(tmp_path: Path) -> None:
    def keys(folder: str, text: str, notes: str = "") -> list[str]:
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "run.csv").write_text(text, encoding="utf-8")
        if notes:
            (tmp_path / folder / "run.csv.json").write_text(notes, encoding="utf-8")
        study = parse_study({"name": "logs", "logs": [{"glob": "*.csv", "methods": [DIAGNOSE]}]}, "logs.toml")
        return plan_study(study, tmp_path / folder).keys

    assert keys("here", "a") == keys("there", "a")
    assert len({*keys("here", "a"), *keys("here", "b"), *keys("here", "b", "{}")}) == 3


def test_a_glob_without_a_file_is_an_error(tmp_path: Path) -> None:
    study = parse_study({"name": "logs", "logs": [{"glob": "*.csv", "methods": [DIAGNOSE]}]}, "logs.toml")
    with pytest.raises(StudyError, match=r"logs\[0\]\.glob must match at least one file"):
        plan_study(study, tmp_path)


def test_a_block_of_more_than_a_million_series_is_refused_before_it_is_listed() -> None:
    study = parse_study({"name": "s", "runs": [{"seeds": 1_000_000, "methods": [DIAGNOSE]}]}, "s.toml")
    with pytest.raises(StudyError, match=r"runs\[0\] must be at most 1,000,000 series, got up to 9,000,000"):
        plan_study(study, Path())


def test_a_log_uses_the_rig_file_of_the_nearest_folder_and_its_key_depends_on_it(tmp_path: Path) -> None:
    for name in ("small/a.csv", "large/b.csv", "large/worn/c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text(f"{name}\n", encoding="utf-8")

    def plan(area: float, **more: object) -> Plan:
        (tmp_path / "large" / "rig.toml").write_text(f"name = 'large'\n[parameters]\npiston_area = {area}\n")
        logs = [{"glob": "**/*.csv", "methods": [DIAGNOSE]}]
        return plan_study(parse_study({"name": "two sizes", "logs": logs, **more}, "two.toml"), tmp_path)

    rigs = {"rigs": {"large": "large/rig.toml"}}
    one, more, none = plan(3e-3, **rigs), plan(4e-3, **rigs), plan(3e-3)
    given = [(task, group.series) for task in one.tasks(set(), 1) for group in task.groups]
    areas = {series.file: task.rig_of(series).parameters.piston_area for task, series in given}  # pyright: ignore
    assert areas == {"large/b.csv": 3e-3, "large/worn/c.csv": 3e-3, "small/a.csv": one.rig.parameters.piston_area}
    shared = [set(one.keys) & set(other.keys) for other in (more, none)]
    small = next(group.keys[0] for group in one.groups if group.series.file == "small/a.csv")  # pyright: ignore
    assert shared == [{small}, {small}]
    assert config_hash(one.study, one.rig, one.rigs) != config_hash(more.study, more.rig, more.rigs)
