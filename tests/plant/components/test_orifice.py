"""Throttles: small drops see a laminar path, large ones an orifice, and the resistance of an orifice is quadratic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.orifice import effective_area, laminar_orifice_flow, orifice_constant, orifice_friction

ORIFICE = float(orifice_constant(2.57e-3, 6.895e5))
DROPS = st.floats(-4e6, 4e6)


@given(DROPS, st.just(0.0) | st.floats(1e-30, 1e-6))
def test_the_two_drops_add_up(drop: float, conductance: float) -> None:
    flow = float(laminar_orifice_flow(drop, conductance, ORIFICE))
    assert flow == -float(laminar_orifice_flow(-drop, conductance, ORIFICE))
    if conductance > 0.0:
        parts = flow / conductance + np.sign(flow) * (flow / ORIFICE) ** 2
        assert parts == pytest.approx(drop, rel=1e-12)


@given(DROPS, st.floats(0.0, 1.0))
def test_no_path_passes_more_than_the_rated_orifice(drop: float, conductance: float) -> None:
    assert abs(float(laminar_orifice_flow(drop, conductance, ORIFICE))) <= ORIFICE * abs(drop) ** 0.5 * (1.0 + 1e-12)


def test_a_narrow_path_is_linear_in_pressure() -> None:
    ratio = float(laminar_orifice_flow(3e6, 6e-11, ORIFICE)) / float(laminar_orifice_flow(1e6, 6e-11, ORIFICE))
    assert ratio == pytest.approx(3.0, rel=1e-3)


def test_a_wide_path_is_an_orifice() -> None:
    ratio = float(laminar_orifice_flow(3e6, 1e-2, ORIFICE)) / float(laminar_orifice_flow(1e6, 1e-2, ORIFICE))
    assert ratio == pytest.approx(3.0**0.5, rel=1e-3)


@given(st.floats(1e2, 1e11))
def test_area_and_load_are_inverse(friction: float) -> None:
    area = float(effective_area(860.0, 1.52e-3, friction))
    assert orifice_friction(860.0, 1.52e-3, area) == pytest.approx(friction, rel=1e-12)


def test_the_load_is_the_pressure_of_the_piston_flow_on_the_piston() -> None:
    area, velocity = 1e-6, 0.03
    pressure = 0.5 * 860.0 * (1.52e-3 * velocity / area) ** 2
    assert orifice_friction(860.0, 1.52e-3, area) * velocity**2 == pytest.approx(1.52e-3 * pressure, rel=1e-12)
