"""Which rig file a log uses on a server; a log without one gets no wrong numbers."""

import os
import re
import unicodedata
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.serve import pages
from experiments.serve.fleet_view import fleet_view
from experiments.serve.pages import home_page
from experiments.serve.rigs import load_actuator_of_log, require_rigs, rig_of, rig_of_stream
from experiments.serve.settings import Settings
from experiments.serve.work import Task, process_log
from plant.errors import HydrostateError


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("two")
    for name in ("P-1", "P-12"):
        (folder / f"{name}.toml").touch()
    return folder


@pytest.mark.parametrize(
    ("name", "pattern", "rig"),
    [
        ("P-12_2026-11-22.csv", None, "P-12.toml"),
        ("P-1_20261122_143000.csv.gz", None, "P-1.toml"),
        ("P-12.csv", None, "P-12.toml"),
        ("run 7, P-1.csv", "*, {actuator}.csv", "P-1.toml"),
        ("P-13_2026-11-22.csv", None, "others.toml"),
        ("P-1_someday.csv", "{actuator}_{date}.csv", "others.toml"),
    ],
)
def test_a_log_uses_the_rig_file_of_the_actuator_in_its_name(
    two: Path, name: str, pattern: str | None, rig: str
) -> None:
    assert rig_of(name, pattern, two, two / "others.toml") == two / rig


def test_a_log_without_a_rig_file_for_its_actuator_is_refused(two: Path) -> None:
    with pytest.raises(HydrostateError, match=r"the actuator is 'P-13', and the server has rig files of P-1, P-12"):
        rig_of("P-13_2026-11-22.csv", None, two, None)
    with pytest.raises(HydrostateError, match=r"no rig file: run\.csv names no actuator"):
        rig_of("run.csv", "{actuator}_{date}.csv", two, None)
    assert rig_of("run.csv", None, None, None) is None


def test_a_stream_uses_the_rig_file_of_its_name(tmp_path: Path) -> None:
    own = tmp_path / "press-8.toml"
    own.write_text("")
    assert rig_of_stream("press-8", tmp_path, None) == own
    assert rig_of_stream("press", tmp_path, Path("others.toml")) == Path("others.toml")
    assert rig_of_stream("press", None, None) is None
    done = CliRunner().invoke(app, ["serve", str(tmp_path / "kept"), "--rigs", str(tmp_path), "--watch", "x=tcp://h:1"])
    assert done.exit_code == 2
    assert "no rig file: the actuator is 'x'" in " ".join(done.stderr.split())


def test_a_folder_without_rig_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none")
    with pytest.raises(HydrostateError, match=r"must hold a rig file of each actuator, such as P-12\.toml"):
        require_rigs(None, tmp_path, None)


def test_an_emptied_folder_of_rig_files_refuses_logs_and_the_page_still_loads(tmp_path: Path) -> None:
    with pytest.raises(
        HydrostateError, match=r"^no rig file: the actuator is 'P-1', and the server has rig files of none"
    ):
        rig_of("P-1.csv", None, tmp_path, None)
    assert rig_of("P-1.csv", None, tmp_path, Path("others.toml")) == Path("others.toml")
    assert "rig files of none. Other logs are refused." in " ".join(
        home_page(Settings(folder=tmp_path, rigs=tmp_path)).split()
    )


def test_an_actuator_s_rig_file_may_name_another_kind_than_the_server_s(tmp_path: Path) -> None:
    own = tmp_path / "S-1.toml"
    own.write_text('plant = "piezo-stack"\n')
    assert load_actuator_of_log("eha", own, None)[0].name == "piezo-stack"
    own.write_text('name = "large"\n')
    kind, rig = load_actuator_of_log("piezo-stack", own, None)
    assert (kind.name, rig.name) == ("piezo-stack", "large")


@pytest.fixture
def rig_folder(tmp_path: Path) -> Path:
    folder = tmp_path / "rigs"
    folder.mkdir()
    (folder / "P-1.toml").write_text('name = "small"\n')
    (folder / "P-2.toml").write_text('name = "large"\n[parameters]\npiston_area = 1.0e-3\n')
    return folder


def task(log: Path, folder: Path, name: str) -> Task:
    page, phase = folder / "page.html", folder / "phase"
    return Task(log, name, "estimate", page, phase, None, None, (), folder / "rigs")


