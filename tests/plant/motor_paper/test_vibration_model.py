"""The linear vibration model: with mended signs it is stable and swings at 480 Hz, as printed it is unstable."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from plant.errors import RigError
from plant.motor_paper.vibration_model import (
    VibrationParameters,
    exact_response,
    first_mode,
    massless_matrices,
    mechanical_matrices,
    state_space,
    with_fractional_damping,
)

MODEL = VibrationParameters()


def test_printed_signs_are_unstable() -> None:
    poles = np.linalg.eigvals(mechanical_matrices(MODEL, "printed")[0])
    assert sorted(poles.real)[-1] == pytest.approx(304.4, abs=0.1)


def test_mended_signs_are_stable() -> None:
    assert np.all(np.linalg.eigvals(mechanical_matrices(MODEL)[0]).real < 0.0)


def test_the_first_mode_is_at_480_hz_with_and_without_the_diaphragms_mass() -> None:
    both = first_mode(np.linalg.eigvals(mechanical_matrices(MODEL)[0]))
    one = first_mode(np.linalg.eigvals(massless_matrices(MODEL)[0]))
    assert abs(one) / (2.0 * pi) == pytest.approx(480.0, abs=0.1)
    assert abs(both) / (2.0 * pi) == pytest.approx(480.0, abs=1.0)
    assert MODEL.natural_frequency == pytest.approx(480.0, abs=0.1)


def test_mended_stiffness_is_symmetric_and_positive_definite() -> None:
    A = mechanical_matrices(MODEL)[0]
    stiffness = -np.diag([MODEL.diaphragm_mass, MODEL.cylinder_mass]) @ A[1::2, 0::2]
    assert stiffness == pytest.approx(stiffness.T, rel=1e-12)
    assert np.all(np.linalg.eigvalsh(stiffness) > 0.0)


def test_the_model_without_diaphragm_mass_is_the_limit_of_a_small_mass() -> None:
    light = replace(MODEL, diaphragm_mass=1e-9)
    assert abs(first_mode(np.linalg.eigvals(mechanical_matrices(light)[0]))) == pytest.approx(
        abs(first_mode(np.linalg.eigvals(massless_matrices(MODEL)[0]))), rel=1e-6
    )


def test_the_natural_frequency_rises_with_the_loads_stiffness() -> None:
    found = [replace(MODEL, load_stiffness=k).natural_frequency for k in (0.0, 2e4, 1e5)]
    assert found == sorted(found)


@pytest.mark.parametrize("order", [0.5, 1.0, 1.5])
def test_oustaloup_states_approximate_fractional_damping(order: float) -> None:
    size = MODEL.damping * (2.0 * pi * 480.0) ** (1.0 - order)
    model = replace(MODEL, damping=0.0, fractional_damping=size, fractional_order=order)
    frequency = np.geomspace(50.0, 2e3, 30)
    ours = np.asarray(state_space(model)(2j * pi * frequency)).ravel()
    assert ours == pytest.approx(exact_response(model, frequency), rel=6e-3)


def test_fractional_damping_of_order_one_is_viscous() -> None:
    model = replace(MODEL, damping=0.0, fractional_damping=MODEL.damping, fractional_order=1.0)
    fractional = with_fractional_damping(massless_matrices(model), model)
    assert fractional[0] == pytest.approx(massless_matrices(MODEL)[0], rel=1e-15)


def test_damping_of_order_below_one_raises_the_resonance_and_above_one_lowers_it() -> None:
    frequency = np.linspace(400.0, 560.0, 1601)
    peaks: list[float] = []
    for order in (0.5, 1.0, 1.5):
        size = MODEL.damping * (2.0 * pi * 480.0) ** (1.0 - order)
        model = replace(MODEL, damping=0.0, fractional_damping=size, fractional_order=order)
        peaks.append(float(frequency[np.argmax(np.abs(exact_response(model, frequency)))]))
    assert peaks == pytest.approx([512.0, 474.6, 444.9], abs=0.5)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"damping": -1.0}, "damping must not be negative, got -1.0"),
        ({"cylinder_mass": 0.0}, "cylinder_mass must be positive, got 0.0"),
        ({"fractional_order": 2.0}, "below 2, which is a mass, got 2.0"),
    ],
)
def test_impossible_parameters_are_refused(change: dict[str, float], said: str) -> None:
    with pytest.raises(RigError, match=said):
        VibrationParameters(**change)


def test_a_system_with_real_poles_only_has_no_first_mode() -> None:
    with pytest.raises(RigError, match="real poles only"):
        first_mode(np.array([-1.0 + 0.0j, -2.0 + 0.0j]))


def test_the_stiffnesses_follow_from_the_compliances_and_the_piston_area() -> None:
    p, area = VibrationParameters(), 3.7934e-4  # F = A p and x = C p / A
    assert p.diaphragm_stiffness == pytest.approx(area**2 / 1.174e-13, rel=1e-3)
    assert p.fluid_stiffness == pytest.approx(area**2 / (4e-13 + 1e-5 / 1e9), rel=1e-3)


def test_without_fractional_damping_the_model_keeps_its_states() -> None:
    plain = replace(MODEL, fractional_damping=0.0)
    matrices = mechanical_matrices(plain)
    assert with_fractional_damping(matrices, plain) is matrices
    assert state_space(plain).nstates == 4
    damped = replace(MODEL, fractional_damping=1.0, fractional_order=0.5)
    assert state_space(damped).nstates > 4
    assert state_space(damped, signs="printed").nstates == 4


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
def test_a_tiny_imaginary_part_from_rounding_is_no_oscillation_at_any_pole_magnitude(size: float) -> None:
    swinging = size * (-0.1 + 1.0j)
    assert first_mode(np.array([swinging, swinging.conjugate(), 0.5 * size * (-1.0 + 1e-9j)])) == swinging
    with pytest.raises(RigError, match="must oscillate"):
        first_mode(size * np.array([-1.0 + 1e-9j, -1.0 - 1e-9j]))
