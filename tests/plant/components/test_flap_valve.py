"""The check valve in its port: openings between leak and lift, and exact limits of the implicit step."""

import numpy as np
import pytest

from plant.components.flap_valve import late_share, opening_target, orifice_drag, port_flow_after

INERTANCE, RESISTANCE = 2.461e6, 6e8


@pytest.mark.parametrize(("drop", "wanted"), [(-1e5, 0.1), (200.0, 0.1), (500.0, 0.5), (800.0, 0.9), (1e6, 0.9)])
def test_a_valve_opens_between_its_leak_and_its_lift(drop: float, wanted: float) -> None:
    assert float(opening_target(drop, 0.1, 0.9, 200.0, 600.0)) == pytest.approx(wanted)


def test_halving_the_opening_quadruples_the_drag() -> None:
    assert orifice_drag(0.5, 2e-6, 0.65, 998.0) == pytest.approx(4.0 * orifice_drag(1.0, 2e-6, 0.65, 998.0))


def test_long_steps_reach_the_flow_at_which_drop_and_losses_balance() -> None:
    drag = orifice_drag(0.3, 1.894e-6, 0.65, 998.0)
    flow = 0.0
    for _ in range(200):
        flow = float(port_flow_after(flow, 5e3, drag, RESISTANCE, INERTANCE, 1e-2))
    assert RESISTANCE * flow + drag * flow**2 == pytest.approx(5e3, rel=1e-6)


def test_the_port_flow_step_is_of_second_order() -> None:
    drag = orifice_drag(0.5, 1.894e-6, 0.65, 998.0)

    def after(steps: int) -> float:
        flow = 1e-6
        for _ in range(steps):
            flow = float(port_flow_after(flow, 2e4, drag, RESISTANCE, INERTANCE, 2e-3 / steps))
        return flow

    true = after(20000)
    assert abs(after(20) - true) / abs(after(40) - true) == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("flow", [-4e-6, 4e-6])
def test_a_shut_port_stops_its_flow_within_one_step(flow: float) -> None:
    drag = orifice_drag(1e-6, 1.894e-6, 0.65, 998.0)
    assert abs(float(port_flow_after(flow, 0.0, drag, RESISTANCE, INERTANCE, 1e-5))) < 1e-3 * abs(flow)


def test_backward_port_flow_mirrors_forward_flow() -> None:
    forth, back = (float(port_flow_after(s * 1e-6, s * 3e3, 3e14, RESISTANCE, INERTANCE, 1e-5)) for s in (1.0, -1.0))
    assert back == -forth


def test_late_share_makes_the_step_stable_at_every_rate_of_decay() -> None:
    decay = np.logspace(-6, 9, 200)
    late = late_share(decay)
    left = (1.0 - (1.0 - late) * decay) / (1.0 + late * decay)
    assert np.all(np.abs(left) < 1.0)
