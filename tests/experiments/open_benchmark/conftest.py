"""Logs of two seconds instead of ten and twenty."""

from dataclasses import replace

import pytest

from experiments.open_benchmark import kinds, rig_kinds
from experiments.open_benchmark.draws import draw_plain


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (kinds, rig_kinds):
        monkeypatch.setattr(module, "draw_plain", lambda *given: replace(draw_plain(*given), duration=2.0))
