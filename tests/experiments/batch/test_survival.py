"""Whatever kills a batch, the same command resumes it, and the store ends as if nothing had happened."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pyarrow as pa
import pytest

from experiments.batch.part_store import open_store
from experiments.running.executors import open_executor
from tests.experiments.batch.conftest import RUNS, rows_in_parts, run_into, small_plan

pytestmark = [pytest.mark.slow, pytest.mark.skipif(os.name == "nt", reason="needs SIGKILL and fork")]

STRIKES = 12

LONGER: dict[str, Any] = {**RUNS, "seeds": 96, "duration_s": 0.1}
"""144 tasks of 4 cases, about a hundredth of a second each: long enough for 12 kills on the way."""

DRIVER = """
import os, sys
from experiments.batch import cases, report, work
from experiments.cli import app
cases.MOST_CASES = 4
for line in sys.stdin:
    child = os.fork()
    if not child:
        app(line.split())
    print(child, flush=True)
    print(os.waitpid(child, 0)[1], flush=True)
"""
"""Loads the project once and forks a batch for each line, so that a kill hits work and not the loading."""


def study_file(folder: Path, runs: dict[str, Any]) -> Path:
    lines = ['name = "longer"', "[[runs]]"]
    for name, value in runs.items():
        text = json.dumps(value)
        if name == "methods":
            text = "[{ " + ", ".join(f"{key} = {json.dumps(one)}" for key, one in value[0].items()) + " }]"
        lines.append(f"{name} = {text}")
    path = folder / "longer.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def driver() -> Generator["subprocess.Popen[str]"]:
    with subprocess.Popen(  # noqa: S603 -- our own words
        [sys.executable, "-c", DRIVER],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        yield process
        process.kill()


def begin(driver: "subprocess.Popen[str]", *words: object) -> int:
    assert driver.stdin is not None
    assert driver.stdout is not None
    driver.stdin.write(" ".join(map(str, words)) + "\n")
    driver.stdin.flush()
    return int(driver.stdout.readline())


def end(driver: "subprocess.Popen[str]") -> int:
    assert driver.stdout is not None
    while not (line := driver.stdout.readline()).strip().isdigit():
        assert line, "the driver ended"
    return int(line)


def test_a_batch_killed_at_random_moments_neither_loses_nor_duplicates_a_row(
    tmp_path: Path, driver: "subprocess.Popen[str]"
) -> None:
    undisturbed, store = open_store(tmp_path / "undisturbed"), open_store(tmp_path / "store")
    run_into(undisturbed, small_plan(**LONGER))
    command = ("batch", study_file(tmp_path, LONGER), "--workers", 1, "--out", store.name)
    parts, moments = Path(store.name) / "parts", random.Random(7)  # noqa: S311 -- no secret
    kept, cut = dict[str, bytes](), set[str]()
    for number in range(STRIKES):
        child = begin(driver, *command)
        if number % 2:  # odd: at any moment; even: while parts are written
            time.sleep(moments.uniform(0.02, 0.2))
        else:
            _wait_for(lambda number=number: len(list(parts.glob("*.parquet"))) > 8 * number)
            time.sleep(moments.uniform(0.0, 0.02))
        # one odd and one even number, so that SIGTERM comes at both kinds of moment
        sent = signal.SIGTERM if number in (4, 7) else signal.SIGKILL
        os.kill(child, sent)
        status = end(driver)
        assert sent is signal.SIGTERM or os.WTERMSIG(status) == signal.SIGKILL, "it had ended before"
        now = {path.name: path.read_bytes() for path in parts.glob("*.parquet")}
        assert {name: now.get(name) for name in kept} == kept, "a completed part was lost or changed"
        if number % 3 == 0:  # as in a power failure: the part written last is truncated
            last = max(parts.glob("*.parquet"), key=lambda path: path.stat().st_mtime_ns)
            last.write_bytes(last.read_bytes()[: moments.randrange(last.stat().st_size)])
            cut.add(last.name)
        kept = {name: now[name] for name in now.keys() - cut}
    assert len(kept) + len(cut) < len(list((Path(undisturbed.name) / "parts").iterdir())), (
        "work was done when it was struck"
    )
    begin(driver, *command)
    assert end(driver) == 0
    assert store.rows().equals(undisturbed.rows())
    assert rows_in_parts(store) == len(small_plan(**LONGER))
    assert not list(parts.glob(".*"))


def test_two_workers_end_with_exit_code_0_every_time(tmp_path: Path) -> None:
    study = study_file(tmp_path, {**LONGER, "seeds": 8})
    command = [sys.executable, "-m", "experiments.cli", "batch", study, "--workers", "2", "--out"]
    for number in range(3):
        done = subprocess.run([*command, tmp_path / f"store{number}"], capture_output=True, text=True, check=False)  # noqa: S603 -- our own command
        assert done.returncode == 0, done.stderr


def test_a_killed_batch_leaves_no_workers_behind(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "experiments.cli", "batch", study_file(tmp_path, {**LONGER, "seeds": 4000})]
    store = open_store(tmp_path / "store")
    with subprocess.Popen([*command, "--workers", "2", "--out", store.name], stderr=subprocess.DEVNULL) as process:  # noqa: S603 -- our own command
        _wait_for(lambda: bool(list((Path(store.name) / "parts").glob("*.parquet"))))
        workers = _children(process.pid)
        process.kill()
    assert len(workers) >= 2
    _wait_for(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))


def _children(parent: int) -> list[int]:
    if not Path("/proc/self/stat").exists():
        pytest.skip("needs /proc")
    found = Path("/proc").glob("[0-9]*/stat")
    stats = ([*path.read_text().rsplit(")", 1)[1].split(), path.parent.name] for path in found)
    return [int(stat[-1]) for stat in stats if int(stat[1]) == parent]


def _wait_for(condition: Any, seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)


def test_ctrl_c_finishes_the_running_cases_and_says_how_to_go_on(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "experiments.cli", "batch", study_file(tmp_path, {**LONGER, "seeds": 4000})]
    store = open_store(tmp_path / "store")
    with subprocess.Popen(  # noqa: S603 -- our own command
        [*command, "--workers", "2", "--out", store.name],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        _wait_for(lambda: bool(list((Path(store.name) / "parts").glob("*.parquet"))))
        os.killpg(process.pid, signal.SIGINT)  # to the workers too, as a terminal does
        out, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "finishing the running cases" in said
    assert "the same command goes on from there" in said
    assert "Traceback" not in said
    assert out.strip() == f"{store.name}/report.html"
    kept = len(store.rows())
    assert f"{kept} of 24000 cases are kept" in said
    assert rows_in_parts(store) == kept


@pytest.mark.parametrize("workers", [1, 2])
def test_several_processes_give_exactly_the_rows_of_one(tmp_path: Path, reference: pa.Table, workers: int) -> None:
    store = open_store(tmp_path / "store")
    run_into(store, small_plan(), opener=lambda: open_executor(workers))
    assert store.rows().equals(reference)


@pytest.mark.filterwarnings("default")
def test_dask_gives_exactly_the_same_rows_with_a_worker_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    plan = small_plan(**LONGER)
    undisturbed, store = open_store(tmp_path / "undisturbed"), open_store(tmp_path / "store")
    run_into(undisturbed, plan)
    killed = Event()
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            victim = next(iter(client.run(os.getpid).values()))

        def strike(count: int, part: object) -> None:
            del count, part
            if not killed.is_set():
                killed.set()
                Thread(target=os.kill, args=(victim, signal.SIGKILL)).start()

        address = cluster.scheduler_address
        tally = run_into(store, plan, opener=lambda: open_executor(cluster=address), on_part=strike)
    assert killed.is_set()
    assert (tally.done, tally.failed, tally.stopped) == (len(plan), 0, "")
    assert store.rows().equals(undisturbed.rows())
    assert rows_in_parts(store) == len(plan)
