"""Figure 12 left out: a calibration without runs at 100 V approaches its targets, and then predicts 100 V."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from experiments.piezo_stack import left_out
from experiments.piezo_stack.flow import HIGH_VOLTAGE, OperatingPoint
from plant.piezo_stack.parameters import PiezoStackParameters

RIG = PiezoStackParameters()

Case = tuple[PiezoStackParameters, OperatingPoint]


def stand_in(cases: Sequence[Case]) -> Iterator[dict[str, float]]:
    """Yield flows from a formula in the freed values, with their peak at 275 Hz times line area over the rig's."""
    for p, at in cases:
        best = 275.0 * p.line_area / RIG.line_area
        size = 1.6 * (p.piston_area / RIG.piston_area) * (at.voltage_v / HIGH_VOLTAGE) * (1.0 - 0.019 * at.load_kg)
        yield {"flow_m3_s": size / 60000.0 * (1.0 - ((at.frequency_hz - best) / 400.0) ** 2)}


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return the voltages of all runs; the list grows with each run."""
    voltages: list[float] = []

    def noted(cases: Sequence[Case]) -> Iterator[dict[str, float]]:
        voltages.extend(at.voltage_v for _, at in cases)
        yield from stand_in(cases)

    monkeypatch.setattr(left_out, "rows_of", noted)
    return voltages


def test_the_calibration_uses_only_runs_at_the_higher_voltage_and_recovers_the_rig(seen: list[float]) -> None:
    start = left_out.with_factors(RIG, np.where(np.arange(len(left_out.FREED)) == 0, 0.3, 0.2))
    found = left_out.calibrate(start)
    assert set(seen) == {HIGH_VOLTAGE}
    assert found.piston_area == pytest.approx(RIG.piston_area, rel=0.05)
    assert found.line_area == pytest.approx(RIG.line_area, rel=0.05)


def test_figure_12_is_predicted_by_rigs_calibrated_without_it(seen: list[float]) -> None:
    table = left_out.figure_12_left_out(RIG, 1, 2)
    assert table["ratio"].tolist() == pytest.approx([100.0 / 140.0] * 2)
    assert (abs(table["best_weak_hz"] - 275.0) <= 12.5).all()
    assert seen.count(100.0) == 2 * 18


def test_parameters_of_one_group_change_by_one_factor() -> None:
    one = left_out.with_factors(RIG, np.log(np.full(len(left_out.FREED), 1.1)))
    for name in ("outlet_reed_stiffness", "inlet_reed_stiffness", "return_length", "air_fraction"):
        assert getattr(one, name) == pytest.approx(1.1 * getattr(RIG, name))
    assert one.stack_stiffness == RIG.stack_stiffness
