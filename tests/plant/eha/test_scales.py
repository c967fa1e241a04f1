"""The scaling of leakage and friction to an actuator of another size."""

from dataclasses import replace

import pytest

from plant.eha.scales import PAPER_RIG, friction_scales, leakage_scales, with_valves_sized
from plant.eha.steady_state import steady_state


def test_the_paper_rig_has_scales_of_one() -> None:
    assert set({**leakage_scales(PAPER_RIG), **friction_scales(PAPER_RIG)}.values()) == {1.0}


def test_a_scaled_actuator_loses_the_same_share_of_velocity_and_adds_the_same_share_of_pressure() -> None:
    """The pump is three times as large and the area twice; friction is the same share of the force as in the paper."""
    area, flow = 2.0, 3.0
    p = replace(
        PAPER_RIG,
        pump_displacement=flow * PAPER_RIG.pump_displacement,
        piston_area=area * PAPER_RIG.piston_area,
        leakage_coefficient=flow * PAPER_RIG.leakage_coefficient,
        flow_bias=flow * PAPER_RIG.flow_bias,
        friction_quadratic=area * (area / flow) ** 2 * PAPER_RIG.friction_quadratic,
        friction_linear=area * (area / flow) * PAPER_RIG.friction_linear,
        friction_coulomb=area * PAPER_RIG.friction_coulomb,
    )
    assert leakage_scales(p) == pytest.approx({"leakage_coefficient": flow, "flow_bias": flow}, rel=1e-6)
    slower = area / flow  # the velocity that the pump's rated flow gives, in the paper over here
    expected = {
        "friction_quadratic": area * slower**2,
        "friction_linear": area * slower,
        "friction_coulomb": area,
    }
    assert friction_scales(p) == pytest.approx(expected, rel=1e-6)
    (_, own), (_, paper) = (steady_state(one.rated_speed, one) for one in (p, PAPER_RIG))
    assert own == pytest.approx(paper, rel=1e-6)


def test_valves_not_given_are_sized_for_the_pumps_flow() -> None:
    """A pump with 15 times the flow used to lose 5 bar in the paper's valves."""
    p = replace(PAPER_RIG, pump_displacement=15.0 * PAPER_RIG.pump_displacement)
    sized = with_valves_sized(p, ())
    assert sized.makeup_conductance == pytest.approx(15.0 * PAPER_RIG.makeup_conductance)
    assert sized.relief_conductance == pytest.approx(15.0 * PAPER_RIG.relief_conductance)
    own = replace(p, makeup_conductance=2e-9)
    assert with_valves_sized(own, ("makeup_conductance",)).makeup_conductance == 2e-9
