"""What a process of the server makes of one log: a result and a page, or a reason."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.serve import gauges, work
from experiments.serve.work import Task, process_log


@pytest.fixture(scope="module")
def stack_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("stack") / "kept-under-a-number.csv"
    words = ["simulate", "--plant", "piezo-stack", "--duration", "0.03", "--fault", "major_leakage", "--out", str(out)]
    assert CliRunner().invoke(app, words).exit_code == 0
    return out


def task(log: Path, folder: Path, **changes: Any) -> Task:
    (folder / "phase").touch()  # as the server does
    given = {"name": "mine.csv", "verb": "diagnose", "plant": "piezo-stack", "rig": None, "columns": ()}
    return Task(**{"log": log, "page": folder / "page.html", "phase": folder / "phase", **given, **changes})


def test_a_log_of_the_stack_gets_a_condition_a_page_and_a_row(stack_log: Path, tmp_path: Path) -> None:
    found = process_log(task(stack_log, tmp_path))
    assert (found.result["outcome"], found.result["condition"]) == ("ok", "major_leakage")
    assert found.entries is not None
    assert found.entries["found_condition"] == "major_leakage"
    assert "mine.csv" in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert (tmp_path / "phase").read_text(encoding="utf-8") == work.WRITING


def test_the_page_contains_the_notes_of_reading_the_log(tmp_path: Path) -> None:
    log = tmp_path / "other.csv"
    words = ["simulate", "--duration", "0.5", "--sample-time", "0.001", "--out", str(log)]
    assert CliRunner().invoke(app, words).exit_code == 0
    log.write_text(log.read_text().replace("differential_pressure_pa", "x").replace("pressure_b_pa", "y"))
    found = process_log(task(log, tmp_path, plant="eha", verb="estimate"))
    assert [one["code"] for one in found.result["notes"]].count("chamber_alone") == 1
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "differential pressure also needs pressure_b_pa.</li>" in page


def test_an_estimate_has_no_row_and_its_result_names_no_path_of_the_server(stack_log: Path, tmp_path: Path) -> None:
    found = process_log(task(stack_log, tmp_path, verb="estimate"))
    assert found.entries is None
    assert "crossport_leakage" in found.result["quantities"]
    assert stack_log.name not in json.dumps(found.result)
    assert str(stack_log.parent) not in json.dumps(found.result)


@pytest.mark.parametrize("verb", ["diagnose", "estimate", "inspect"])
def test_a_file_that_is_not_a_log_fails_without_the_server_s_file_name(verb: str, tmp_path: Path) -> None:
    log = tmp_path / "kept-under-a-number.csv"
    log.write_bytes(b"\x00\x01\x02")
    found = process_log(task(log, tmp_path, verb=verb))
    assert found.result["outcome"] == "failed"
    assert found.result["message"]
    assert "kept-under-a-number" not in json.dumps(found.result)
    assert found.entries == ({"outcome": "failed", "reason": found.entries["reason"]} if found.entries else None)
    assert (found.entries is None) is (verb != "diagnose")
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("columns", [(), (("position_m", "Weg:mm"),)])
def test_the_message_on_wrong_columns_contains_no_command_line_options(
    columns: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    log = tmp_path / "odd.csv"
    log.write_text("time_s,Druck\n" + "".join(f"{0.01 * k:.2f},{k}\n" for k in range(100)))
    found = process_log(task(log, tmp_path, plant="eha", columns=columns))
    said = found.result["message"]
    assert "the log has 'time_s', 'Druck'" in said.replace("\u00a0", " ")
    assert work.OTHER_NAMES_ADVICE in said
    assert "--" not in said
    assert "hydrostate inspect" not in said
    inspected = process_log(task(log, tmp_path, plant="eha", verb="inspect"))
    assert inspected.said == work.INSPECTION_MESSAGES[False]


def test_an_internal_error_is_a_failed_result(stack_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: Task) -> None:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(work, "_analyse", broken)
    found = process_log(task(stack_log, tmp_path))
    assert found.result["outcome"] == "failed"
    assert "internal error" in found.result["message"]


def full(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def test_a_full_disk_costs_the_page_and_not_the_result(
    stack_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "page.html").write_text("of an earlier result")
    monkeypatch.setattr(work, "replacing", full)
    found = process_log(task(stack_log, tmp_path))
    assert (found.result["outcome"], found.result["condition"]) == ("ok", "major_leakage")
    assert found.entries is not None
    assert found.said.endswith(work.PAGE_MISSING)
    assert not (tmp_path / "page.html").exists()


def test_a_disk_that_is_full_before_the_page_is_no_error_of_the_program(
    stack_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(work, "read_log", full)
    found = process_log(task(stack_log, tmp_path))
    assert found.result["outcome"] == "failed"
    assert work.DISK_FULL[1:] in str(found.result["message"])
    assert "report" not in str(found.result["message"])


def test_a_log_that_needs_too_much_memory_ends_the_process_with_a_special_code(
    stack_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Ended(BaseException):
        pass

    def end(code: int) -> None:
        raise Ended(code)

    def greedy(_: Task) -> None:
        raise MemoryError

    monkeypatch.setattr(work, "_analyse", greedy)
    monkeypatch.setattr(work, "os", SimpleNamespace(_exit=end))
    with pytest.raises(Ended) as ended:
        process_log(task(stack_log, tmp_path))
    assert ended.value.args == (work.NO_MEMORY,)


@pytest.mark.parametrize(
    ("error", "words"),
    [(None, ""), (gauges.HydrostateError("no such stream"), "no such stream"), (KeyError("x"), "internal error")],
)
def test_the_process_of_a_stream_sends_an_end_event_with_its_outcome(
    error: Exception | None, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def watched(*_: Any) -> None:
        if error is not None:
            raise error

    sent: list[Any] = []
    out: Any = SimpleNamespace(send=sent.append, close=lambda: sent.append("closed"))
    monkeypatch.setattr(gauges, "watch_network", watched)
    monkeypatch.setattr(gauges, "bind_to_server", lambda _: None)
    monkeypatch.setattr(gauges.signal, "signal", lambda *_: None)
    gauges.watch_stream(out, 1, gauges.StreamTask("tcp://nowhere:1", None, (), 0.1, tmp_path / "state.npz"))
    *_, (kind, last), closed = sent
    assert (kind, last["event"], closed) == ("event", "end", "closed")
    assert last["outcome"] == ("ok" if error is None else "failed")
    assert words in json.dumps(last)


def test_a_worker_ends_with_its_server_and_has_a_memory_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    import resource

    limits, servers, environment = dict[int, Any](), list[int](), dict[str, str]()
    monkeypatch.setattr(resource, "setrlimit", limits.__setitem__)
    monkeypatch.setattr(work, "bind_to_server", servers.append)
    monkeypatch.setattr(work, "os", SimpleNamespace(environ=environment))
    work.begin_worker(41, 1000)
    assert servers == [41]
    assert limits == {resource.RLIMIT_DATA: (1000, 1000), resource.RLIMIT_CORE: (0, 0)}


def test_an_inspected_log_gets_a_page_with_its_columns_and_original_name(stack_log: Path, tmp_path: Path) -> None:
    found = process_log(task(stack_log, tmp_path, verb="inspect"))
    assert found.result["outcome"] == "ok"
    assert found.result["reads"] is True
    assert found.entries is None
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "mine.csv" in page
    assert "time_s" in page


def test_a_log_of_the_gear_pump_actuator_gets_the_row_of_a_batch(tmp_path: Path) -> None:
    out = tmp_path / "kept-under-a-number.csv"
    words = ["simulate", "--duration", "2", "--sample-time", "1e-3", "--condition", "major_leakage"]
    made = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert made.exit_code == 0, made.output
    found = process_log(task(out, tmp_path, plant=None))
    assert found.entries is not None
    assert found.result["plant"] == "eha"
    assert found.entries["found_condition"] == found.result["condition"]
    assert (tmp_path / "page.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_rig_that_cannot_be_read_fails_a_log_with_its_reason(stack_log: Path, tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text("moving_mass = 'heavy'")
    found = process_log(task(stack_log, tmp_path, rig=rig))
    assert found.entries is not None
    assert found.result["outcome"] == found.entries["outcome"] == "failed"
    assert "rig.toml" in found.result["message"]
    assert "rig.toml" in found.entries["reason"]


def test_a_log_deleted_while_its_page_is_written_leaves_no_page(
    stack_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from experiments.log_pages import inspect_page

    log = tmp_path / "kept-under-a-number.csv"
    log.write_bytes(stack_log.read_bytes())

    def deleted(*_: Any) -> str:
        log.unlink()
        return "<p>page</p>"

    monkeypatch.setattr(inspect_page, "inspect_page", deleted)
    process_log(task(log, tmp_path, verb="inspect"))
    assert not log.exists()
    assert [one.name for one in tmp_path.iterdir()] == ["phase"]
