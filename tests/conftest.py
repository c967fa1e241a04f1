"""Set-up of all tests: floating-point errors raise, a hypothesis profile, a kernel cache, shared data, a browser."""

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
    """Give each worker whole files, and keep files that share costly fixtures on one worker."""
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
    """Sort the collected tests into the same order on all workers, before anything else reorders them."""
    if WORKER:
        from tests.together import in_one_order  # needs xdist

        in_one_order(items)


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path) -> Generator[None, list[pytest.Collector], list[pytest.Collector]]:
    """Skip doctests in ``test_*.py`` files, which have none; the search takes a second at each worker's start."""
    found = yield
    return [one for one in found if not (file_path.name.startswith("test_") and isinstance(one, DoctestModule))]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Exclude all imported and collected objects, millions of them, from every garbage collection from now on."""
    gc.disable()
    collected = yield
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 100)  # objects; collecting every 700 takes a tenth of the time
    gc.enable()
    return collected


@pytest.fixture(scope="session", autouse=True)
def _one_parser_of_commands() -> Iterator[None]:
    """Build Typer's command parser only once.

    Otherwise each call in a test would rebuild the parsers of all verbs, which takes most of the time of a short call.
    """
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
    """Use one thread for linear algebra: the matrices are small and the cores busy, so threads would compete."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(autouse=True)
def _raising_floating_point() -> Iterator[None]:
    with np.errstate(divide="raise", invalid="raise", over="raise", under="ignore"):
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of shared read-only data (bench logs); skip the test if there is none."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no shared data in {folder}: set HYDROSTATE_SHARED to the folder that holds bench/")
    return folder


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Return the port of a real MQTT broker; skip the test if none is installed."""
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


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    if CHROMIUM is None:
        pytest.skip("needs Chromium (Debian's package chromium)")
    with playwright.sync_playwright() as started:
        one = started.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield one
        one.close()
