import numpy as np
import pytest

from plant.components.gas_compliance import compliant_oil_pressure
from plant.components.line import line_flow_rate
from plant.components.oil import oil_pressure, specific_volume
from plant.components.reed_valve import contact_force, reed_flow


def test_a_shut_reed_passes_nothing_and_an_open_one_passes_either_way() -> None:
    assert reed_flow(1e6, -1e-6, 0.0124, 0.62, 850.0, 1e4) == 0.0
    forward, back = (float(reed_flow(drop, 1e-4, 0.0124, 0.62, 850.0, 1e4)) for drop in (1e6, -1e6))
    assert forward == -back == pytest.approx(0.62 * 0.0124 * 1e-4 * np.sqrt(2e6 / 850.0), rel=1e-4)


def test_the_contact_force_is_continuous_at_first_touch() -> None:
    near, touching = (float(contact_force(depth, 1.0, 2e7, 300.0, 1e-6)) for depth in (-1e-12, 1e-12))
    assert near == 0.0
    assert touching == pytest.approx(0.0, abs=1e-3)


def test_losses_in_a_line_decelerate_flow_in_both_directions() -> None:
    forward, back = (line_flow_rate(0.0, flow, 0.4, 4e-5, 850.0, 0.02, 2.3) for flow in (2e-5, -2e-5))
    assert forward == -back < 0.0


def test_a_rigid_port_acts_as_a_chamber_and_a_compliant_one_takes_up_added_oil() -> None:
    oil = (1.4e9, 0.0137, 2e3)
    assert compliant_oil_pressure(1.01, 1.0, 0.0, 1e6, oil) == pytest.approx(oil_pressure(1.01, 1.0, *oil))
    compliance, volume = 2e-11, 2e-6
    filled = volume / specific_volume(1e6, *oil)
    assert compliant_oil_pressure(filled, volume, compliance, 1e6, oil) == pytest.approx(1e6)
    more = compliant_oil_pressure(filled + 1e-7, volume, compliance, 1e6, oil)
    assert more - 1e6 == pytest.approx(1e-7 / compliance, rel=0.02)
