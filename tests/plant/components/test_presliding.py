"""The bristle settles to the steady-state law, equation 5.10, and never returns more energy than was put in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from faults.conditions import FRICTION_TABLE, Level
from plant.components.friction import quadratic_friction
from plant.components.presliding import bristle_rate, presliding_friction

DISPLACEMENT, MASS, DAMPING = 2e-5, 7.376, 0.2
ROWS = {
    level: (row.friction_quadratic, row.friction_linear, row.friction_coulomb) for level, row in FRICTION_TABLE.items()
}
LEVELS = st.sampled_from(list(ROWS))
SPEEDS = st.floats(-0.5, 0.5)


def force(velocity: float, bristle: float, row: tuple[float, float, float]) -> float:
    rate = bristle_rate(velocity, bristle, row[1], row[2], DISPLACEMENT)
    return float(presliding_friction(velocity, bristle, rate, row, DISPLACEMENT, MASS, DAMPING))


@given(SPEEDS.filter(lambda v: abs(v) > 1e-9), LEVELS)
def test_the_settled_bristle_gives_the_steady_state_law(velocity: float, level: Level) -> None:
    a1, a2, a3 = row = ROWS[level]
    direction = np.sign(velocity)
    settled = direction / (1.0 + max(-a2, 0.0) * abs(velocity) / a3)
    assert float(bristle_rate(velocity, settled, a2, a3, DISPLACEMENT)) == pytest.approx(
        0.0, abs=1e-12 * abs(velocity) / DISPLACEMENT
    )
    wanted = quadratic_friction(velocity, direction, a1, a2, a3)
    assert force(velocity, settled, row) == pytest.approx(float(wanted), rel=1e-9)


@given(SPEEDS, st.floats(-1.0, 1.0), LEVELS)
def test_friction_takes_at_least_what_the_bristle_stores(velocity: float, bristle: float, level: Level) -> None:
    row = ROWS[level]
    rate = float(bristle_rate(velocity, bristle, row[1], row[2], DISPLACEMENT))
    stored = row[2] * DISPLACEMENT * bristle * rate
    taken = force(velocity, bristle, row) * velocity
    assert taken - stored >= -1e-12 * (abs(taken) + abs(stored))


@given(SPEEDS, LEVELS)
def test_the_bristle_never_deflects_past_breakaway(velocity: float, level: Level) -> None:
    _, a2, a3 = ROWS[level]
    assert float(bristle_rate(velocity, 1.0, a2, a3, DISPLACEMENT)) <= 0.0
    assert float(bristle_rate(velocity, -1.0, a2, a3, DISPLACEMENT)) >= 0.0


def test_without_coulomb_friction_only_the_sliding_part_is_left() -> None:
    assert force(0.1, 0.5, (6e4, 2e3, 0.0)) == pytest.approx(2e3 * 0.1 + 6e4 * 0.01, rel=1e-12)


@pytest.mark.parametrize("a3", [1.5, 0.5])
@pytest.mark.parametrize("a2", [0.5, 0.0, -0.5])
def test_coefficients_of_order_one_also_give_the_steady_state_law(a2: float, a3: float) -> None:
    a1, velocity = 2.0, 0.7
    settled = 1.0 / (1.0 + max(-a2, 0.0) * velocity / a3)
    wanted = a3 + a2 * velocity + a1 * velocity**2
    assert force(velocity, settled, (a1, a2, a3)) == pytest.approx(wanted, rel=1e-12)


def test_the_mass_on_its_bristle_has_the_given_damping_ratio() -> None:
    a3 = ROWS["none"][2]
    stiffness, speed = a3 / DISPLACEMENT, 1e-9
    rate = bristle_rate(speed, 0.0, 0.0, a3, DISPLACEMENT)
    damping = float(presliding_friction(speed, 0.0, rate, (0.0, 0.0, a3), DISPLACEMENT, MASS, DAMPING)) / speed
    assert damping == pytest.approx(2.0 * DAMPING * (stiffness * MASS) ** 0.5, rel=1e-6)


def test_the_damping_fades_as_the_bristle_slides() -> None:
    a3, speed = ROWS["none"][2], 0.2
    rate = 0.1 / DISPLACEMENT
    damping = 2.0 * DAMPING * (a3 / DISPLACEMENT * MASS) ** 0.5
    force_of_rate = float(presliding_friction(speed, 0.0, rate, (0.0, 0.0, a3), DISPLACEMENT, MASS, DAMPING))
    assert force_of_rate == pytest.approx(0.1 * damping / (1.0 + damping * speed / a3), rel=1e-12)
