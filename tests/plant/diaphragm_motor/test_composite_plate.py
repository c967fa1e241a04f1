"""The diaphragm as a composite plate: exact limits, independent finite-element results, and the plant's own numbers."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from plant.diaphragm_motor.composite_plate import (
    PlateParameters,
    clamped_plate_roots,
    mode_shape,
    plate_coefficients,
    plate_deflection,
    plate_modes,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.errors import RigError

PLATE = PlateParameters()


def test_the_motors_coefficients_are_those_of_table_1s_plate() -> None:
    found, motor = plate_coefficients(PLATE), DiaphragmMotorParameters()
    wanted = (motor.diaphragm_compliance, motor.volume_a_volt, motor.deflection_a_pascal, motor.deflection_a_volt)
    np.testing.assert_allclose(found, wanted, rtol=1e-3)


def test_a_bare_brass_plate_has_the_textbook_compliance_and_deflection() -> None:
    bare = replace(PLATE, ceramic_thickness=0.0, clamp_radius=20.5e-3)
    bend = bare.brass_modulus * bare.brass_thickness**3 / (12.0 * (1.0 - bare.poisson_ratio**2))
    found = plate_coefficients(bare)
    assert found.compliance == pytest.approx(pi * bare.clamp_radius**6 / (192.0 * bend), rel=1e-9, abs=0.0)
    assert found.deflection_a_pascal == pytest.approx(bare.clamp_radius**4 / (64.0 * bend), rel=1e-9)
    assert found.volume_a_volt == found.deflection_a_volt == 0.0


def test_a_ceramic_as_stiff_as_the_brass_gives_a_uniform_plate() -> None:
    """The ceramic reaches almost to the rim and is as stiff as the brass: a uniform plate of both thicknesses."""
    same = replace(PLATE, ceramic_compliance=1.0 / PLATE.brass_modulus, ceramic_radius=PLATE.clamp_radius * (1 - 1e-9))
    bend = same.brass_modulus * same.thickness**3 / (12.0 * (1.0 - same.poisson_ratio**2))
    assert plate_coefficients(same).compliance == pytest.approx(
        pi * same.clamp_radius**6 / (192.0 * bend), rel=1e-6, abs=0.0
    )


def test_the_deflection_of_the_whole_blank_follows_equation_14_as_corrected_in_the_errata() -> None:
    blank = replace(PLATE, clamp_radius=20.5e-3, charge_constant=171e-12)
    assert plate_coefficients(blank).deflection_a_volt == pytest.approx(0.150e-6, rel=5e-3)


def test_the_roots_are_those_of_a_clamped_plate() -> None:
    modes = clamped_plate_roots(6)
    np.testing.assert_allclose([root for *_, root in modes], [10.216, 21.26, 34.88, 39.77, 51.03, 60.83], rtol=2e-4)
    assert [mode[:2] for mode in modes] == [(0, 0), (1, 0), (2, 0), (0, 1), (3, 0), (1, 1)]


def test_the_first_dry_mode_is_far_above_the_drive() -> None:
    """An independent finite-element model of the same plate gives 3983 Hz."""
    assert plate_modes(PLATE)[0].frequency == pytest.approx(3983.0, rel=0.01)


@pytest.mark.parametrize(("name", "value"), [("brass_thickness", 0.0), ("ceramic_radius", 0.02)])
def test_an_impossible_plate_is_refused(name: str, value: float) -> None:
    with pytest.raises(RigError, match=f"{name} must"):
        PlateParameters(**{name: value})


@pytest.mark.parametrize(("pressure", "volts"), [(1e4, 0.0), (0.0, 100.0)])
def test_the_volume_is_that_under_the_deflected_plate(pressure: float, volts: float) -> None:
    radii = np.linspace(0.0, PLATE.clamp_radius, 2001)
    bent = plate_deflection(PLATE, pressure, volts, radii)
    found = plate_coefficients(PLATE)
    under = 2.0 * pi * np.trapezoid(bent * radii, radii)
    assert abs(under) == pytest.approx(found.compliance * pressure + found.volume_a_volt * volts, rel=1e-5)
    assert abs(bent[0]) == pytest.approx(found.deflection_a_pascal * pressure + found.deflection_a_volt * volts)


def test_bare_brass_bends_as_in_the_textbook_and_is_held_at_the_clamp() -> None:
    bare = replace(PLATE, ceramic_thickness=0.0)
    bend = bare.brass_modulus * bare.brass_thickness**3 / (12.0 * (1.0 - bare.poisson_ratio**2))
    radii = np.linspace(0.0, bare.clamp_radius, 29)
    wanted = 1e4 / (64.0 * bend) * (bare.clamp_radius**2 - radii**2) ** 2
    np.testing.assert_allclose(np.abs(plate_deflection(bare, 1e4, 0.0, radii)), wanted, rtol=1e-9, atol=1e-18)


def test_modes_have_their_nodal_lines_and_neither_move_nor_turn_at_the_clamp() -> None:
    radii, angles = np.linspace(0.0, 1.0, 501), np.linspace(0.01, 2.0 * pi + 0.01, 721)
    for mode in plate_modes(PLATE):
        along = mode_shape(mode, radii, np.zeros(501))
        assert np.sum(along[1:-2] * along[2:-1] < 0.0) == mode.circles
        around = mode_shape(mode, np.full(721, 0.3), angles)
        assert np.sum(around[:-1] * around[1:] < 0.0) == 2 * mode.diameters
        assert abs(along[-1]) < 1e-9
        assert abs(along[-2]) < 1e-3
