"""The page on own classes runs, block by block; its assertions check its claims."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).resolve().parents[3] / "docs" / "own-classes.md"


def test_every_code_block_of_the_page_runs_and_its_assertions_hold(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra learn)")
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert len(blocks) > 4
    names: dict[str, object] = {}
    with np.errstate(all="warn"):
        for block in blocks:
            exec(compile(block, str(PAGE), "exec"), names)  # noqa: S102 -- our own page
    assert "balanced accuracy" in capsys.readouterr().out
