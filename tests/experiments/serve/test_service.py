"""A page over many logs is made once, and again only if that helps; the files of stored logs remain."""

import asyncio
import socket
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from pebble import ProcessExpired

from experiments.serve.jobs import BusyError, log_file, page_file, phase_file
from experiments.serve.limits import RefusedError
from experiments.serve.server import _address  # pyright: ignore[reportPrivateUsage]
from experiments.serve.service import Service
from experiments.serve.settings import Settings
from experiments.serve.store import DONE, FAILED
from plant.errors import HydrostateError

RESULT = {"outcome": "ok", "message": "normal"}


@pytest.fixture
def service(tmp_path: Path, in_threads: None) -> Iterator[Service]:  # noqa: ARG001
    opened = Service(Settings(folder=tmp_path / "kept"))
    opened.open()
    yield opened
    opened.close()


def kept(service: Service, identity: str, state: str = DONE) -> None:
    log_file(service.settings, identity).write_bytes(b"a")
    service.store.add(identity, f"{identity}.csv", "diagnose", 1)
    service.store.finish(identity, state, RESULT, {"outcome": "ok"})


class Views:
    """A maker of pages with set results, which records the requests."""

    def __init__(self) -> None:
        self.rows: list[list[str]] = []
        self.args: list[tuple[Any, ...]] = []
        self.error: Exception | None = None

    def view(self, make: Any, *args: Any) -> "Future[str]":
        del make
        self.args.append(args)
        self.rows.append([identity for identity, *_ in args[0]])
        if isinstance(self.error, BusyError):
            raise self.error
        future: Future[str] = Future()
        if self.error is None:
            future.set_result(f"page {len(self.rows)}")
        else:
            future.set_exception(self.error)
        return future


@pytest.fixture
def views(service: Service, monkeypatch: pytest.MonkeyPatch) -> Views:
    one = Views()
    monkeypatch.setattr(service.jobs, "view", one.view)
    return one


def test_the_fleet_page_is_shared_by_all_requests_and_remade_after_a_change_of_logs(
    service: Service, views: Views
) -> None:
    async def asked() -> list[str]:
        kept(service, "a")
        pages = list(await asyncio.gather(service.fleet(), service.fleet()))
        pages.append(await service.fleet())
        kept(service, "b")
        pages.append(await service.fleet())
        service.delete("a")
        return [*pages, await service.fleet()]

    assert asyncio.run(asked())[2:] == ["page 1", "page 2", "page 3"]
    assert views.rows == [["a"], ["a", "b"], ["b"]]


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (TimeoutError(), "took too long"),
        (ProcessExpired("gone", code=-9), "took too long"),
        (BusyError(), "too many pages"),
    ],
)
def test_a_fleet_page_that_failed_is_made_at_the_next_request(
    service: Service, views: Views, error: Exception, words: str
) -> None:
    async def asked() -> str:
        kept(service, "a")
        views.error = error
        with pytest.raises(RefusedError, match=words) as refused:
            await service.fleet()
        assert refused.value.status == 429
        assert refused.value.headers["Retry-After"]
        views.error = None
        return await service.fleet()

    assert asyncio.run(asked()) == "page 2"


