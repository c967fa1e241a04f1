"""The 4/3 valve: which ports each spool position connects, and its implicit return flow."""

import pytest

from plant.components.directional_valve import (
    SHUT_OPENING,
    fed_pressure,
    pressure_after_return,
    return_flow,
    tank_openings,
)


@pytest.mark.parametrize(
    ("spool", "fed", "openings"),
    [(1.0, 5.0, (SHUT_OPENING, 1.0)), (0.0, 0.0, (SHUT_OPENING, SHUT_OPENING)), (-1.0, 2.0, (1.0, SHUT_OPENING))],
)
def test_the_side_that_is_not_fed_is_connected_to_tank(spool: float, fed: float, openings: tuple[float, float]) -> None:
    assert float(fed_pressure(spool, 5.0, 2.0)) == fed
    assert tuple(float(x) for x in tank_openings(spool)) == openings


@pytest.mark.parametrize("pressure", [3600.0, -900.0])
def test_implicit_steps_settle_at_the_pressure_that_returns_the_inflow(pressure: float) -> None:
    inflow = return_flow(pressure, 3e-8)
    found = 0.0
    for _ in range(3000):
        found = float(pressure_after_return(found, float(inflow), 4e-13, 3e-8, 1e-5))
    assert found == pytest.approx(pressure, rel=1e-6)


def test_a_side_without_inflow_settles_at_tank_pressure() -> None:
    pressure = 5e4
    for _ in range(3000):
        pressure = float(pressure_after_return(pressure, 0.0, 4e-13, 3e-8, 1e-5))
    assert 0.0 <= pressure < 1.0