def test_a_log_is_processed_with_the_current_rig_file_and_errors_show_no_folder(
    rig_folder: Path, tmp_path: Path
) -> None:
    log = tmp_path / "kept-under-a-number"
    log.write_bytes(b"\x00")  # not a log: the result names the rig even so

    def rig_of_work(name: str) -> str:
        return process_log(task(log, tmp_path, name)).result["rig"]

    assert rig_of_work("P-1_2026-11-22.csv") == "small"
    assert rig_of_work("P-2_2026-11-22.csv") == "large"
    changed = rig_folder / "P-1.toml"
    changed.write_text('name = "mended"\n')
    os.utime(changed, ns=(1, 1))
    assert rig_of_work("P-1_2026-11-22.csv") == "mended"
    changed.write_text("[parameters]\npiston_area = -1\n")
    os.utime(changed, ns=(2, 2))
    wrong = process_log(task(log, tmp_path, "P-1_2026-11-22.csv")).result
    assert wrong["outcome"] == "failed"
    assert "P-1.toml" in wrong["message"]
    assert str(rig_folder) not in wrong["message"]
    other = process_log(task(log, tmp_path, "P-3_2026-11-22.csv"))
    assert "o rig file: the actuator is 'P-3'" in other.said


def test_the_home_page_explains_how_to_name_logs_and_what_happens_to_others(rig_folder: Path, tmp_path: Path) -> None:
    told = home_page(Settings(folder=tmp_path, rigs=rig_folder))
    assert "such as P-1_2026-11-22.csv" in told
    assert "rig files of P-1, P-2. Other logs are refused." in " ".join(told.split())
    others = home_page(Settings(folder=tmp_path, rigs=rig_folder, rig=tmp_path / "common.toml"))
    assert "Other logs are compared with common.toml." in others
    assert "Name a log after its actuator" not in home_page(Settings(folder=tmp_path))


@pytest.mark.parametrize(
    ("name", "text", "words"), [("P-1.toml", "moving_mass = 1", "P-1.toml"), ("P-1.txt", "", "must hold a rig file")]
)
def test_a_server_with_an_invalid_rig_file_does_not_start(tmp_path: Path, name: str, text: str, words: str) -> None:
    (tmp_path / name).write_text(text)
    done = CliRunner().invoke(app, ["serve", str(tmp_path / "kept"), "--rigs", str(tmp_path)])
    assert done.exit_code == 2
    assert words in " ".join(done.stderr.split())


def test_the_home_page_links_to_fleet_and_streams_and_lists_the_readable_formats(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = home_page(Settings(folder=tmp_path, streams={"press": "tcp://h:1"}))
    opening = told.split("<nav")[0]
    assert 'href="fleet"' in opening
    assert 'href="live/press"' in opening
    assert "TDMS" in opening
    monkeypatch.setattr(pages, "MORE_FORMATS", {"no_such_module": "PAPER"})
    assert "PAPER" not in home_page(Settings(folder=tmp_path))


def test_without_a_pattern_logs_with_dates_in_their_names_are_grouped_by_actuator() -> None:
    row = {"outcome": "ok", "found_condition": "normal"}
    rows = [(f"{day}" * 16, f"P-1_2026-01-0{day}.csv", row) for day in (1, 2)]
    assert "actuator?name=P-1" in fleet_view(rows, None, {}, {}, "here")


def test_a_served_fleet_without_verdicts_hints_at_the_option_rigs() -> None:
    row = {"outcome": "mismatch", "reason": "no model fits"}
    page = fleet_view([(str(k) * 16, f"P-{k}.csv", row) for k in range(4)], None, {}, {}, "here")
    assert "start the server with --rigs FOLDER" in re.sub("<[^>]*>", "", page)


def test_a_rig_file_named_on_macos_is_found_by_the_actuator_of_a_log_named_elsewhere(tmp_path: Path) -> None:
    """Before, a log of that actuator was taken with the rig file of all others, which gave wrong numbers."""
    own, others = tmp_path / f"{unicodedata.normalize('NFD', 'Αντλία-ή')}.toml", tmp_path / "others" / "rig.toml"
    own.write_text("")
    assert rig_of(f"{unicodedata.normalize('NFC', 'Αντλία-ή')}_2026-11-22.csv", None, tmp_path, others) == own
