"""Machine code stays small: loops are not unrolled, because their bodies already work on several numbers at a time."""

import pytest

from plant.compiled.native import machine
from plant.compiled.native.program import Module
from plant.compiled.native.signature import signature

TEXT = """
def roots(values):
    for k in range(6):
        values[k] = math.sqrt(values[k]) / (1.0 + values[k])
"""


def test_loops_are_not_unrolled(monkeypatch: pytest.MonkeyPatch) -> None:
    module = Module(TEXT)
    module.enter("roots", tuple(one.kind for one in signature("values : ndarray, shape (n,)")))
    rolled = machine.assemble(module.ir())
    monkeypatch.setattr(machine, "UNROLL_LOOPS", True)
    assert len(rolled) < len(machine.assemble(module.ir()))
