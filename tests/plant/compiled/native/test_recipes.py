"""A kernel's text is not written again if everything that determines it is unchanged."""

import os
import time
from pathlib import Path

import pytest

from plant.compiled.native import load, recipes
from plant.compiled.native.load import load_native
from plant.compiled.native.recipes import identity
from plant.compiled.native.signature import signature
from plant.components.valves import pumped_flow
from plant.eha.model import EhaParameters

TEXT = "def scale(x):\n    return 3.0 * x\n"


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The texts that were written."""
    monkeypatch.setenv("HYDROSTATE_CACHE", str(tmp_path))
    return []


def scale(written: list[str], made_of: object) -> float:
    """Load and call the kernel as a new process would."""
    load._LOADED.clear()

    def text() -> str:
        written.append(TEXT)
        return TEXT

    return load_native("scale", text, {"scale": signature("x : float")}, made_of).scale(2.0)


def test_a_kernels_text_is_written_once_if_sources_are_trusted(
    written: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recipes, "_trusted", [True])
    assert [scale(written, (pumped_flow, 1)) for _ in range(3)] == [6.0] * 3
    assert len(written) == 1
    scale(written, (pumped_flow, 2))
    assert len(written) == 2


def test_a_kernels_text_is_written_again_if_a_source_has_changed(
    written: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recipes, "_trusted", [True])
    scale(written, 1)
    monkeypatch.setattr(recipes, "_sources", lambda: "changed")
    scale(written, 1)
    assert len(written) == 2


def test_a_rewritten_source_is_detected_even_with_the_same_size_and_modification_time(tmp_path: Path) -> None:
    source = tmp_path / "package" / "one.py"
    source.parent.mkdir()
    source.write_text("A = 1")
    os.utime(source, (1.0, 1.0))
    before = [*recipes._stamps(str(tmp_path))]
    assert before == [*recipes._stamps(str(tmp_path))]
    time.sleep(0.02)  # a file system's clock may be as coarse as this
    source.write_text("A = 2")
    os.utime(source, (1.0, 1.0))
    assert before != [*recipes._stamps(str(tmp_path))]
    assert len(before) == 1


def test_a_kernels_text_is_written_at_every_load_if_sources_are_not_trusted(written: list[str]) -> None:
    assert [scale(written, 1), scale(written, 1)] == [6.0, 6.0]
    assert len(written) == 2


def test_a_kernels_text_is_written_again_if_its_cached_file_is_damaged(
    written: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recipes, "_trusted", [True])
    scale(written, 1)
    for path in tmp_path.glob("hydrostate_scale_[!r]*"):
        path.write_bytes(b"damaged")
    assert scale(written, 1) == 6.0
    assert len(written) == 2


def test_things_not_determined_by_the_packages_have_no_identity() -> None:
    assert identity((EhaParameters, pumped_flow)) == (
        "(plant.eha.model:EhaParameters, plant.components.valves:pumped_flow)"
    )
    assert identity(EhaParameters()) != identity(EhaParameters(piston_area=2e-3))
    for unknown in (lambda x: x, Path("x"), test_things_not_determined_by_the_packages_have_no_identity, [object()]):
        assert identity(unknown) is None
