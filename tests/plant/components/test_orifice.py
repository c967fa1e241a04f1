"""Throttles: small drops see a laminar path, large ones an orifice, and the resistance of an orifice is quadratic."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.components.orifice import effective_area, laminar_orifice_flow, orifice_constant, orifice_friction

ORIFICE = float(orifice_constant(2.57e-3, 6.895e5))
DROPS = st.floats(-4e6, 4e6)


@given(DROPS, st.just(0.0) | st.floats(1e-30, 1e-6))
def test_laminar_and_orifice_drops_add_up_to_the_total_drop(drop: float, conductance: float) -> None:
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


def test_flow_through_a_wide_path_rises_with_the_square_root_of_pressure() -> None:
    ratio = float(laminar_orifice_flow(3e6, 1e-2, ORIFICE)) / float(laminar_orifice_flow(1e6, 1e-2, ORIFICE))
    assert ratio == pytest.approx(3.0**0.5, rel=1e-3)


@given(st.floats(1e2, 1e11))
def test_effective_area_is_the_inverse_of_orifice_friction(friction: float) -> None:
    area = float(effective_area(860.0, 1.52e-3, friction))
    assert orifice_friction(860.0, 1.52e-3, area) == pytest.approx(friction, rel=1e-12)


def test_orifice_friction_is_the_force_of_the_orifices_pressure_drop_on_the_piston() -> None:
    area, velocity = 1e-6, 0.03
    pressure = 0.5 * 860.0 * (1.52e-3 * velocity / area) ** 2
    assert orifice_friction(860.0, 1.52e-3, area) * velocity**2 == pytest.approx(1.52e-3 * pressure, rel=1e-12)
