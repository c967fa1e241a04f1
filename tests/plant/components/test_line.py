"""The oil in a line settles where viscous and minor losses balance the pressure, and starts with its inertance."""

import numpy as np
import pytest

from plant.components.line import line_flow_rate, reynolds_number

LENGTH, AREA, DENSITY, VISCOSITY = 0.462, 3.85e-5, 850.0, 0.02
FLOW = 2.67e-5
VELOCITY = FLOW / AREA


def rate(drop: float, flow: float, minor: float) -> float:
    return float(line_flow_rate(drop, flow, LENGTH, AREA, DENSITY, VISCOSITY, minor))


@pytest.mark.parametrize("minor", [0.0, 2.3, 40.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_steady_flow_needs_the_hagen_poiseuille_drop_plus_xi_times_the_dynamic_pressure(
    minor: float, direction: float
) -> None:
    radius = np.sqrt(AREA / np.pi)
    laminar = 8.0 * VISCOSITY * LENGTH * FLOW / (np.pi * radius**4)
    drop = direction * (laminar + minor * 0.5 * DENSITY * VELOCITY**2)
    assert rate(drop, direction * FLOW, minor) == pytest.approx(0.0, abs=1e-12)


def test_oil_at_rest_accelerates_by_newtons_second_law() -> None:
    mass, force = DENSITY * LENGTH * AREA, 1e5 * AREA
    assert rate(1e5, 0.0, 2.3) == pytest.approx(AREA * force / mass)


def test_reynolds_number_is_speed_times_diameter_over_kinematic_viscosity() -> None:
    diameter = 2.0 * np.sqrt(AREA / np.pi)
    wanted = VELOCITY * diameter / (VISCOSITY / DENSITY)
    assert reynolds_number(-FLOW, AREA, DENSITY, VISCOSITY) == pytest.approx(wanted)
