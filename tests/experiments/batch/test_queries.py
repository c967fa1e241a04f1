import re
import tomllib
from pathlib import Path

import pytest

from experiments.batch.part_store import open_store
from experiments.batch.study_file import parse_study
from tests.experiments.batch.conftest import run_into, small_plan

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "batch-studies.md").read_text(encoding="utf-8")


def test_the_documented_sql_query_runs_on_a_store(tmp_path: Path) -> None:
    duckdb = pytest.importorskip("duckdb", reason="the extra `query` is not installed")
    store = open_store(tmp_path / "store")
    run_into(store, small_plan())
    found = re.search(r'duckdb\.sql\("""(.*?)"""\)', PAGE, flags=re.DOTALL)
    assert found is not None
    rows = duckdb.sql(found[1].replace("results/eha", store.name)).fetchall()
    assert sorted(row[:3] for row in rows) == [("major_friction", "ekf", 12), ("normal", "ekf", 12)]
    run_into(store, small_plan(seeds=1))
    joined = f"select count(*) from '{store.name}/parts/*.parquet' join '{store.name}/cases.parquet' using (key)"  # noqa: S608 -- our own path
    assert duckdb.sql(joined).fetchall() == [(6,)]


def test_the_documented_study_file_is_valid() -> None:
    found = re.search(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
    assert found is not None
    study = parse_study(tomllib.loads(found[1]), "the page")
    assert [len(block.methods) for block in (*study.runs, *study.logs)] == [4, 2]
