"""A figure that cannot be written gives an error in one sentence, like a page."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from experiments.page.figure_files import write_png
from plant.errors import HydrostateError


def test_a_figure_that_cannot_be_written_is_refused_by_its_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    with pytest.raises(HydrostateError, match=r"--figure .*f\.png: cannot be written: No space left on device"):
        write_png(Figure, tmp_path / "f.png")
    assert list(tmp_path.iterdir()) == []
