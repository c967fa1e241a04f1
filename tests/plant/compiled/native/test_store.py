"""The cache of machine code repairs itself, and files that others could have written are never run."""

import errno
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from plant.compiled.native import load, store
from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature

TEXT = "def scale(x):\n    return {factor} * x\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HYDROSTATE_CACHE", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


def scale(factor: float = 2.0) -> Callable[[float], float]:
    """Load the kernel as a new process would."""
    load._LOADED.clear()
    return load_native("scale", TEXT.format(factor=factor), {"scale": signature("x : float")}).scale


@pytest.fixture
def compiling(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the kernels that were compiled."""
    names: list[str] = []
    compile_it = load._compile

    def counted(name: str, *rest: Any) -> Any:
        names.append(name)
        return compile_it(name, *rest)

    monkeypatch.setattr(load, "_compile", counted)
    return names


def file_in(folder: Path) -> Path:
    (path,) = folder.glob("*.machine")
    return path


def test_a_later_run_compiles_nothing(folder: Path, compiling: list[str]) -> None:
    assert scale()(3.0) == scale()(3.0) == 6.0
    assert compiling == ["scale"]
    assert [path.suffix for path in folder.iterdir()] == [".machine"]


def test_kernels_with_different_texts_have_separate_files(folder: Path) -> None:
    assert (scale(2.0)(3.0), scale(3.0)(3.0)) == (6.0, 9.0)
    assert len(list(folder.glob("*.machine"))) == 2


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: content[:0],
    "cut in its head": lambda content: content[:40],
    "cut": lambda content: content[: len(content) // 2],
    "one bit": lambda content: content[:-200] + bytes([content[-200] ^ 4]) + content[-199:],
    "another format": lambda content: b"x" + content[1:],
    "noise": lambda content: bytes(range(256)) * len(content),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_built_anew(folder: Path, compiling: list[str], damage: str) -> None:
    scale()
    path = file_in(folder)
    whole = path.read_bytes()
    path.write_bytes(DAMAGES[damage](whole))
    assert scale()(3.0) == 6.0
    assert compiling == ["scale"] * 2
    assert path.read_bytes() == whole


def test_a_stale_file_is_built_anew(folder: Path, compiling: list[str]) -> None:
    scale(2.0)
    old = file_in(folder)
    content = old.read_bytes()
    old.unlink()
    scale(3.0)
    file_in(folder).write_bytes(content)
    assert scale(3.0)(3.0) == 9.0
    assert len(compiling) == 3


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have owners")
@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777])
def test_a_folder_that_others_may_write_to_is_not_used(
    folder: Path, compiling: list[str], caplog: pytest.LogCaptureFixture, mode: int
) -> None:
    scale()
    folder.chmod(mode)
    before = file_in(folder).read_bytes()
    store._is_refused.cache_clear()
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        assert scale()(3.0) == scale()(3.0) == 6.0
    assert compiling == ["scale"] * 3
    (message,) = caplog.messages
    assert message.startswith(f"compiled kernels in {folder} are not used, for others may write to it (chmod")
    assert file_in(folder).read_bytes() == before


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have owners")
@pytest.mark.usefixtures("folder")
def test_a_folder_of_another_user_is_not_used(
    compiling: list[str], caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    scale()
    store._is_refused.cache_clear()
    mine = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: mine + 1)
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        assert scale()(3.0) == 6.0
    assert compiling == ["scale"] * 2
    (message,) = caplog.messages
    assert "belongs to another user" in message
    store._is_refused.cache_clear()


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="files have owners")
def test_a_file_that_others_may_write_to_is_built_anew(folder: Path, compiling: list[str]) -> None:
    scale()
    file_in(folder).chmod(0o666)
    assert scale()(3.0) == 6.0
    assert compiling == ["scale"] * 2
    assert file_in(folder).stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("kind", ["link", "fifo", "folder"])
def test_a_link_fifo_or_folder_in_place_of_the_file_is_not_read(
    folder: Path, compiling: list[str], kind: str, tmp_path: Path
) -> None:
    scale()
    path = file_in(folder)
    if kind == "link":
        path.rename(tmp_path / "elsewhere")
        path.symlink_to(tmp_path / "elsewhere")
    else:
        path.unlink()
        os.mkfifo(path) if kind == "fifo" else path.mkdir()
    assert scale()(3.0) == 6.0
    assert compiling == ["scale"] * 2


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT])
def test_an_unwritable_folder_disables_the_cache_but_not_the_kernel(
    folder: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def full(*_: Any) -> None:
        raise OSError(code, os.strerror(code))

    store._warn_once.cache_clear()
    monkeypatch.setattr(os, "fsync", full)
    with caplog.at_level(logging.WARNING, logger="hydrostate"):
        assert scale(7.0)(2.0) == scale(8.0)(2.0) - 2.0 == 14.0
    sentence = f"kernels cannot be cached in {folder} ({os.strerror(code)}); compiling for this run only"
    assert caplog.messages == [sentence]
    assert list(folder.iterdir()) == []


def test_processes_that_compile_at_once_leave_one_whole_file(folder: Path) -> None:
    program = "from tests.plant.compiled.native.test_store import scale\nprint(scale(5.0)(2.0))"
    command = [sys.executable, "-c", program]
    root = Path(__file__).parents[4]
    environment = {**os.environ, "HYDROSTATE_CACHE": str(folder), "PYTHONPATH": str(root)}
    running = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) for _ in range(2)]  # noqa: S603  our own
    assert [process.communicate()[0].split() for process in running] == [[b"10.0"]] * 2
    assert [path.suffix for path in folder.iterdir()] == [".machine"]
