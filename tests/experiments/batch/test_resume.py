"""A batch resumes after a crash: no row is lost, and none is duplicated."""

import signal
from collections.abc import Callable
from pathlib import Path
from threading import Event

import numpy as np
import pyarrow as pa
import pytest

from experiments.batch import run_on_terminal
from experiments.batch.part_store import PartStore, open_store
from plant.errors import HydrostateError
from tests.experiments.batch.conftest import rows_in_parts, run_into, small_plan
from tests.thinned import thinned


def begun(folder: Path, parts: int) -> PartStore:
    """Return a store whose writer stopped after a number of parts."""
    store, stop, count = open_store(folder / "store"), Event(), [0]

    def strike(*_: object) -> None:
        count[0] += 1
        if count[0] == parts:
            stop.set()

    run_into(store, small_plan(), stop=stop, on_part=strike)
    assert len(list((Path(store.name) / "parts").iterdir())) == parts
    return store


def truncated(store: PartStore, rng: np.random.Generator) -> None:
    parts = sorted((Path(store.name) / "parts").glob("*.parquet"))
    part = parts[int(rng.integers(len(parts)))]
    part.write_bytes(part.read_bytes()[: int(rng.integers(part.stat().st_size))])


def half_written(store: PartStore, rng: np.random.Generator) -> None:
    (Path(store.name) / "parts" / ".abc.parquet.0123abcd.tmp").write_bytes(rng.bytes(50))


def zeroed(store: PartStore, rng: np.random.Generator) -> None:
    parts = sorted((Path(store.name) / "parts").glob("*.parquet"))
    part = parts[int(rng.integers(len(parts)))]
    part.write_bytes(bytes(part.stat().st_size))


def without_manifest(store: PartStore, _: np.random.Generator) -> None:
    Path(store.name, "manifest.json").unlink()
    Path(store.name, "report.html").write_text("a report")


def without_cases(store: PartStore, _: np.random.Generator) -> None:
    Path(store.name, "cases.parquet").write_bytes(b"PAR1")


@pytest.mark.parametrize("damage", [truncated, half_written, zeroed, without_manifest, without_cases])
@pytest.mark.parametrize("parts", thinned([1, 2, 4], [2]))
def test_a_store_is_resumed_after_any_damage_at_any_moment(
    damage: Callable[[PartStore, np.random.Generator], None], parts: int, tmp_path: Path, reference: pa.Table
) -> None:
    store = begun(tmp_path, parts)
    damage(store, np.random.default_rng(parts))
    run_into(store, small_plan())
    assert store.rows().equals(reference)
    assert rows_in_parts(store) == len(reference)


def test_a_damaged_manifest_is_refused_with_the_remedy_which_works(tmp_path: Path, reference: pa.Table) -> None:
    store = begun(tmp_path, 2)
    manifest = Path(store.name, "manifest.json")
    manifest.write_bytes(manifest.read_bytes()[:40])
    with pytest.raises(HydrostateError, match="delete it, and the same command goes on from the parts"):
        run_into(store, small_plan())
    manifest.unlink()
    run_into(store, small_plan())
    assert store.rows().equals(reference)


def test_an_interruption_after_the_last_case_does_not_mark_the_study_as_stopped(tmp_path: Path) -> None:
    stop, plan = Event(), small_plan()
    done: list[int] = []

    def strike(count: int, _: object) -> None:
        done.append(count)
        if sum(done) == len(plan):
            stop.set()

    assert run_into(open_store(tmp_path / "store"), plan, stop=stop, on_part=strike).stopped == ""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_first_signal_asks_the_study_to_stop_and_the_second_interrupts_it(number: int) -> None:
    before = signal.getsignal(number)
    with run_on_terminal._interruptible() as stop:
        signal.raise_signal(number)
        assert stop.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert signal.getsignal(number) is before
