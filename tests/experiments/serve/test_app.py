"""The server's answers to uploaded logs, and to requests that it refuses."""

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from experiments.serve import app as server
from experiments.serve.limits import HEADERS
from experiments.serve.settings import Settings
from plant.errors import HydrostateError

Served = Callable[..., TestClient]


def finished(client: TestClient, identity: str) -> dict[str, Any]:
    until = time.monotonic() + 30.0
    while time.monotonic() < until:
        found = client.get(f"/api/logs/{identity}").json()
        if found["state"] not in ("waiting", "running"):
            return found
        time.sleep(0.01)
    raise TimeoutError(identity)


def dropped(client: TestClient, name: str, content: bytes, verb: str = "inspect") -> dict[str, Any]:
    answer = client.post("/api/logs", params={"name": name, "verb": verb}, content=content)
    assert answer.status_code == 202, answer.text
    return finished(client, answer.json()["id"])


def test_an_uploaded_log_is_processed_and_its_page_allows_only_its_own_scripts(served: Served, log: bytes) -> None:
    client = served()
    found = dropped(client, "run 1.csv", log, "estimate")
    assert (found["state"], found["outcome"], found["name"]) == ("done", "ok", "run 1.csv")
    result = client.get(f"/api/logs/{found['id']}/result").json()
    assert result["file"] == "run 1.csv"
    assert result["bulk_modulus_pa"]["value"] == pytest.approx(2.07e8, rel=0.01)
    page = client.get(f"/logs/{found['id']}")
    policy = page.headers["content-security-policy"]
    said = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page.text)
    assert said is not None
    assert policy == f"{said[1]}; frame-ancestors 'none'"
    assert "default-src 'none'" in policy
    assert "connect-src" not in policy
    assert "run 1.csv" in page.text


def test_a_file_that_is_not_a_log_fails_without_naming_a_path_of_the_server(served: Served, tmp_path: Path) -> None:
    client = served()
    found = dropped(client, "words.csv", b"these are, words\nand no, numbers\n", "diagnose")
    assert found["state"] == "failed"
    assert found["message"]
    text = client.get(f"/api/logs/{found['id']}/result").text
    assert str(tmp_path) not in text
    assert found["id"] not in text.replace(f"/api/logs/{found['id']}", "")
    assert client.get(f"/logs/{found['id']}").status_code == 404


@pytest.mark.parametrize(
    ("name", "kept"),
    [("../../evil.csv", "evil.csv"), ("C:\\x\\a.csv", "a.csv"), ("..", "log"), ("a\x00\x1b[2J.csv", "a[2J.csv")],
)
def test_a_file_name_with_a_path_writes_nothing_outside_the_folder(
    served: Served, tmp_path: Path, name: str, kept: str
) -> None:
    before = set(tmp_path.rglob("*"))
    client = served()
    found = dropped(client, name, b"a,b\n1,2\n2,3\n")
    assert found["name"] == kept
    new = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")} - {str(one) for one in before}
    own = {f"kept/logs/{found['id']}", f"kept/work/{found['id']}"}  # the second disappears when the work is tidied up
    known = {"kept", "kept/logs", "kept/pages", "kept/work", "kept/in-use"} | own
    assert {one for one in new if "sqlite" not in one and not one.endswith(".html")} <= known


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "/api/logs/0123456789abcdef", {}, 404),
        ("GET", "/api/logs/..%2f..%2fetc%2fpasswd", {}, 404),
        ("GET", "/logs/%2e%2e%2f%2e%2e", {}, 404),
        ("GET", "/api/logs/nonsense", {}, 422),
        ("GET", "/api/logs?most=0", {}, 422),
        ("GET", "/api/logs?before=99999999999999999999999", {}, 422),
        ("GET", "/api/streams/bench", {}, 404),
        ("GET", "/live/bench", {}, 404),
        ("GET", "/fleet", {}, 404),
        ("GET", "/docs", {}, 404),
        ("PUT", "/api/logs", {}, 405),
        ("GET", "/", {"host": "evil.example"}, 421),
        ("POST", "/api/logs?name=a", {"origin": "http://evil.example"}, 403),
        ("POST", "/api/logs?name=a", {"origin": "null"}, 403),
        ("POST", "/api/logs?name=a", {"origin": "http://["}, 403),
        ("DELETE", "/api/logs/0123456789abcdef", {"sec-fetch-site": "cross-site"}, 403),
        ("POST", "/api/logs", {}, 422),
        ("POST", "/api/logs?name=a&verb=obey", {}, 422),
        ("POST", "/api/logs?name=a", {}, 422),
        ("POST", "/api/logs?name=a", {"content-length": "999999999999"}, 413),
        ("POST", "/api/logs?name=a", {"content-type": "multipart/form-data; boundary=x"}, 415),
    ],
)
def test_invalid_requests_are_refused_with_a_message_and_every_security_header(
    served: Served, method: str, path: str, headers: dict[str, str], status: int
) -> None:
    answer = served().request(method, path, headers=headers)
    assert answer.status_code == status
    assert isinstance(answer.json()["detail"], str)
    assert {name.decode() for name in HEADERS} <= set(answer.headers)


