"""A kernel is a file, named by what is in it, that later processes reuse."""

import errno
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from plant.compiled.kernel_file import cache_folder, load_kernel

SOURCE = '''"""Generated: a test."""

import numba


@numba.njit(cache=True)
def scale(x):
    return {factor} * x
'''


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HYDROSTATE_CACHE", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


def test_the_environment_moves_the_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder() == folder
    monkeypatch.delenv("HYDROSTATE_CACHE")
    assert cache_folder().name == "hydrostate"


def test_a_changed_source_gives_another_file(folder: Path) -> None:
    double, triple = (load_kernel("scale", SOURCE.format(factor=factor)) for factor in (2.0, 3.0))
    assert (double.scale(5.0), triple.scale(5.0)) == (10.0, 15.0)
    assert len(list(folder.glob("hydrostate_scale_*.py"))) == 2
    assert list(folder.glob("*.tmp")) == []


def test_the_same_source_gives_the_same_module(folder: Path) -> None:
    source = SOURCE.format(factor=5.0)
    assert load_kernel("scale", source) is load_kernel("scale", source)
    assert len(list(folder.glob("*.py"))) == 1


def test_a_folder_that_cannot_be_written_costs_the_cache_and_not_the_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "a_file"
    blocked.write_text("no folder")
    monkeypatch.setenv("HYDROSTATE_CACHE", str(blocked / "kernels"))
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        module = load_kernel("scale", SOURCE.format(factor=7.0))
    assert module.scale(2.0) == 14.0
    (message,) = caplog.messages
    assert message.startswith(f"kernels cannot be cached in {blocked / 'kernels'} (")
    assert blocked.read_text() == "no folder"


def test_a_second_process_reuses_file_and_machine_code(folder: Path) -> None:
    assert answer(folder) == ["22.0", "0"]
    files = {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.*") if path.is_file()}
    assert answer(folder) == ["22.0", "1"]
    assert {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.*") if path.is_file()} == files


def answer(folder: Path) -> list[str]:
    """What a new process computes, and how often Numba found it compiled."""
    program = (
        "from plant.compiled.kernel_file import load_kernel\n"
        f"kernel = load_kernel('scale', {SOURCE.format(factor=11.0)!r}).scale\n"
        "print(kernel(2.0), sum(kernel.stats.cache_hits.values()))\n"
    )
    environment = {**os.environ, "HYDROSTATE_CACHE": str(folder)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)  # noqa: S603  # our own interpreter
    return done.stdout.split()


@pytest.mark.parametrize(("suffix", "damaged", "hits"), [(".nbi", b"", 0), (".nbc", b"noise", 0), (".py", b"def", 1)])
def test_damaged_files_heal(folder: Path, suffix: str, damaged: bytes, hits: int) -> None:
    def again() -> tuple[float, int]:
        for name in [name for name in sys.modules if name.startswith("hydrostate_scale_")]:
            del sys.modules[name]
        scale = load_kernel("scale", SOURCE.format(factor=19.0)).scale
        return scale(2.0), sum(scale.stats.cache_hits.values())

    assert [again(), again()] == [(38.0, 0), (38.0, 1)]
    (path,) = folder.rglob(f"hydrostate_scale_*{suffix}")
    path.write_bytes(damaged)
    assert [again(), again()] == [(38.0, hits), (38.0, 1)]


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have owners")
def test_a_folder_that_others_may_write_to_is_not_used(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        assert load_kernel("scale", SOURCE.format(factor=13.0)).scale(1.0) == 13.0
    (message,) = caplog.messages
    assert message.startswith(f"compiled kernels in {folder} are not used, for others may write to it")
    assert list(folder.iterdir()) == []


def test_a_disk_that_fills_up_costs_the_cache_and_not_the_result(
    folder: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = load_kernel("scale", SOURCE.format(factor=17.0))

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        assert module.scale(1.0) == 17.0
    assert "No space left on device" in caplog.text
    assert not list(folder.rglob("*.nb*"))
