from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.fits.greybox.problem import Problem
from estimation.models.greybox import GreyBoxModel
from estimation.models.motion import (
    LINEAR,
    MOTION_FORMS,
    UNKNOWNS,
    MotionParameters,
    lagging_friction,
    parallel_friction,
)
from faults.conditions import CONDITIONS, parameters_for
from plant.components.friction import quadratic_friction
from plant.eha.circuit import observe_circuit
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.circuit_start import at_rest
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_row

LAWS = ((6.589e4, 2.144e3, 436.0), (1.162e6, -7.44e3, 500.0), (4.462e6, 1.863e4, 551.0))


def coefficients(law: tuple[float, float, float]) -> SimpleNamespace:
    return SimpleNamespace(
        friction_quadratic=law[0],
        friction_linear=law[1],
        friction_coulomb=law[2],
        bristle_stiffness=2e7,
        bristle_damping=100.0,
    )


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("friction", [lagging_friction, parallel_friction])
@pytest.mark.parametrize("velocity", [-0.03, -0.002, 0.001, 0.02])
def test_friction_in_steady_sliding_is_equation_5_10(
    friction, law: tuple[float, float, float], velocity: float
) -> None:
    p = coefficients(law)
    low, high = -50.0, 50.0
    for _ in range(200):  # bisection for the bristle deflection that no longer changes
        middle = 0.5 * (low + high)
        falling = float(friction(velocity, middle, p)[0]) * np.sign(velocity)
        low, high = (middle, high) if (falling > 0.0) == (velocity > 0.0) else (low, middle)
    _, force = friction(velocity, 0.5 * (low + high), p)
    expected = quadratic_friction(velocity, np.sign(velocity), *law)
    assert float(force) == pytest.approx(float(expected), rel=1e-6)


@pytest.mark.parametrize("friction", [lagging_friction, parallel_friction])
def test_the_bristle_holds_its_force_at_rest_without_creep(friction) -> None:
    rate, force = friction(0.0, 0.5, coefficients(LAWS[0]))
    assert (float(rate), float(force)) == (0.0, 218.0)


@pytest.mark.slow
@pytest.mark.parametrize("form", MOTION_FORMS, ids=lambda form: form.name)
def test_sensitivities_by_parallel_differences_agree_with_the_exact_ones(form) -> None:
    n = 300
    drives = np.column_stack([np.full(n, 100.0), np.zeros(n)])
    log = GreyBoxLog(
        drives, np.zeros((n, 1)), parameter_row(MotionParameters()), 1e-3, np.full(n, 8), (OutputNoise(1.0),)
    )
    freed = FreedProblem(form, log, UNKNOWNS, LINEAR)
    beside = MotionParameters(speed_lead=2e-5, case_leakage=1e-13, bristle_stiffness=2e7)
    theta = freed.model.theta({name: getattr(beside, name) for name in UNKNOWNS})
    exact = Problem(freed.model, log).slopes(theta)
    scale = np.abs(exact).max(axis=0)
    assert np.all(np.abs(freed.slopes(theta) - exact).max(axis=0) <= 1e-2 * scale + 1e-12)


@pytest.mark.parametrize("form", MOTION_FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize("name", ["normal", "major_leakage", "major_leakage_minor_friction"])
@pytest.mark.parametrize("load", [-800.0, 0.0, 1500.0])
def test_a_single_rod_starts_in_the_creep_of_its_circuit(form: GreyBoxModel, name: str, load: float) -> None:
    rig = CircuitParameters(
        area_difference=0.25, volume_difference=0.2, pilot_share=2.0, accumulator_pressure=8e5, load_force=load
    )
    circuit = parameters_for(CONDITIONS[name], replace(rig, makeup_conductance=1e-7, pump_case_leakage=0.0))
    state = at_rest(circuit)
    shown = observe_circuit(state, circuit)
    values = {one.name: getattr(circuit, one.name) for one in fields(EhaParameters)}
    _, velocity, bristle, *pressures = form.initial(MotionParameters(**values))
    assert velocity == pytest.approx(state[3], rel=0.02, abs=1e-7)
    np.testing.assert_allclose(pressures, [shown["pressure_a_pa"], shown["pressure_b_pa"]], atol=1500.0)
    friction = lagging_friction if form is MOTION_FORMS[0] else parallel_friction
    assert friction(velocity, bristle, MotionParameters(**values))[0] == pytest.approx(0.0, abs=1e-9)
    if velocity == 0.0:
        assert bristle == pytest.approx(state[1], rel=1e-9)


def test_a_through_rod_starts_without_motion_under_its_load() -> None:
    p = MotionParameters(load_force=760.0)
    for form in MOTION_FORMS:
        supply = p.accumulator_pressure
        assert form.initial(p) == (0.0, 0.0, 0.0, supply + 760.0 / p.piston_area, supply)
