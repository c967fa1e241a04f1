"""Fractional damping in time: a compiled ring of past samples agrees with the viscous damper and the exact response."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from plant.motor_paper.fractional import caputo_from_rest, gl_weights
from plant.motor_paper.hysteresis_model import harmonics
from plant.motor_paper.vibration_model import VibrationParameters, exact_response, reduced_stiffness
from plant.motor_paper.vibration_run import forced_vibration, vibration_run

MODEL = VibrationParameters()
CYCLE = 400
STEP = 1.0 / (480.0 * CYCLE)


def _fractional(order: float) -> VibrationParameters:
    size = MODEL.damping * (2.0 * pi * 480.0) ** (1.0 - order)
    return replace(MODEL, damping=0.0, fractional_damping=size, fractional_order=order)


def _force(cycles: int) -> np.ndarray:
    return np.sin(2.0 * pi * np.arange(cycles * CYCLE + 1) / CYCLE)


def test_fractional_damping_of_order_one_gives_the_motion_of_a_viscous_damper() -> None:
    viscous, _ = vibration_run(MODEL, _force(10), STEP)
    fractional, _ = vibration_run(_fractional(1.0), _force(10), STEP)
    assert fractional == pytest.approx(viscous, rel=1e-12, abs=1e-18)


@pytest.mark.parametrize("order", [0.5, 1.5])
def test_a_sine_settles_to_the_exact_response(order: float) -> None:
    force = _force(40)
    moved, _ = vibration_run(_fractional(order), force, STEP)
    last = slice(-5 * CYCLE - 1, None)
    response = harmonics(moved[last], 1, 5)[1] / harmonics(force[last], 1, 5)[1]
    exact = exact_response(replace(_fractional(order), diaphragm_mass=1e-9), np.array([480.0]))[0]
    assert abs(response / exact - 1.0) < 0.013


@pytest.mark.parametrize("memory", [None, 150])
def test_every_step_balances_its_forces_with_the_sampled_derivative(memory: int | None) -> None:
    model, force = _fractional(0.5), _force(2)
    x, v = vibration_run(model, force, STEP, memory=memory)
    resisted = model.fractional_damping * caputo_from_rest(x, 0.5, STEP, memory)[1:]
    share = model.fluid_stiffness / (model.diaphragm_stiffness + model.fluid_stiffness)
    pushed = share * force[1:] - reduced_stiffness(model) * x[:-1] - resisted
    assert model.cylinder_mass * np.diff(v) / STEP == pytest.approx(pushed, rel=1e-9, abs=1e-9)


def test_a_memory_of_a_thousand_samples_is_enough_for_two_and_a_half_cycles() -> None:
    whole, _ = vibration_run(_fractional(0.5), _force(20), STEP)
    short, _ = vibration_run(_fractional(0.5), _force(20), STEP, memory=1000)
    assert np.max(np.abs(short - whole)) < 0.03 * np.max(np.abs(whole))
    assert np.any(short != whole)


def test_the_compiled_loop_agrees_with_plain_python() -> None:
    model, force = _fractional(0.5), _force(1)
    constants = (model.cylinder_mass, reduced_stiffness(model), 0.0, 0.0, model.fractional_damping / STEP**0.5)
    share = model.fluid_stiffness / (model.diaphragm_stiffness + model.fluid_stiffness)
    plain = forced_vibration(share * force, 0.0, 0.0, constants, gl_weights(0.5, len(force)), STEP)
    np.testing.assert_allclose(plain, vibration_run(model, force, STEP), rtol=1e-9, atol=1e-18)


def test_free_motion_loses_energy_with_any_damper() -> None:
    for order in (0.5, 1.0, 1.5):
        model = replace(_fractional(order), cubic_stiffness=1e9)
        x, v = vibration_run(model, np.zeros(20 * CYCLE), STEP, start=1e-4)
        potential = 0.5 * reduced_stiffness(model) * x**2 + 0.25 * model.cubic_stiffness * x**4
        energy = 0.5 * model.cylinder_mass * v**2 + potential
        peaks = energy.reshape(20, CYCLE).max(axis=1)
        assert np.all(np.diff(peaks[:8]) < 0.0), order


def test_the_cubic_spring_raises_the_frequency_with_amplitude() -> None:
    model = replace(MODEL, damping=0.0, cubic_stiffness=1e13)
    crossings = [
        np.count_nonzero(np.diff(np.signbit(vibration_run(model, np.zeros(20 * CYCLE), STEP, start=start)[0])))
        for start in (1e-6, 1e-4)
    ]
    assert crossings[0] == pytest.approx(40, abs=1)
    assert crossings[1] > 1.05 * crossings[0]
