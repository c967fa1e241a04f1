import errno
import json
import os
import sys
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow.parquet import read_table

from experiments.batch.part_store import PartStore, open_store
from plant.errors import HydrostateError
from tests.experiments.batch.conftest import rows_in_parts, run_into, small_plan


@pytest.fixture
def store(tmp_path: Path) -> PartStore:
    return open_store(tmp_path / "store")


def parts(store: PartStore) -> list[Path]:
    return sorted(Path(store.name).glob("parts/*.parquet"))


def test_rows_are_in_the_order_of_the_study_and_can_be_read_while_it_runs(
    store: PartStore, reference: pa.Table
) -> None:
    seen: list[int] = []

    def look(count: int, part: object) -> None:
        del part
        rows = store.rows()
        seen.append(count)
        assert len(rows) == sum(seen)
        assert rows.equals(reference.take(sorted(_places(reference, rows))).combine_chunks())

    run_into(store, small_plan(), on_part=look)
    assert len(seen) > 3


def _places(reference: pa.Table, rows: pa.Table) -> list[int]:
    keys = reference["key"].to_pylist()
    return [keys.index(key) for key in rows["key"].to_pylist()]


def test_a_store_is_read_without_threads(store: PartStore, monkeypatch: pytest.MonkeyPatch) -> None:
    run_into(store, small_plan())
    told: list[object] = []

    def reading(*what: Any, **how: Any) -> pa.Table:
        told.append(how.get("use_threads", True))
        return read_table(*what, **how)

    monkeypatch.setattr(pq, "read_table", reading)
    assert len(store.rows()) == 24
    assert len(told) > len(parts(store))
    assert not any(told)


@pytest.mark.parametrize("damage", ["cut", "flipped", "empty", "rubbish"])
def test_a_damaged_part_is_set_aside_and_its_cases_run_again(
    store: PartStore, reference: pa.Table, damage: str
) -> None:
    run_into(store, small_plan())
    victim = parts(store)[0]
    content = bytearray(victim.read_bytes())
    middle = content.find(b"(\xb5/\xfd") + 12  # within the first compressed page
    content[middle] ^= 0x10
    wrong = {"cut": victim.read_bytes()[:-40], "flipped": bytes(content), "empty": b"", "rubbish": b"PAR1" * 50}
    victim.write_bytes(wrong[damage])
    assert len(store.rows()) < 24
    done, broken = store.done()
    assert broken == [victim.name]
    assert len(done) < 24
    assert (Path(store.name) / "set-aside" / victim.name).exists()
    assert run_into(store, small_plan()).done == 24 - len(done)
    assert store.rows().equals(reference)


def test_a_full_disk_is_reported_and_loses_no_kept_row(
    store: PartStore, reference: pa.Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = [0]

    def full(_: int) -> None:
        written[0] += 1
        if written[0] > 4:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(HydrostateError, match=r"store .* cannot be written: No space left on device"):
            run_into(store, small_plan())
    kept = len(store.rows())
    assert 0 < kept < 24
    assert not list(Path(store.name).rglob("*.tmp"))
    assert run_into(store, small_plan()).done == 24 - kept
    assert store.rows().equals(reference)


def test_a_store_without_write_permission_is_refused(store: PartStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "mkdir", refused)
    with pytest.raises(HydrostateError, match="cannot be written: Permission denied"):
        run_into(store, small_plan())


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc, where not even root may write")
def test_a_store_on_a_read_only_file_system_is_refused() -> None:
    with pytest.raises(HydrostateError, match="store /proc/store cannot be written: "):
        run_into(open_store("/proc/store"), small_plan())


def test_a_second_writer_is_refused_and_a_reader_is_not(store: PartStore) -> None:
    run_into(store, small_plan(seeds=1))
    with store.writing():
        with (
            pytest.raises(HydrostateError, match="is being written by another process"),
            open_store(store.name).writing(),
        ):
            pass
        assert len(open_store(store.name).rows()) == 6


def test_a_folder_with_other_files_is_refused_as_a_store(store: PartStore) -> None:
    folder = Path(store.name)
    folder.mkdir()
    (folder / "thesis.doc").write_text("mine", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"it holds thesis\.doc: choose another"):
        run_into(store, small_plan())


def test_leftovers_of_a_killed_writer_are_removed(store: PartStore) -> None:
    run_into(store, small_plan(seeds=1))
    leftover = Path(store.name) / "parts" / ".a.parquet.12345678.tmp"
    leftover.write_bytes(b"half")
    run_into(store, small_plan(seeds=1))
    assert not leftover.exists()
    assert rows_in_parts(store) == 6


def test_reading_a_missing_store_is_refused(store: PartStore) -> None:
    with pytest.raises(HydrostateError, match="there is no batch study there"):
        store.rows()


def test_a_store_on_an_fsspec_file_system_is_resumed(reference: pa.Table) -> None:
    pytest.importorskip("fsspec", reason="the extra `remote` is not installed")
    store = open_store("memory://hydrostate-test/store")
    run_into(store, small_plan(seeds=2))
    assert run_into(store, small_plan()).done == 12
    assert store.rows().equals(reference)
    assert store.folder.files("parts") == sorted(set(store.folder.files("parts")))
    assert not [name for name in store.folder.files("parts") if name.endswith(".tmp")]


def test_an_unknown_protocol_is_refused() -> None:
    pytest.importorskip("fsspec", reason="the extra `remote` is not installed")
    with pytest.raises(HydrostateError, match="store nowhere://a"):
        open_store("nowhere://a")


def test_a_store_of_another_format_is_refused_and_an_empty_one_has_no_rows(store: PartStore) -> None:
    run_into(store, small_plan(seeds=1))
    manifest = Path(store.name) / "manifest.json"
    content = json.loads(manifest.read_text())
    manifest.write_text(json.dumps({**content, "format": "later"}))
    with pytest.raises(HydrostateError, match=r"must be of format .*, got 'later'"):
        open_store(store.name).manifest()
    manifest.write_text(json.dumps(content))
    for part in (Path(store.name) / "parts").iterdir():
        part.unlink()
    left = open_store(store.name).rows(["outcome", "key"])
    assert (len(left), left.column_names) == (0, ["outcome", "key"])
