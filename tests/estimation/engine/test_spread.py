"""A covariance that is propagated from waypoint to waypoint is ``F P F'``, whatever the piston and its valve do."""

import numpy as np
import pytest

from estimation.engine.kalman import belief_symbols, next_state, scaled_step
from estimation.engine.spread import spread, waypoints_of
from estimation.filters.ekf import ekf_predict
from estimation.models.eha_forms import ACCELERATION_FORM, PRESSURE_FORM
from plant.compiled.expression import symbol
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_names, parameter_row
from tests.kernels import computed

STATES = {
    "slides": (3.0, 2.0, 6.0, 2.07),
    "slides back": (-3.0, -2.5, -6.0, 1.1),
    "sticks": (1.0, 0.0, 1.0, 2.07),
    "comes to rest": (1.0, 0.001, 0.5, 2.07),
    "relieves": (1.0, 4.0, 40.0, 5.0),
    "relieves, held fast": (1.0, 0.0, -40.0, 2.0),
}


def given(state: tuple[float, ...]) -> dict[str, float]:
    p = EhaParameters(load_stiffness=2e4, load_force=30.0, friction_coulomb=5000.0 if state[1] == 0.0 else 436.0)
    values = dict(zip(parameter_names(EhaParameters), parameter_row(p).tolist(), strict=True))
    return (
        values | {f"z{i}": z for i, z in enumerate(state)} | {"a0": 90.0, "b0": 95.0, "j": 0.0, "share": 1.0, "h": 1e-4}
    )


@pytest.mark.parametrize("state", STATES.values(), ids=STATES)
def test_the_covariance_through_waypoints_equals_the_one_by_the_jacobian(state: tuple[float, ...]) -> None:
    z, P = belief_symbols(PRESSURE_FORM)
    mean, F = scaled_step(PRESSURE_FORM)
    root = np.random.default_rng(3).normal(size=(4, 4))
    covariance = root @ root.T
    values = given(state) | {f"P{i}_{j}": float(covariance[i, j]) for i, j in P}
    carried = computed({f"{i}{j}": value for (i, j), value in spread(mean, z, P).items()}, **values)
    slopes = computed({f"{i}{j}": F[i][j] for i in range(4) for j in range(4)}, **values)
    jacobian = np.array([[slopes[f"{i}{j}"] for j in range(4)] for i in range(4)])
    wanted = jacobian @ covariance @ jacobian.T
    size = np.sqrt(np.diag(wanted))
    for i, j in P:
        assert carried[f"{i}{j}"] == pytest.approx(wanted[i, j], abs=1e-12 * float(size[i] * size[j]))


def test_the_pressure_form_names_waypoints_and_the_acceleration_form_none() -> None:
    points, none = (waypoints_of(next_state(m, belief_symbols(m)[0])) for m in (PRESSURE_FORM, ACCELERATION_FORM))
    assert (len(points), none) == (9, [])


def test_a_prediction_adds_process_noise_to_the_variances_alone() -> None:
    z, P = belief_symbols(PRESSURE_FORM)
    before = spread(next_state(PRESSURE_FORM, z), z, P)
    after = ekf_predict(PRESSURE_FORM)
    for i, j in P:
        noise = symbol(f"q{i}") * symbol("h")
        assert after[f"P{i}_{j}"] is (before[i, j] + noise if i == j else before[i, j])
