"""A linear process model, on which every filter has a textbook answer."""

from collections.abc import Mapping

import numpy as np
import pytest

from estimation.models.eha_forms import undetermined_volume
from estimation.models.model import ProcessModel, StateVariable
from plant.arrays import Array
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters, EhaValues


def _step(state: tuple[Scalar, ...], speeds: tuple[Scalar, Scalar], p: EhaValues, h: Scalar) -> tuple[Scalar, ...]:
    """The step of a mass on a damper, pushed by the mean motor speed; a disturbance force is the third state."""
    del p
    x, v, force = state
    push = 0.01 * (speeds[0] + speeds[1])
    return x + h * v, v + h * (push + force - 3.0 * v), force


def _observe(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0], "velocity_m_s": state[1] + 0.25 * state[2]}


LINEAR = ProcessModel(
    "linear",
    (
        StateVariable("position_m", "m", 1e-3, 1e-8),
        StateVariable("velocity_m_s", "m/s", 1e-2, 1e-4),
        StateVariable("force_n", "N", 10.0, 1e-2),
    ),
    _step,
    _observe,
    2.5e-4,
    parameters=EhaParameters,
    opening=undetermined_volume,
)


@pytest.fixture(scope="session")
def linear() -> ProcessModel:
    return LINEAR


@pytest.fixture(scope="session")
def transition() -> Array:
    """Return F of the linear model for a step of 10 ms, in SI."""
    return np.array([[1.0, 0.01, 0.0], [0.0, 0.97, 0.01], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="session")
def observation() -> Array:
    """Return H of the linear model, in SI."""
    return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.25]])
