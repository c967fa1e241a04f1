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


def test_kept_rows_of_other_software_are_said_with_what_made_them(said: list[str]) -> None:
    old = {"versions": {"numpy": "1.0", "scipy": "2.0"}, "commit": "0123456789abcdef"}
    run_on_terminal._say_differences(old, {"versions": {"numpy": "1.1", "scipy": "2.0"}, "commit": "fedcba"})
    (one,) = said
    assert "numpy 1.0, commit 0123456789;" in one
    assert "scipy" not in one


def test_kept_rows_of_code_that_was_edited_since_are_said(said: list[str]) -> None:
    old = {"versions": {}, "commit": "a", "sources": "one"}
    run_on_terminal._say_differences(old, {**old, "sources": "two"})
    (one,) = said
    assert "other code in plant, estimation, faults; --no-resume" in one


def test_an_edit_of_the_code_or_of_its_numbers_changes_the_hash_of_the_sources(tmp_path: Path) -> None:
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
def test_nothing_is_said_of_the_same_software_or_of_a_new_store(old: Any, said: list[str]) -> None:
    run_on_terminal._say_differences(old, {"versions": {"numpy": "1.0"}, "commit": "a"})
    assert said == []


def test_only_the_first_failures_are_named(said: list[str]) -> None:
    failures = [Failure(f"case {k}", "filter", "no log") for k in range(run_on_terminal.MOST_NAMED + 3)]
    with run_on_terminal._shown(len(failures), 0) as advance:
        advance(len(failures), SimpleNamespace(failures=failures))  # type: ignore[arg-type]
    named = [one for one in said if one.startswith("case ")]
    assert named == [f"case {k} (filter): no log" for k in range(run_on_terminal.MOST_NAMED)]
    assert said.count("more cases failed; the report names all") == 1


def test_a_log_that_cannot_be_read_is_named_once_with_all_that_was_asked_of_it(said: list[str]) -> None:
    failures = [Failure("a.csv", verb, "it is empty") for verb in ("diagnose", "estimate", "estimate")]
    with run_on_terminal._shown(4, 0) as advance:
        advance(4, SimpleNamespace(failures=[*failures, Failure("b.csv", "estimate", "no time")]))  # type: ignore[arg-type]
    assert said == ["a.csv (diagnose, estimate): it is empty", "b.csv (estimate): no time"]


def test_pace_counts_only_what_this_run_did(monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([100.0, 110.0, 110.0, 110.0, 110.0, 110.0])
    monkeypatch.setattr(run_on_terminal.time, "monotonic", lambda: next(now))
    pace = run_on_terminal.Pace(total=60, before=20)
    pace.done += 20
    assert pace.rate == pytest.approx(2.0)
    assert str(pace).startswith("40 of 60 cases, 2 a second")
    pace.done = 24
    assert str(pace).startswith("24 of 60 cases, 2.5 s each")


def test_logs_of_the_command_line_replace_those_of_a_study_that_has_some() -> None:
    methods = [{"verb": "diagnose"}]
    study = parse_study({"name": "a", "logs": [{"glob": "old/*.csv", "methods": methods}]}, "a.toml")
    assert [one.glob for one in batch._with_logs(study, "new/*.csv").logs] == ["new/*.csv"]
    assert batch._with_logs(study, None) is study
    without = parse_study({"name": "b", "runs": [{"methods": methods}]}, "b.toml")
    with pytest.raises(HydrostateError, match="--logs replaces the logs of a study, and b has none"):
        batch._with_logs(without, "*.csv")
