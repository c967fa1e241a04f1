"""Each log of a study counts once under any of its names, and one bad name does not spoil the other results."""

import os
from pathlib import Path

import numpy as np
import pytest

from experiments.batch.cases import Plan, plan_study
from experiments.batch.study_file import parse_study
from experiments.batch.work import run_task
from plant.log.files import write_record
from plant.log.record import Record

GLOB = "**/*.csv"


def small_log() -> Record:
    """Return a log that can be read and diagnosed without any remark: its piston stands still."""
    return Record(1e-3, {name: np.zeros(400) for name in ("motor_speed_rad_s", "position_m", "velocity_m_s")})


def planned(folder: Path, pattern: str = GLOB, **more: object) -> Plan:
    content = {"name": "s", "logs": [{"glob": pattern, "methods": [{"verb": "diagnose"}]}], **more}
    return plan_study(parse_study(content, "s.toml"), folder)


def files(plan: Plan) -> list[str]:
    return [one.file for one in plan.blocks[0][0]]  # pyright: ignore -- logs, not simulated


def test_a_log_with_two_links_to_it_is_listed_once(tmp_path: Path) -> None:
    write_record(small_log().annotate(condition="normal"), tmp_path / "run.csv")
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "link.csv").symlink_to(tmp_path / "run.csv")
    (tmp_path / "a.csv").symlink_to("run.csv")
    plan = planned(tmp_path)
    assert files(plan) == ["run.csv"]
    assert plan.links == {"a.csv": "run.csv", "below/link.csv": "run.csv"}
    linked = planned(tmp_path, "a.csv")
    (failures,) = [run_task(task).failures for task in linked.tasks(set(), 1)]
    assert (files(linked), failures) == (["a.csv"], ())


def test_two_hard_links_to_one_file_are_one_log(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,u\n0,1\n")
    os.link(tmp_path / "a.csv", tmp_path / "b.csv")
    (tmp_path / "copy.csv").write_text("t,u\n0,1\n")
    assert files(planned(tmp_path)) == ["a.csv", "copy.csv"]


def test_a_link_to_a_log_in_a_folder_with_its_own_rig_file_is_a_second_log(tmp_path: Path) -> None:
    (tmp_path / "large").mkdir()
    (tmp_path / "large" / "rig.toml").write_text("name = 'large'\n[parameters]\npiston_area = 3e-3\n")
    (tmp_path / "a.csv").write_text("t,u\n0,1\n")
    (tmp_path / "large" / "a.csv").symlink_to("../a.csv")
    assert files(planned(tmp_path, rigs={"large": "large/rig.toml"})) == ["a.csv", "large/a.csv"]


@pytest.mark.parametrize("rows", [400, 4])
def test_a_file_name_that_is_not_utf_8_is_escaped_and_its_log_is_read(tmp_path: Path, rows: int) -> None:
    name = os.fsdecode(b"l\xf6g.csv")
    write_record(small_log(), tmp_path / "plain.csv")
    lines = (tmp_path / "plain.csv").read_text().splitlines(keepends=True)
    # with gaps, so that there is a warning
    (tmp_path / name).write_text("".join(lines[: rows // 2] + lines[rows // 2 + 3 : rows]))
    plan = planned(tmp_path)
    assert files(plan) == ["l\\xf6g.csv", "plain.csv"]
    said = [one for task in plan.tasks(set(), 1) for one in run_task(task).failures]
    assert [one.series for one in said] == (["l\\xf6g.csv"] if rows == 4 else [])


def test_parquet_files_of_a_store_among_logs_are_not_logs(tmp_path: Path) -> None:
    for name in ("run.parquet", "fleet/store/cases.parquet", "fleet/store/parts/0a.parquet", "x/parts/1.parquet"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("x")
    assert files(planned(tmp_path, "**/*.parquet")) == ["run.parquet", "x/parts/1.parquet"]


def test_a_folder_name_with_brackets_is_not_taken_for_a_pattern(tmp_path: Path) -> None:
    (tmp_path / "old [1]").mkdir()
    (tmp_path / "old [1]" / "a.csv").write_text("t,u\n0,1\n")
    assert files(planned(tmp_path / "old [1]")) == ["a.csv"]
