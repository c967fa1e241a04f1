"""A package's names are imported when they are first used, and an unknown name is an attribute error."""

from pathlib import Path

import pytest

from plant.lazy import lazy_getattr


def test_only_names_imported_with_as_are_exported(tmp_path: Path) -> None:
    file = tmp_path / "face.py"
    text = "from math import pi as number\nfrom math import tau as tau\nfrom math import e\n"
    file.write_text(f"from typing import TYPE_CHECKING\n{text}")
    found = lazy_getattr("face", str(file))
    assert found("__all__") == ["number", "tau"]
    assert 2.0 * found("number") == found("tau")
    for name in ("e", "nowhere"):
        with pytest.raises(AttributeError, match=f"module 'face' has no attribute '{name}'"):
            found(name)
