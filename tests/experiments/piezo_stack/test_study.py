"""The stack's study runs each operating point once."""

from collections.abc import Iterator, Sequence

import pytest

from experiments.piezo_stack import flow
from experiments.piezo_stack.study import PIEZO_STACK
from experiments.running.progress import without_progress
from tests.experiments.conftest import STACK


def test_an_operating_point_of_several_figures_is_run_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[flow.OperatingPoint] = []

    def sweep(_: object, points: Sequence[flow.OperatingPoint]) -> Iterator[dict[str, float]]:
        asked.extend(points)
        raise InterruptedError
        yield {}

    monkeypatch.setattr(flow, "sweep", sweep)
    with pytest.raises(InterruptedError):
        PIEZO_STACK.find(STACK, without_progress)
    assert len(set(asked)) == len(asked) > 100
