"""The uncertainty of friction at rated velocity from the unknown shape of the friction law."""

import numpy as np
import pytest

from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR, PointFit
from faults.diagnosis.circuits.friction_shape import (
    BEND_SPREAD,
    FADE_VELOCITIES,
    bend_covariance,
    bend_shifts,
    bent_information,
)
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
REST, QUADRATIC, RATED = (COORDINATES.index(f"friction_{name}") for name in ("rest", "quadratic", "rated"))
FRICTION = [REST, QUADRATIC, RATED]


def moved(fastest: float) -> np.ndarray:
    """Return the effect of bends on a healthy circuit that slides at up to a share of rated velocity."""
    velocity = fastest * ACTUATOR.rated * np.sin(np.linspace(0.0, 40.0, 400))
    one = Blocks(np.zeros(4001), 1e-3, 10, velocity, velocity, np.array([1e-4, 1e3]))
    outputs = np.stack([velocity, velocity], axis=1)
    return bend_shifts(
        PointFit(ACTUATOR.conditions[0], 0.0, np.eye(7), np.ones(2), outputs, np.zeros((7, 400, 2))), one, ACTUATOR
    )


def test_bends_shift_friction_like_a_parabola_fitted_to_the_velocities_reached() -> None:
    found = moved(0.3)
    speed = np.abs(0.3 * np.sin(np.linspace(0.0, 40.0, 400)))[9:]
    speed = np.append(speed[speed > 0.005], 0.0)
    rest, quadratic, rated = np.exp(ACTUATOR.conditions[0, FRICTION])
    for fades, one in zip(FADE_VELOCITIES, found.T, strict=True):
        bent, sloped, still = np.polyfit(speed, BEND_SPREAD * rest * np.exp(-speed / fades), 2)
        expected = np.array([still / rest, bent / quadratic, (still + sloped + bent) / rated])
        assert one[FRICTION] == pytest.approx(expected, rel=0.05, abs=1e-3)
    assert not np.any(np.delete(found, FRICTION, axis=0))


def test_a_slower_piston_leaves_friction_at_rated_velocity_more_uncertain() -> None:
    deviation = [float(np.linalg.norm(moved(fastest)[RATED])) for fastest in (1.0, 0.5, 0.3, 0.1)]
    assert np.all(np.diff(deviation) > 0.0)
    assert deviation[0] < 0.05 < 0.3 < deviation[2]


def test_information_with_bends_is_the_inverse_of_the_sum_of_both_covariances() -> None:
    information, by = np.diag([400.0, 300.0, 200.0, 90.0, 500.0, 60.0, 2.0]) + 8.0, moved(0.2)
    together = np.linalg.inv(np.linalg.inv(information) + by @ by.T)
    np.testing.assert_allclose(bent_information(information, by), together, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("fastest", [0.05, 0.3])
def test_bends_increase_only_the_variance_of_friction_and_by_less_than_the_prior(fastest: float) -> None:
    information = 1e4 * np.eye(7)
    added = bend_covariance(information, moved(fastest))
    assert np.min(np.linalg.eigvalsh(added)) > -1e-9
    assert np.all(np.diag(added)[FRICTION] > 0.0)
    assert np.all(np.diag(added) < np.diag(WEAK_PRIOR))
    assert np.allclose(np.delete(added, FRICTION, axis=0), 0.0, atol=1e-9)
