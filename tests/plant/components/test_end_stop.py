"""The end stops of the stroke push back and dissipate energy."""

from hypothesis import given
from hypothesis import strategies as st

from plant.components.end_stop import end_stop_force


@given(st.floats(-0.125, 0.125), st.floats(-1.0, 1.0))
def test_there_is_no_force_within_the_stroke(position: float, velocity: float) -> None:
    assert float(end_stop_force(position, velocity, 0.125, 1e8, 20.0)) == 0.0


@given(st.floats(1e-6, 1e-3), st.floats(-1.0, 1.0))
def test_the_two_ends_mirror_each_other(depth: float, velocity: float) -> None:
    right = float(end_stop_force(0.125 + depth, velocity, 0.125, 1e8, 20.0))
    left = float(end_stop_force(-0.125 - depth, -velocity, 0.125, 1e8, 20.0))
    assert right == -left


@given(st.floats(-0.126, 0.126), st.floats(-1.0, 1.0))
def test_end_stop_damping_never_adds_energy(position: float, velocity: float) -> None:
    damped = float(end_stop_force(position, velocity, 0.125, 1e8, 20.0))
    spring = float(end_stop_force(position, 0.0, 0.125, 1e8, 20.0))
    assert (damped - spring) * velocity <= 0.0
