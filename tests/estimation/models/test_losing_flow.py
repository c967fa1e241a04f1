"""The flow form with one more loss: it moves oil from one chamber to the other, and none if its size is zero."""

from types import SimpleNamespace

import pytest

from estimation.models.flow import fed_rates
from estimation.models.losing_flow import LOSING_FLOW_FORM, LosingFlowParameters
from plant.components.oil import ATMOSPHERE

STATE = (7e5, 2.5e5, 2.6e5)
PARAMETERS = vars(LosingFlowParameters(leakage_coefficient=5e-12))
DRIVES = ((50.0, 52.0), (0.01, 0.011), (2e-6, 4e-6), 1e-3)


def test_a_loss_lowers_the_loaded_chamber_and_raises_the_other() -> None:
    p = SimpleNamespace(**{**PARAMETERS, "loss_size": 3.0})
    with_loss = LOSING_FLOW_FORM.rates(STATE, DRIVES, p, 0.5)
    without = fed_rates(STATE, (*DRIVES[:2], DRIVES[3]), p, 0.5, by_mass=True)
    swept = p.piston_area * 0.0105
    fell = 3.0 * 3e-6 * (p.bulk_modulus - STATE[0] + ATMOSPHERE) / (2.0 * p.chamber_volume + swept)
    rose = 3.0 * 3e-6 * (p.bulk_modulus - STATE[1] + ATMOSPHERE) / (2.0 * p.chamber_volume - swept)
    assert without[0] - with_loss[0] == pytest.approx(fell)
    assert with_loss[1] - without[1] == pytest.approx(rose)
    assert with_loss[2] == without[2]


def test_a_loss_of_size_zero_changes_no_rates() -> None:
    p = SimpleNamespace(**PARAMETERS)
    without = fed_rates(STATE, (*DRIVES[:2], DRIVES[3]), p, 0.5, by_mass=True)
    assert LOSING_FLOW_FORM.rates(STATE, DRIVES, p, 0.5) == pytest.approx(without)
