"""The process models are the plant's equations, and their compiled Jacobians equal the numerical ones (errata E4)."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from estimation.engine.linearised import compile_step
from estimation.models.eha_forms import (
    ACCELERATION_FORM,
    PRESSURE_FORM,
    acceleration_step,
    pressure_step,
    undetermined_volume,
    with_bulk_modulus,
)
from estimation.models.model import ProcessModel
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.eha.model import EhaParameters, lumped_step, reduced_derivative
from plant.solvers.steps import parameter_row

SPEEDS = (100.0, 102.0)
DRIVES = tuple(np.array([speed]) for speed in SPEEDS)
POINTS = {
    "sliding": {"velocity_m_s": 0.03, "acceleration_m_s2": 0.5, "differential_pressure_pa": 1e6},
    "sliding back": {"velocity_m_s": -0.02, "acceleration_m_s2": 2.0, "differential_pressure_pa": -2e6},
    "stuck": {"velocity_m_s": 0.0, "acceleration_m_s2": 0.0, "differential_pressure_pa": 5e4},
    "relieved": {"velocity_m_s": 0.03, "acceleration_m_s2": -1.0, "differential_pressure_pa": 4e6},
}


def state_of(model: ProcessModel, point: str, bulk_modulus: float = 1.5e8) -> np.ndarray:
    values = {"position_m": 0.01, "bulk_modulus_pa": bulk_modulus, **POINTS[point]}
    return np.array([values[state.name] for state in model.states])


def numerical_jacobian(model: ProcessModel, state: np.ndarray, p: EhaParameters, step: float) -> np.ndarray:
    """Return central differences of the readable step, in the filter's scaled units."""
    scale = np.array([variable.scale for variable in model.states])
    columns: list[np.ndarray] = []
    for i in range(model.width):
        e = 1e-5 * scale * np.eye(model.width)[i]
        above, below = (np.array(model.step(tuple(state + s * e), SPEEDS, p, step)) for s in (1.0, -1.0))
        columns.append((above - below) / (2e-5 * scale))
    return np.column_stack(columns)


# At rest the acceleration form has no Jacobian: sign(v) jumps there (errata E9).
CASES = [(PRESSURE_FORM, point) for point in POINTS]
CASES += [(ACCELERATION_FORM, point) for point in POINTS if point != "stuck"]


@pytest.mark.parametrize(("model", "point"), CASES, ids=[f"{model.name}, {point}" for model, point in CASES])
@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_the_analytic_jacobian_is_the_numerical_one(condition: Condition, model: ProcessModel, point: str) -> None:
    p, step = parameters_for(condition), 1e-4
    state = state_of(model, point)
    scale = np.array([variable.scale for variable in model.states])
    moved, slopes = compile_step(model).step(state / scale, *DRIVES, parameter_row(p), step)
    wanted = numerical_jacobian(model, state, p, step)
    np.testing.assert_allclose(slopes, wanted, rtol=1e-6, atol=1e-8 * np.max(np.abs(wanted)))
    direct = np.array(model.step(tuple(state), SPEEDS, p, step))
    np.testing.assert_allclose(moved * scale, direct, rtol=1e-12, atol=0.0)


def test_the_printed_jacobian_is_correct_with_erratum_4() -> None:
    p, T = EhaParameters(), 1e-4
    state = state_of(ACCELERATION_FORM, "sliding")
    _, v, a, beta = state
    scale = np.array([variable.scale for variable in ACCELERATION_FORM.states])
    phi = numerical_jacobian(ACCELERATION_FORM, state, p, T) * scale[:, None] / scale
    A, M, V0, L = p.piston_area, p.moving_mass, p.chamber_volume, p.leakage_coefficient
    a1, a2 = p.friction_quadratic, p.friction_linear
    assert phi[0, 1] == pytest.approx(T, rel=1e-9)
    assert phi[1, 2] == pytest.approx(T, rel=1e-9)
    assert phi[1, 0] == 0.0
    phi_32 = -T * (A**2 * beta / (M * V0) + L * beta / (M * V0) * (2.0 * a1 * v + a2) + 2.0 * a1 * a / M)
    assert phi[2, 1] == pytest.approx(phi_32, rel=1e-6)
    phi_33 = 1.0 - T * ((a2 + 2.0 * a1 * v) / M + beta * L / V0)
    assert phi[2, 2] == pytest.approx(phi_33, rel=1e-6)


@pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)
def test_each_form_makes_the_same_step_as_its_plant(condition: Condition) -> None:
    p = parameters_for(condition)
    x, v, dp, beta = state_of(PRESSURE_FORM, "sliding")
    as_plant = lumped_step((x, v, dp), SPEEDS, replace(p, bulk_modulus=beta), 1e-4)
    assert pressure_step((x, v, dp, beta), SPEEDS, p, 1e-4) == (*as_plant, beta)
    x, v, a, beta = state_of(ACCELERATION_FORM, "sliding")
    rates = reduced_derivative((x, v, a), SPEEDS[0], replace(p, bulk_modulus=beta))
    euler = tuple(y + 1e-4 * rate for y, rate in zip((x, v, a), rates, strict=True))
    assert acceleration_step((x, v, a, beta), SPEEDS, p, 1e-4) == (*euler, beta)


def test_the_piston_of_the_pressure_form_sticks_at_low_pressure() -> None:
    state = tuple(state_of(PRESSURE_FORM, "stuck"))
    assert float(pressure_step(state, (0.0, 0.0), EhaParameters(), 1e-4)[1]) == 0.0


def test_the_motion_of_a_stuck_piston_does_not_depend_on_bulk_modulus() -> None:
    p = EhaParameters()
    scale = np.array([variable.scale for variable in PRESSURE_FORM.states])
    state = state_of(PRESSURE_FORM, "stuck") / scale
    _, slopes = compile_step(PRESSURE_FORM).step(state, *DRIVES, parameter_row(p), 1e-4)
    assert slopes[0, 3] == slopes[1, 3] == 0.0  # errata E13
    assert slopes[2, 3] > 0.0


def test_only_the_bulk_modulus_is_replaced() -> None:
    p = EhaParameters()
    assert vars(with_bulk_modulus(p, 1e8)) == {**asdict(p), "bulk_modulus": 1e8}


def test_an_unknown_oil_volume_moves_each_state_by_its_largest_possible_amount() -> None:
    p, T = EhaParameters(), 1e-3
    variance, moves = undetermined_volume(p, {"motor_speed_rad_s": np.array([0.0, 4.0])}, T)
    np.testing.assert_allclose(variance, [0.0, 4.0 * p.pump_displacement**2])
    displaced, _ = undetermined_volume(p, {"position_m": np.array([9.0])}, T)
    assert displaced == pytest.approx(9.0 * p.piston_area**2)
    volume = 1e-7
    # with the piston at rest, equation 5.8 compresses all of it, half in each of two equal chambers
    assert volume * moves["differential_pressure_pa"] == pytest.approx(p.bulk_modulus * volume / p.chamber_volume)
    for chamber in ("pressure_a_pa", "pressure_b_pa"):
        assert moves[chamber] == pytest.approx(0.5 * moves["differential_pressure_pa"])
    # and with rigid oil, the piston makes room for it within a sample
    assert p.piston_area * volume * moves["position_m"] == pytest.approx(volume)
    assert T * moves["velocity_m_s"] == pytest.approx(moves["position_m"])
    pushed = p.piston_area * moves["differential_pressure_pa"]
    assert p.moving_mass * moves["acceleration_m_s2"] == pytest.approx(pushed)
