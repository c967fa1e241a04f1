"""A small study and how tests run it: 24 filters on 8 series of 500 samples, in lanes."""

from pathlib import Path
from threading import Event
from typing import Any

import pyarrow as pa
import pytest

from experiments.batch import cases
from experiments.batch.cases import Plan, plan_study
from experiments.batch.part_store import PartStore, open_store
from experiments.batch.runner import Opener, Tally, manifest_of, run_batch
from experiments.batch.study_file import parse_study
from experiments.running.executors import open_executor

FILTER = {"verb": "filter", "form": "acceleration", "method": "ekf"}
RUNS: dict[str, Any] = {
    "plants": ["reduced"],
    "drives": ["sine"],
    "conditions": ["normal", "major_friction"],
    "seeds": 4,
    "starts_pa": [0.0, 2e8, 5e8],
    "duration_s": 0.05,
    "methods": [FILTER],
}


def small_plan(folder: Path = Path(), **changes: Any) -> Plan:
    return plan_study(parse_study({"name": "small", "runs": [{**RUNS, **changes}]}, "small.toml"), folder)


def run_into(
    store: PartStore,
    plan: Plan,
    *,
    opener: Opener = open_executor,
    stop: Event | None = None,
    again: bool = False,
    **options: Any,
) -> Tally:
    """Run the cases that the store lacks, as the command does."""
    with store.writing():
        done, _ = store.done(again=again)
        store.describe(manifest_of(plan, "small.toml"), plan.keys)
        options.setdefault("on_part", lambda *_: None)
        return run_batch(plan, store, done, opener, stop=stop or Event(), **options)


def rows_in_parts(store: PartStore) -> int:
    """Count the rows of all parts, duplicates included."""
    return sum(len(table) for table in store._readable_parts(["key"]))  # pyright: ignore[reportPrivateUsage] -- what lies there


@pytest.fixture(autouse=True)
def _small_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "MOST_CASES", 5)


@pytest.fixture(scope="session")
def reference(tmp_path_factory: pytest.TempPathFactory) -> pa.Table:
    """Return the rows of the small study, run in one piece without interruption."""
    store = open_store(tmp_path_factory.mktemp("stores") / "reference")
    run_into(store, small_plan())
    return store.rows()
