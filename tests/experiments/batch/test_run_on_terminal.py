"""The messages of a batch on standard error while it runs."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from experiments.batch import run_on_terminal
from experiments.batch.rows import Failure
from experiments.batch.runner import sources
from experiments.batch.study_file import parse_study
from experiments.verbs import batch
from plant.errors import HydrostateError


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    notes: list[str] = []
    monkeypatch.setattr(run_on_terminal, "note", notes.append)
    return notes


def test_a_store_of_other_package_versions_is_reported_with_those_versions(said: list[str]) -> None:
    old = {"versions": {"numpy": "1.0", "scipy": "2.0"}, "commit": "0123456789abcdef"}
    run_on_terminal._warn_of_differences(old, {"versions": {"numpy": "1.1", "scipy": "2.0"}, "commit": "fedcba"})
    (one,) = said
    assert "numpy 1.0, commit 0123456789;" in one
    assert "scipy" not in one


def test_a_store_of_since_edited_code_is_reported(said: list[str]) -> None:
    old = {"versions": {}, "commit": "a", "sources": "one"}
    run_on_terminal._warn_of_differences(old, {**old, "sources": "two"})
    (one,) = said
    assert "other code in plant, estimation, faults; --no-resume" in one


def test_the_hash_of_the_sources_changes_with_models_and_numbers_but_not_with_pages(tmp_path: Path) -> None:
    law, numbers, page = (
        tmp_path / name for name in ("plant/law.py", "faults/deep/widths.json", "experiments/page.py")
    )
    for file in (law, numbers, page):
        file.parent.mkdir(parents=True)
        file.write_text("1")
    found = [sources(tmp_path)]
    for file in (law, numbers, page):
        file.write_text("2")
        found.append(sources(tmp_path))
    assert len(set(found)) == 3
    assert found[-1] == found[-2]


@pytest.mark.parametrize("old", [None, {"versions": {"numpy": "1.0"}, "commit": "a"}])
def test_the_same_software_or_a_new_store_is_not_reported(old: Any, said: list[str]) -> None:
    run_on_terminal._warn_of_differences(old, {"versions": {"numpy": "1.0"}, "commit": "a"})
    assert said == []


def test_only_the_first_failures_are_named(said: list[str]) -> None:
    failures = [Failure(f"case {k}", "filter", "no log") for k in range(run_on_terminal.MOST_NAMED + 3)]
    with run_on_terminal._show_progress(len(failures), 0) as advance:
        advance(len(failures), SimpleNamespace(failures=failures))  # type: ignore[arg-type]
    named = [one for one in said if one.startswith("case ")]
    assert named == [f"case {k} (filter): no log" for k in range(run_on_terminal.MOST_NAMED)]
    assert said.count("more cases failed; the report names all") == 1


def test_an_unreadable_log_is_reported_once_with_all_its_verbs(said: list[str]) -> None:
    failures = [Failure("a.csv", verb, "it is empty") for verb in ("diagnose", "estimate", "estimate")]
    with run_on_terminal._show_progress(4, 0) as advance:
        advance(4, SimpleNamespace(failures=[*failures, Failure("b.csv", "estimate", "no time")]))  # type: ignore[arg-type]
    assert said == ["a.csv (diagnose, estimate): it is empty", "b.csv (estimate): no time"]


def test_pace_counts_only_cases_of_this_run(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([100.0, 110.0, 110.0, 110.0, 110.0, 110.0])
    monkeypatch.setattr(run_on_terminal.time, "monotonic", lambda: next(now))
    pace = run_on_terminal.Pace(total=60, before=20)
    pace.done += 20
    assert pace.rate == pytest.approx(2.0)
    assert str(pace).startswith("40 of 60 cases, 2 a second")
    pace.done = 24
    assert str(pace).startswith("24 of 60 cases, 2.5 s each")


def test_option_logs_replaces_the_logs_of_a_study_and_needs_a_study_with_logs() -> None:
    methods = [{"verb": "diagnose"}]
    study = parse_study({"name": "a", "logs": [{"glob": "old/*.csv", "methods": methods}]}, "a.toml")
    assert [one.glob for one in batch._with_logs(study, "new/*.csv").logs] == ["new/*.csv"]
    assert batch._with_logs(study, None) is study
    without = parse_study({"name": "b", "runs": [{"methods": methods}]}, "b.toml")
    with pytest.raises(HydrostateError, match="--logs replaces the logs of a study, and b has none"):
        batch._with_logs(without, "*.csv")
