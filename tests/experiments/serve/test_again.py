"""A finished log is worked on once more: one that failed, or one whose page met a full disk."""

from pathlib import Path
from typing import Any

import pytest

from experiments.serve import work
from tests.experiments.serve.conftest import Served
from tests.experiments.serve.test_app import dropped


def full(*_: Any) -> None:
    raise OSError(28, "No space left on device")


def finished(client: Any, identity: str) -> dict[str, Any]:
    """Return a log as soon as it is finished."""
    while True:
        found = client.get(f"/api/logs/{identity}").json()
        if found["state"] not in ("waiting", "running"):
            return found


def test_a_page_that_met_a_full_disk_is_built_as_soon_as_there_is_room(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = served()
    with monkeypatch.context() as disk:
        disk.setattr(work, "replacing", full)
        log = dropped(client, "a.csv", b"a,b\n1,2\n2,3\n")
    assert (log["state"], log["page"]) == ("done", False)
    assert work.PAGE_MISSING in log["message"]
    assert client.get(f"/api/logs/{log['id']}/result").json()["outcome"] == "ok"
    page = client.get(f"/logs/{log['id']}", headers={"accept": "text/html"})
    assert (page.status_code, work.PAGE_MISSING in page.text) == (404, True)
    assert client.post(f"/api/logs/{log['id']}/again").status_code == 202
    again = finished(client, log["id"])
    assert (again["state"], again["page"], again["number"]) == ("done", True, log["number"])
    assert work.PAGE_MISSING not in again["message"]
    assert client.get(f"/logs/{log['id']}").status_code == 200


def test_a_log_that_failed_counts_as_waiting_until_it_was_worked_on_again(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = served()
    log = dropped(client, "a.csv", b"\x00\x01 no log", "diagnose")
    assert (log["state"], log["page"]) == ("failed", False)
    monkeypatch.setattr("experiments.serve.jobs.Jobs.submit", lambda *_: None)
    waiting = client.post(f"/api/logs/{log['id']}/again").json()
    assert (waiting["state"], waiting["message"], waiting["ended"]) == ("waiting", None, None)
    assert client.get(f"/api/logs/{log['id']}/result").status_code == 409
    assert client.post(f"/api/logs/{log['id']}/again").status_code == 409
    assert client.get("/api/logs").json()["counts"] == {"unfinished": 1}


def test_a_log_that_is_gone_or_a_full_queue_is_said(served: Served, tmp_path: Path) -> None:
    client = served(waiting=1)
    assert client.post(f"/api/logs/{16 * '0'}/again").status_code == 404
    log = dropped(client, "a.csv", b"a,b\n1,2\n2,3\n")
    (tmp_path / "kept" / "logs" / log["id"]).unlink()
    answer = client.post(f"/api/logs/{log['id']}/again")
    assert (answer.status_code, "a.csv is no longer on the server" in answer.text) == (404, True)
    assert client.get(f"/api/logs/{log['id']}").json()["state"] == "done"