def test_requests_without_the_token_are_refused(served: Served) -> None:
    client = served(host="0.0.0.0", token="sixteen-letters-!")  # noqa: S104, S106
    paths = ("/", "/api/logs", "/openapi.json", "/nowhere", "/?token=wrong")
    assert {client.get(path).status_code for path in paths} == {401}
    assert client.get("/api/logs", headers={"authorization": "Bearer sixteen-letters-!"}).status_code == 200
    assert client.get("/api/logs", headers={"authorization": "Bearer sixteen-letters"}).status_code == 401
    entry = client.get("/", params={"token": "sixteen-letters-!"})
    assert (entry.status_code, entry.headers["location"]) == (303, "./")
    assert {"HttpOnly", "SameSite=Strict"} <= set(entry.headers["set-cookie"].split("; "))
    assert client.get("/api/logs").status_code == 200  # the client keeps the cookie


def test_a_full_queue_refuses_a_log_with_a_retry_time(served: Served) -> None:
    answer = served(waiting=0).post("/api/logs", params={"name": "a.csv"}, content=b"a")
    assert answer.status_code == 429
    assert int(answer.headers["retry-after"]) > 0


def test_simultaneous_uploads_and_open_views_are_limited(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST_UPLOADS", 0)
    monkeypatch.setattr(server, "MOST_STREAM_VIEWS", 0)
    monkeypatch.setattr("experiments.serve.live.Stream.start", lambda _: None)
    client = served(streams={"bench": "tcp://127.0.0.1:1"})
    answers = [
        client.post("/api/logs", params={"name": "a.csv"}, content=b"a"),
        client.get("/api/streams/bench/events"),
    ]
    assert [one.status_code for one in answers] == [429, 429]
    assert "0 logs are coming in" in answers[0].text
    assert "0 views are open, close one" in answers[1].text


@pytest.mark.parametrize("turned", [False, True])
def test_a_request_with_a_foreign_origin_among_several_is_refused(served: Served, turned: bool) -> None:
    origins = ["http://127.0.0.1", "http://evil.example"]
    headers = [("origin", one) for one in (reversed(origins) if turned else origins)]
    assert served().post("/api/logs?name=a", content=b"a", headers=headers).status_code == 403


@pytest.mark.parametrize("settings", [{"largest": 1000}, {"room": 1000}])
def test_a_body_that_is_too_large_is_refused_and_leaves_no_file(
    served: Served, tmp_path: Path, settings: dict[str, int]
) -> None:
    client, sent = served(**settings), list[int]()

    def body() -> Any:
        for number in range(10):
            sent.append(number)
            yield b"x" * 400

    assert client.post("/api/logs", params={"name": "a.csv"}, content=body()).status_code == 413
    assert not list((tmp_path / "kept" / "work").iterdir())
    assert not list((tmp_path / "kept" / "logs").iterdir())
    assert client.get("/api/logs").json()["logs"] == []


def test_deleting_a_log_also_deletes_its_page(served: Served, tmp_path: Path) -> None:
    client = served()
    found = dropped(client, "a.csv", b"a,b\n1,2\n2,3\n")
    assert client.get(f"/logs/{found['id']}").status_code == 200
    assert client.delete(f"/api/logs/{found['id']}").status_code == 204
    assert {client.get(f"{path}/{found['id']}").status_code for path in ("/logs", "/api/logs")} == {404}
    assert client.delete(f"/api/logs/{found['id']}").status_code == 404
    assert not list((tmp_path / "kept").rglob(f"*{found['id']}*"))


def test_a_waiting_log_has_neither_a_result_nor_a_page(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    client = served()
    monkeypatch.setattr("experiments.serve.jobs.Jobs.submit", lambda *_: None)
    identity = client.post("/api/logs", params={"name": "a.csv"}, content=b"a").json()["id"]
    assert client.get(f"/api/logs/{identity}").json()["state"] == "waiting"
    assert {client.get(path).status_code for path in (f"/logs/{identity}", f"/api/logs/{identity}/result")} == {409}
    assert client.get("/compare", params={"first": identity, "second": identity}).status_code == 409


def test_two_logs_can_be_compared_and_the_fleet_follows_uploads_and_deletions(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    from experiments.serve.work import LogResult

    def stand_in(task: Any) -> LogResult:
        value = 1.0 if task.name == "A_1.csv" else 3.0
        one = {"value": value, "unit": "L/min", "std": 0.1, "ci95": [value - 0.2, value + 0.2], "ci95_total": None}
        severity = {"leakage_flow": one}
        row = {"outcome": "ok", "found_condition": "normal", "quantities": ""}
        row["quantities"] = f'{{"leakage_flow": {{"value": {value}, "ci95": [{value - 0.2}, {value + 0.2}], '
        row["quantities"] += '"unit": "L/min", "healthy": 0.0, "limit": 2.0}}'
        result = {"file": task.name, "outcome": "ok", "message": "it is so", "severity": severity}
        return LogResult(result, row)

    monkeypatch.setattr("experiments.serve.jobs.process_log", stand_in)
    client = served(pattern="{actuator}_{date}.csv")
    pair = [dropped(client, name, b"a", "diagnose")["id"] for name in ("A_1.csv", "<b>_2.csv")]
    (row,) = client.get("/api/compare", params={"first": pair[0], "second": pair[1]}).json()["differences"]
    assert (row["difference"], row["changed"]) == (2.0, True)
    assert row["interval"] == pytest.approx([2.0 - 0.2 * 2**0.5, 2.0 + 0.2 * 2**0.5])
    page = client.get("/compare", params={"first": pair[0], "second": pair[1]}).text
    assert "In the second log, leakage is higher." in page
    assert "<b>_2" not in page
    fleet = client.get("/fleet")
    assert "1 of 2 actuators is past a limit." in fleet.text
    assert f"logs/{pair[1]}" in fleet.text
    client.delete(f"/api/logs/{pair[1]}")
    assert "The actuator is past no limit." in client.get("/fleet").text


def test_logs_are_listed_the_latest_first_and_page_by_page(served: Served) -> None:
    client = served()
    names = [dropped(client, f"{number}.csv", b"a,b\n1,2\n2,3\n")["name"] for number in range(3)]
    first = client.get("/api/logs", params={"most": 2}).json()
    rest = client.get("/api/logs", params={"most": 2, "before": first["logs"][-1]["number"]}).json()
    assert [one["name"] for one in first["logs"] + rest["logs"]] == names[::-1]
    assert sum(first["counts"].values()) == 3


def test_openapi_documents_every_status_of_an_upload(served: Served) -> None:
    paths = served().get("/openapi.json").json()["paths"]
    assert {"/api/logs", "/api/compare", "/api/streams/{name}/events", "/fleet"} <= set(paths)
    told = set(paths["/api/logs"]["post"]["responses"])
    assert {str(status) for status in server.WHY} - {"404", "409"} | {"202"} == told


def test_an_unexpected_error_is_answered_with_a_message_and_every_security_header(
    served: Served, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    client = served()
    monkeypatch.setattr("experiments.serve.store.Store.counts", lambda _: 1 / 0)
    client = TestClient(client.app, base_url="http://127.0.0.1", raise_server_exceptions=False)
    answer = client.get("/api/logs")
    assert answer.status_code == 500
    assert "please report it" in answer.json()["detail"]
    assert {name.decode() for name in HEADERS} <= set(answer.headers)
    assert "Traceback" not in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_ends_the_server_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    settings = Settings(folder=tmp_path / "file" / "kept")
    for told in (None, list[HydrostateError]()):
        app = server.make_app(settings, None if told is None else told.append)
        with pytest.raises(HydrostateError, match="the server's folder cannot be made"), TestClient(app):
            pass
        assert told is None or len(told) == 1


@pytest.mark.parametrize(("path", "status"), [("/fleet", 404), ("/nowhere", 404), ("/compare?first=x&second=y", 422)])
def test_a_refusal_is_a_page_for_a_browser_and_data_for_a_program(served: Served, path: str, status: int) -> None:
    client = served()
    page = client.get(path, headers={"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"})
    assert (page.status_code, page.headers["content-type"]) == (status, "text/html; charset=utf-8")
    assert "<h1>This page cannot be shown.</h1>" in page.text
    assert '<a href="./">All logs</a>' in page.text
    assert "should match pattern" not in page.text
    assert set(client.get(path).json()) == {"detail"}


def test_a_browser_without_the_token_gets_a_page_that_explains_it(served: Served) -> None:
    client = served(token=16 * "a")
    page = client.get("/", params={"token": "<b>"}, headers={"Accept": "text/html"})
    assert (page.status_code, "<b>" in page.text) == (401, False)
    assert "A token is needed: open the address that the server printed" in page.text
    program = client.get("/api/logs", headers={"Accept": "text/html"})
    assert (program.status_code, set(program.json())) == (401, {"detail"})


def test_the_page_of_an_actuator_is_served(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.serve.work import LogResult

    row = {"outcome": "ok", "found_condition": "normal"}
    said = "the verdict of its page"
    monkeypatch.setattr(
        "experiments.serve.jobs.process_log",
        lambda task: LogResult({"file": task.name, "outcome": "ok", "message": "it is so"}, row, said),
    )
    client = served(pattern="{actuator}_{date}.csv")
    logs = [dropped(client, f"A_{day}.csv", b"a", "diagnose") for day in (1, 2)]
    assert [client.get(f"/api/logs/{one['id']}").json()["message"] for one in logs] == [said, said]
    page = client.get("/actuator", params={"name": "A"})
    assert (page.status_code, page.text.count('<td class="name" data-head="log"><a href="logs/')) == (200, 2)
    assert client.get("/actuator", params={"name": "B"}).status_code == 404


def test_a_page_that_is_deleted_between_two_steps_is_not_found(
    served: Served, log: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = served()
    found = dropped(client, "run.csv", log)
    whole = client.get(f"/logs/{found['id']}")
    assert int(whole.headers["content-length"]) == len(whole.content)
    monkeypatch.setattr("experiments.serve.service.Service.page", lambda *_: tmp_path / "gone.html")
    answer = client.get(f"/logs/{found['id']}")
    assert (answer.status_code, answer.json()) == (404, {"detail": "the page was deleted"})


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("a\u202eb\u200b\ufeff\u061cc.csv", "abc.csv"),
        ("\u200b", "log"),
        ("\u200d.", "log"),
        ("\U000e0041\u2028.csv", ".csv"),
        ("\u0645\u06cc\u200c\u062e.csv", "\u0645\u06cc\u200c\u062e.csv"),
    ],
)
def test_a_name_holds_nothing_that_cannot_be_seen(given: str, shown: str) -> None:
    assert server.plain_name(given) == shown
