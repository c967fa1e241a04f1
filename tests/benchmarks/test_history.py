from math import inf
from pathlib import Path

import matplotlib.image as image
import pytest

from benchmarks import __main__ as command
from benchmarks import history
from benchmarks.history import Entry, draw, entry_of, main, record, regression, series_of
from benchmarks.targets import Check, check_target, print_and_keep


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "history.jsonl"


def slower(*values: float) -> list[Check]:
    return [Check("a step [ns]", value, most=50.0) for value in values]


def test_printed_figures_are_recorded_and_read_back_unchanged(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    checks = [Check("covers [%]", 95.5, 90.0, 98.0), Check("times faster", 7.0, least=5.0), Check("open", 3.0)]
    assert print_and_keep(checks) == checks
    assert record("study --seeds 3", [*checks, Check("never found", inf, most=1.0)], path) == 3
    found = [entry_of(line) for line in path.read_text().splitlines()]
    assert [one.check for one in found] == checks
    assert {one.benchmark for one in found} == {"study --seeds 3"}
    said = capsys.readouterr().out
    assert "met    covers [%]: 95.5 (wanted: 90 to 98)" in said
    assert "met    times faster: 7 (wanted: at least 5)" in said


def test_a_figure_that_misses_its_target_is_marked_missed(capsys: pytest.CaptureFixture[str]) -> None:
    from benchmarks.targets import misses

    misses.clear()
    check_target("wall [s]", 2.0, 1.0)
    check_target("speed-up", 2.0, 1.0, most=False)
    assert misses == ["wall [s]"]
    assert capsys.readouterr().out.startswith("MISSED wall [s]: 2 (wanted: at most 1)\nmet    speed-up")


@pytest.mark.parametrize(
    ("values", "worse"),
    [
        ((20.0,), False),
        ((20.0, 24.0), False),  # within a quarter
        ((20.0, 26.0), True),
        ((20.0, 30.0, 21.0, 29.0, 32.0), False),  # earlier values scatter as much
        ((20.0, 10.0), False),  # better
        ((40.0, 51.0), True),  # misses its limit
        ((60.0, 61.0), False),  # missed it before
    ],
)
def test_only_a_worsening_beyond_the_earlier_scatter_is_a_regression(values: tuple[float, ...], worse: bool) -> None:
    assert (regression(slower(*values)) is not None) is worse


def test_a_lower_figure_is_worse_if_its_target_is_a_minimum() -> None:
    checks = [Check("times faster", value, least=5.0) for value in (20.0, 21.0, 12.0)]
    assert regression(checks) == "worse by 41 %: 12, 20.5 before"


def test_a_figure_with_a_target_range_is_worse_only_outside_it() -> None:
    assert regression([Check("z", 0.8, 0.7, 1.3), Check("z", 1.29, 0.7, 1.3)]) is None
    assert "misses its range now" in str(regression([Check("z", 0.8, 0.7, 1.3), Check("z", 1.4, 0.7, 1.3)]))


def test_runs_on_other_machines_or_with_other_arguments_are_not_compared(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    [one, other] = slower(20.0, 40.0)
    entries = [
        Entry("2026-11-01", "a", "2 processors, AVX2", "cost", one),
        Entry("2026-11-02", "b", "2 processors, AVX-512", "cost", other),
        Entry("2026-11-02", "b", "2 processors, AVX2", "cost --long", other),
        Entry("2026-11-03", "c", "2 processors, AVX2", "cost", other),
    ]
    path.write_text("".join(f"{entry.line()}\n" for entry in entries))
    assert len(series_of(entries)) == 3
    assert main(["--file", str(path), "--plot", str(tmp_path / "drawn")]) == 1
    said = capsys.readouterr().out
    assert said.count("WORSE") == 1
    assert "cost: a step [ns]: worse by 100 %: 40, 20 before" in said
    [drawn] = draw(series_of(entries), tmp_path / "again")
    assert image.imread(drawn).std() > 0.01


def test_figures_are_recorded_only_with_the_record_option_before_the_name(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import benchmarks.many_logs.start_up as benchmark

    def measured(arguments: list[str]) -> int:
        check_target(f"took {arguments}", 2.0, 1.0)
        return 1

    monkeypatch.setattr(benchmark, "main", measured)
    monkeypatch.setattr(command, "record", lambda name, checks: record(name, checks, path))
    assert command.main(["start_up", "--seconds", "5"]) == 1
    assert not path.exists()
    assert command.main(["--record", "start_up", "--seconds", "5"]) == 1
    assert entry_of(path.read_text()).benchmark == "start_up --seconds 5"


def test_a_missing_history_file_is_reported(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--file", str(path)]) == 1
    assert "no history there" in capsys.readouterr().err
    assert history.machine().split()[1] in ("processors,", "processor,")
