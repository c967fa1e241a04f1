"""The limits for a circuit's distance are equally improbable for all fitted coordinates and for two severities."""

import pytest
from scipy.special import chdtrc

from faults.diagnosis.circuits import out_of_model
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.out_of_model import FARTHEST_BESIDE, FARTHEST_OUT, reasons_against
from faults.notes import AgainstCode
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks, classes

PLACED = {AgainstCode.OUTSIDE_CONDITIONS, AgainstCode.BETWEEN_CONDITIONS}


def test_the_limits_of_severities_and_other_coordinates_are_equally_improbable() -> None:
    others = len(COORDINATES) - 2
    assert chdtrc(2, 2.0 * FARTHEST_OUT) == pytest.approx(1.0 / 1100.0, rel=0.01)
    assert chdtrc(others, 2.0 * FARTHEST_BESIDE) == pytest.approx(1.0 / 1100.0, rel=0.05)


@pytest.mark.parametrize(
    ("between", "pressure", "said"),
    [
        (-FARTHEST_OUT + 0.1, True, AgainstCode.BETWEEN_CONDITIONS),
        (-FARTHEST_OUT - 0.1, True, None),
        (-FARTHEST_BESIDE + 0.1, True, None),
        (-FARTHEST_BESIDE - 0.1, True, AgainstCode.OUTSIDE_CONDITIONS),
        (-FARTHEST_OUT - 0.1, False, AgainstCode.OUTSIDE_CONDITIONS),
    ],
)
def test_the_limit_for_a_circuit_off_all_severities_is_wider_with_pressure(
    monkeypatch: pytest.MonkeyPatch, between: float, said: AgainstCode | None, *, pressure: bool
) -> None:
    monkeypatch.setattr(out_of_model, "_nearest_severity", lambda *_: (0.5, 0.0, between))
    log: Blocks = blocks(pressure=pressure)
    found = reasons_against(log, classes(pressure=pressure), between - 3.0, ACTUATOR)
    assert [note.code for note in found if note.code in PLACED] == ([] if said is None else [said])
