"""A result folder is complete or absent, and no user's file is lost."""

import json
import os
import shutil
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimation.identification.model.linear_model import LinearModel
from experiments.command.study_verb import finish_study
from experiments.nine_conditions.figures import FIGURES
from experiments.nine_conditions.study import NINE_CONDITIONS
from experiments.nine_conditions.transfer_functions import identification_study
from experiments.page import folder
from experiments.page.figure_files import figure_files
from experiments.page.folder import check_target, folder_lock
from experiments.running import study as runner
from experiments.running.study import StudyResult, write_result
from experiments.streams.endings import stop_at_signals
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from tests.experiments.conftest import SMALL, WRITTEN


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out figures and report, which these tests do not need."""
    monkeypatch.setattr(runner, "figure_files", lambda *_: {})
    monkeypatch.setattr(runner, "render_page", lambda *_: "report")


@pytest.fixture
def short(study: StudyResult) -> StudyResult:
    """Return one table of the small study and its files; it is written like the whole study."""
    return StudyResult({"bulk modulus": study.tables["bulk_modulus"]}, {}, study.files)


def write_study(found: StudyResult, folder: Path) -> Path:
    """Write a part of the small study, and return its report."""
    write_result(replace(NINE_CONDITIONS, facts=lambda *_: {}), SMALL, found, folder)
    return folder / "report.html"


def _listing(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_the_folder_contains_all_figures_tables_series_and_the_manifest(written: Path, study: StudyResult) -> None:
    present = _listing(written)
    for name in FIGURES:
        assert {f"figures/{name}.png", f"figures/{name}.svg"} <= set(present)
    assert len([name for name in present if name.startswith("tables/")]) == len(study.tables)
    assert len([name for name in present if name.startswith("series/")]) == len(study.series)
    assert {"report.html", "manifest.json", "transfer_functions.json"} <= set(present)
    assert json.loads((written / "manifest.json").read_text(encoding="utf-8"))["files"] == present


def test_tables_are_read_back_as_they_were(written: Path, study: StudyResult) -> None:
    found = pd.read_csv(written / "tables/bulk_modulus.csv", keep_default_na=True)
    wanted = study.tables["bulk_modulus"]
    np.testing.assert_array_equal(found["value_pa"], wanted["value_pa"].astype(float))
    confusion = pd.read_csv(written / "tables/confusion_transfer_functions_nominal.csv", index_col="condition")
    np.testing.assert_array_equal(confusion, study.tables["confusion transfer functions nominal"])


def test_transfer_functions_keep_every_digit(written: Path) -> None:
    stored = json.loads((written / "transfer_functions.json").read_text(encoding="utf-8"))
    library, _ = identification_study(EhaParameters(), SMALL)
    for name, model in library.items():
        found = LinearModel.from_dict(stored[name])
        np.testing.assert_array_equal(found.numerator, model.numerator)
        np.testing.assert_array_equal(found.covariance, model.covariance)


def test_figures_are_the_same_at_every_run(written: Path, study: StudyResult) -> None:
    again = figure_files({WRITTEN: FIGURES[WRITTEN]}, study.frames)
    assert again[f"figures/{WRITTEN}.svg"] == (written / f"figures/{WRITTEN}.svg").read_bytes()


@pytest.mark.usefixtures("undrawn")
def test_an_earlier_study_is_replaced_completely(short: StudyResult, tmp_path: Path) -> None:
    target = tmp_path / "out"
    write_study(short, target)
    (target / "tables/bulk_modulus.csv").write_text("stale", encoding="utf-8")
    write_study(short, target)
    assert "stale" not in (target / "tables/bulk_modulus.csv").read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("failure", [HydrostateError("no report"), KeyboardInterrupt(), OSError(28, "No space left")])
def test_a_failure_while_writing_keeps_the_earlier_result(
    short: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    target = tmp_path / "out"
    write_study(short, target)
    before = {name: (target / name).read_bytes() for name in _listing(target)}

    opened = Path.open

    def fail_at_the_report(path: Path, mode: str = "r", **more: Any) -> Any:
        if path.name == "report.html" and mode == "wb":
            raise failure
        return opened(path, mode, **more)

    monkeypatch.setattr(Path, "open", fail_at_the_report)
    with pytest.raises((HydrostateError, KeyboardInterrupt)):
        write_study(short, target)
    monkeypatch.setattr(Path, "open", opened)
    assert {name: (target / name).read_bytes() for name in _listing(target)} == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.usefixtures("undrawn")
def test_a_failed_exchange_of_folders_restores_the_earlier_result(
    short: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "out"
    write_study(short, target)
    rename = Path.rename

    def second_fails(path: Path, new: Path) -> Path:
        if path.name.endswith(".tmp"):
            raise PermissionError(13, "Permission denied")
        return rename(path, new)

    monkeypatch.setattr(folder, "_exchange_names", lambda *_: False)  # as on a system that cannot exchange two folders
    monkeypatch.setattr(Path, "rename", second_fails)
    with pytest.raises(HydrostateError, match="can be written, got: Permission denied"):
        write_study(short, target)
    assert (target / "manifest.json").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/thesis.tex").write_text("x", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"which holds thesis\.tex"):
        check_target(tmp_path / "out")
    assert (tmp_path / "out/thesis.tex").is_file()


@pytest.mark.parametrize("manifest", ["not json", "[1]", '{"name": "another program", "files": ["manifest.json"]}'])
def test_a_manifest_of_something_else_is_refused(tmp_path: Path, manifest: str) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/manifest.json").write_text(manifest, encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"which holds manifest\.json"):
        check_target(tmp_path / "out")


@pytest.mark.usefixtures("undrawn")
def test_a_study_folder_with_a_foreign_file_is_not_overwritten(short: StudyResult, tmp_path: Path) -> None:
    target = tmp_path / "out"
    write_study(short, target)
    (target / "tables/annotated.png").write_bytes(b"x")
    with pytest.raises(HydrostateError, match=r"which holds tables/annotated\.png"):
        write_study(short, target)
    (target / "tables/annotated.png").rename(target / "tables/.DS_Store")
    write_study(short, target)


@pytest.mark.usefixtures("undrawn")
def test_a_study_is_written_to_an_empty_folder_and_below_missing_parents(short: StudyResult, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert write_study(short, tmp_path / "empty") == tmp_path / "empty/report.html"
    assert write_study(short, tmp_path / "a/b/c").is_file()


def test_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("x", encoding="utf-8")
    with pytest.raises(HydrostateError, match="got the file"):
        check_target(tmp_path / "out")
    with pytest.raises(HydrostateError, match="can be written, got"):
        check_target(tmp_path / "out/below")


def test_the_current_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(HydrostateError, match="current folder"):
        check_target(Path())
    with pytest.raises(HydrostateError, match="current folder"):
        check_target(tmp_path.parent)


def test_a_target_without_write_permission_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(HydrostateError, match="must be in a place that can be written, got"):
        check_target(tmp_path / "out")


@pytest.mark.usefixtures("undrawn")
def test_a_path_too_long_for_the_file_system_is_refused(short: StudyResult, tmp_path: Path) -> None:
    with pytest.raises(HydrostateError, match="result folder"):
        write_study(short, tmp_path / ("x" * 300))


@pytest.mark.usefixtures("undrawn")
def test_temporary_folders_of_a_killed_run_are_removed_and_the_earlier_result_is_restored(
    short: StudyResult, tmp_path: Path
) -> None:
    write_study(short, tmp_path / "out")
    (tmp_path / "out").rename(tmp_path / ".out.0123abcd.old")  # the run was killed before the new result took the name
    for name in (".out.89abcdef.tmp", ".out.ffff0000.tmp", ".out.mine.tmp"):
        (tmp_path / name).mkdir()
    with folder_lock(tmp_path / ".out.ffff0000.tmp") as free:  # another study is at work
        assert free
        check_target(tmp_path / "out")
    assert (tmp_path / "out/manifest.json").is_file()
    assert sorted(path.name for path in tmp_path.iterdir()) == [".out.ffff0000.tmp", ".out.mine.tmp", "out"]


@pytest.mark.usefixtures("undrawn")
@pytest.mark.skipif(sys.platform != "linux", reason="the system has no call that exchanges two names")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_study_ended_while_replacing_another_leaves_a_complete_result(
    short: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    write_study(short, target := tmp_path / "out")
    ended, remove = iter([number]), shutil.rmtree

    def end_first(place: Path, **how: Any) -> None:
        for one in ended:
            os.kill(os.getpid(), one)
        remove(place, **how)

    def never(*_: object) -> None:
        raise AssertionError("for a moment nothing has the name")

    if not (child := os.fork()):
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
        monkeypatch.setattr(Path, "rename", never)
        monkeypatch.setattr(shutil, "rmtree", end_first)
        try:
            write_study(StudyResult({"of the second": short.tables["bulk modulus"]}, {}, short.files), target)
        except KeyboardInterrupt:
            os._exit(130)
        os._exit(1)
    wanted = -9 if number == signal.SIGKILL else 130
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == wanted
    assert json.loads((target / "manifest.json").read_text(encoding="utf-8"))["files"] == _listing(target)
    assert (target / "tables/of_the_second.csv").is_file()
    check_target(target)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.usefixtures("undrawn")
def test_a_result_that_another_study_writes_meanwhile_is_replaced(
    short: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(short, target := tmp_path / "out")
    rename, others = Path.rename, iter([b"another"])

    def beaten(path: Path, new: Path) -> Path:
        moved = rename(path, new)
        for content in others if path == target else ():
            target.mkdir()
            (target / "report.html").write_bytes(content)
        return moved

    monkeypatch.setattr(folder, "_exchange_names", lambda *_: False)
    monkeypatch.setattr(Path, "rename", beaten)
    assert write_study(short, target).read_text() == "report"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.usefixtures("undrawn")
def test_every_file_of_a_result_is_flushed_to_disk_before_it_is_renamed(
    short: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    monkeypatch.setattr(os, "fsync", lambda number: synced.append(str(Path(f"/proc/self/fd/{number}").readlink())))
    write_study(short, tmp_path / "out")
    assert {one.split(".tmp/")[-1] for one in synced} == set(_listing(tmp_path / "out"))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_termination_signal_interrupts_a_study(number: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(runner, "run_study", lambda *_: os.kill(os.getpid(), number))
    before = {one: signal.getsignal(one) for one in (signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        with pytest.raises(KeyboardInterrupt):
            finish_study(NINE_CONDITIONS, SMALL, tmp_path / "out", as_json=False)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # nohup starts a program like this
        stop_at_signals()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        for one, was in before.items():
            signal.signal(one, was)