def test_a_change_of_the_table_of_repairs_takes_effect_and_an_invalid_table_is_refused(
    tmp_path: Path,
    in_threads: None,  # noqa: ARG001
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = tmp_path / "repairs.csv"
    table.write_text("actuator,date\n")
    service = Service(Settings(folder=tmp_path / "kept", maintenance=table))
    service.open()
    views = Views()
    monkeypatch.setattr(service.jobs, "view", views.view)

    async def asked() -> None:
        kept(service, "a")
        await service.fleet()
        table.write_text("actuator,date\npress,2026-01-02\n")
        await service.fleet()
        await service.actuator("press")
        table.write_text("actuator,date\npress,soon\n")
        with pytest.raises(RefusedError, match=r"the table of repairs cannot be used: .*repairs\.csv") as refused:
            await service.fleet()
        assert refused.value.status == 409

    asyncio.run(asked())
    service.close()
    assert [list(one[3]) for one in views.args] == [[], ["press"], ["press"]]


def test_a_cancelled_request_does_not_cancel_the_page_for_others(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    pending: Future[str] = Future()
    monkeypatch.setattr(service.jobs, "view", lambda *_: pending)

    async def asked() -> str:
        kept(service, "a")
        one, other = asyncio.ensure_future(service.fleet()), asyncio.ensure_future(service.fleet())
        while service._fleet is None:
            await asyncio.sleep(0.001)
        one.cancel()
        await asyncio.sleep(0.01)
        pending.set_result("page")
        return await other

    assert asyncio.run(asked()) == "page"


def test_opening_removes_files_without_a_log_and_keeps_the_others(service: Service, tmp_path: Path) -> None:
    kept(service, "a")
    for identity in ("a", "gone"):
        page_file(service.settings, identity).write_text("page")
    log_file(service.settings, "gone").write_bytes(b"a")
    phase_file(service.settings, "gone").write_text("reading the log")
    service.close()
    again = Service(Settings(folder=tmp_path / "kept"))
    again.open()
    assert [path.name for path in service.settings.logs.iterdir()] == ["a"]
    assert [path.name for path in service.settings.pages.iterdir()] == ["a.html"]
    assert list(service.settings.work.iterdir()) == []
    assert again.page("a") == page_file(again.settings, "a")
    again.close()
    service.open()


def test_the_page_of_a_failed_log_is_refused_with_the_reason(service: Service) -> None:
    kept(service, "a", FAILED)
    page_file(service.settings, "a").write_text("half")
    with pytest.raises(RefusedError, match=r"there is no page of a\.csv\. normal") as refused:
        service.page("a")
    assert refused.value.status == 404
    kept(service, "b")
    with pytest.raises(RefusedError, match=r"there is no page of b\.csv"):
        service.page("b")


def test_an_unknown_stream_is_refused_by_its_name(service: Service) -> None:
    with pytest.raises(RefusedError, match="no stream 'press' is watched"):
        service.stream("press")


def test_the_folder_is_for_the_server_s_user_alone(service: Service) -> None:
    assert service.settings.folder.stat().st_mode & 0o077 == 0


def test_a_log_that_the_database_cannot_store_is_refused_and_leaves_no_file(service: Service, tmp_path: Path) -> None:
    part = tmp_path / "a.part"
    part.write_bytes(b"a,b\n")
    service.store._connection.execute("PRAGMA max_page_count = 1")
    with pytest.raises(RefusedError, match="takes no more") as refused:
        service.take_in("a", part, "x" * 100_000, "diagnose", 4)
    assert refused.value.status == 413
    assert list(service.settings.logs.iterdir()) == []
    assert service.jobs.waiting == 0


@pytest.mark.parametrize(("failures", "status"), [(1, None), (2, 413)])
def test_on_a_full_disk_the_files_of_a_deleted_log_make_room_for_the_change(
    service: Service, monkeypatch: pytest.MonkeyPatch, failures: int, status: int | None
) -> None:
    kept(service, "a")
    page_file(service.settings, "a").write_text("page")
    delete, there = service.store.delete, list[bool]()

    def when_there_is_room(identity: str) -> bool:
        there.append(log_file(service.settings, "a").exists())
        if len(there) <= failures:
            raise HydrostateError("database or disk is full")
        return delete(identity)

    monkeypatch.setattr(service.store, "delete", when_there_is_room)
    if status is None:
        service.delete("a")
        assert service.store.get("a") is None
    else:
        with pytest.raises(RefusedError, match="its row is not") as refused:
            service.delete("a")
        assert refused.value.status == status
    assert there == [True, False]
    assert not page_file(service.settings, "a").exists()


def test_a_log_that_the_folder_cannot_take_is_refused(
    service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = tmp_path / "a.part"
    part.write_bytes(b"a,b\n")
    monkeypatch.setattr(
        service.settings.logs.__class__, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "full"))
    )
    with pytest.raises(RefusedError, match="takes no more") as refused:
        service.take_in("a", part, "a.csv", "diagnose", 4)
    assert refused.value.status == 413
    assert not part.exists()


def test_a_folder_with_an_invalid_database_is_released_for_the_next_server(tmp_path: Path, in_threads: None) -> None:  # noqa: ARG001
    settings = Settings(folder=tmp_path / "kept")
    settings.folder.mkdir()
    settings.database.write_bytes(b"no database, but long enough to be taken for one" * 100)
    refused = Service(settings)
    with pytest.raises(HydrostateError, match="must be a database of this server"):
        refused.open()
    settings.database.unlink()
    again = Service(settings)
    again.open()
    again.close()


@pytest.mark.parametrize(
    ("host", "begin"),
    [("127.0.0.1", "http://127.0.0.1:"), ("0.0.0.0", f"http://{socket.gethostname()}:"), ("::1", "http://[::1]:")],  # noqa: S104
)
def test_the_printed_address_is_reachable_and_contains_the_token(host: str, begin: str) -> None:
    token = None if host.startswith(("127", "::1")) else 16 * "a"
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        said = _address(Settings(folder=Path("kept"), host=host, token=token), listener)
    assert said.startswith(begin)
    assert ("?token=" in said) is (token is not None)
