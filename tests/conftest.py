"""What every test stands on: raising floating point, a hypothesis profile, a kernel cache, shared data."""

import gc
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pytest
import typer.testing
from _pytest.doctest import DoctestModule
from hypothesis import settings
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).resolve().parents[1]

# Set before the first import that reads them. The folder is fixed, so that compiled kernels outlive a run.
os.environ["MPLBACKEND"] = "Agg"
os.environ.setdefault("HYDROSTATE_CACHE", str(ROOT / ".pytest_cache" / "hydrostate-kernels"))

settings.register_profile("ci", derandomize=True, deadline=None, max_examples=50, print_blob=False)
settings.load_profile("ci")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give a worker whole files, and those that stand on the same in one go."""
    from tests.together import WholeFiles  # needs xdist

    return WholeFiles(config, log) if config.getvalue("dist") == "loadfile" else None


WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")


@pytest.hookimpl(wrapper=True)
def pytest_collect_directory() -> Generator[None, pytest.Collector | None, pytest.Collector | None]:
    """Let every second worker begin at the other end, so that each rewrites the asserts of half the files."""
    folder = yield
    if folder is not None and WORKER:
        from tests.together import backwards, from_its_end  # needs xdist

        if from_its_end(WORKER):
            backwards(folder)
    return folder


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put what workers have collected in one order, before any other order is made of it."""
    if WORKER:
        from tests.together import in_one_order  # needs xdist

        in_one_order(items)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Look for no examples in files of claims, which have none: looking takes a second of each worker's start."""
    found = yield
    return [one for one in found if not (file_path.name.startswith("test_") and isinstance(one, DoctestModule))]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave what is imported and collected, millions of objects, out of every search for garbage, then and later."""
    gc.disable()
    collected = yield
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)  # objects: a search each 700 takes a tenth of what reads or draws much
    gc.enable()
    return collected


@pytest.fixture(scope="session", autouse=True)
def _one_parser_of_commands() -> Iterator[None]:
    """Typer makes all verbs' parsers anew each time that a test invokes one, which is most of a short answer's work."""
    made = WeakKeyDictionary[typer.Typer, Any]()

    def once(app: typer.Typer) -> Any:
        if app not in made:
            made[app] = typer.main.get_command(app)
        return made[app]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(typer.testing, "_get_command", once)
        yield


@pytest.fixture(scope="session", autouse=True)
def _one_thread_for_linear_algebra() -> Iterator[None]:
    """Small matrices on busy cores: the library's own threads only get in each other's way."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(autouse=True)
def _raising_floating_point() -> Iterator[None]:
    with np.errstate(divide="raise", invalid="raise", over="raise", under="ignore"):
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of shared read-only data (bench logs), or skip where there is none."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no shared data in {folder}: set HYDROSTATE_SHARED to the folder that holds bench/")
    return folder


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Return the port of a real broker, or skip where there is none."""
    pytest.importorskip("paho.mqtt.client", reason="paho-mqtt is an extra")
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
    if program is None:
        pytest.skip("mosquitto is not installed")
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port = int(one.getsockname()[1])
    settings: Path = tmp_path_factory.mktemp("broker") / "mosquitto.conf"
    settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n")
    with subprocess.Popen([program, "-c", str(settings)], stderr=subprocess.DEVNULL) as running:  # noqa: S603
        for _ in range(100):
            with socket.socket() as one:
                if one.connect_ex(("127.0.0.1", port)) == 0:
                    break
            time.sleep(0.05)
        yield port
        running.terminate()
