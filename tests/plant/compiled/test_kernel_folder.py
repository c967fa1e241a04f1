"""Tests of the folder in which compiled kernels are kept."""

from pathlib import Path

import pytest

from plant.compiled.kernel_folder import cache_folder


def test_an_environment_variable_sets_the_cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYDROSTATE_CACHE", str(tmp_path / "kernels"))
    assert cache_folder() == tmp_path / "kernels"
    monkeypatch.delenv("HYDROSTATE_CACHE")
    assert cache_folder().name == "hydrostate"
