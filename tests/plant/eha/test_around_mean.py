"""The break frequency of small motion agrees with the frequency response of a system of the same equations."""

from dataclasses import replace

import numpy as np
import pytest

from plant.eha.around_mean import break_frequency_about
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state

RIG = EhaParameters()


@pytest.mark.parametrize("speed", [40.0, 125.66, 200.0])
@pytest.mark.parametrize("changed", [{}, {"leakage_coefficient": 6e-11, "bulk_modulus": 1e8}, {"moving_mass": 60.0}])
def test_at_the_break_frequency_the_gain_is_down_by_the_root_of_two(speed: float, changed: dict[str, float]) -> None:
    p = replace(RIG, **changed)
    velocity, _ = steady_state(speed, p)
    rub = p.friction_linear + 2.0 * p.friction_quadratic * velocity
    oil = p.bulk_modulus / p.chamber_volume
    # velocity and differential pressure as driven by flow: equations 5.8 and 5.9 without their constant terms
    system = np.array([[-rub, p.piston_area], [-oil * p.piston_area, -oil * p.leakage_coefficient]])
    system[0] /= p.moving_mass

    def gain(hertz: float) -> float:
        at = 2j * np.pi * hertz * np.eye(2) - system
        return abs(np.linalg.solve(at, [0.0, oil])[0])

    assert gain(break_frequency_about(speed, p)) == pytest.approx(gain(0.0) / 2.0**0.5, rel=1e-9)
