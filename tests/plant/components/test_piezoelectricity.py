"""The constitutive relations 8 to 12: symmetry of class 6mm, and one energy for both effects."""

import numpy as np
import pytest

from plant.components.piezoelectricity import (
    PoledCeramic,
    charge_matrix,
    compliance_matrix,
    electric_displacement,
    strain,
)

PZT = PoledCeramic()


def turned(angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotation about axis 3 of a vector, and of a stress in Voigt's order (Bond's matrix)."""
    c, s = np.cos(angle), np.sin(angle)
    vector = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    stress = np.zeros((6, 6))
    for column, (i, j) in enumerate(pairs):
        one = np.zeros((3, 3))
        one[i, j] = one[j, i] = 1.0
        moved = vector @ one @ vector.T
        stress[:, column] = [moved[pair] for pair in pairs]
    return vector, stress


def test_the_compliance_is_symmetric_and_positive_definite() -> None:
    s = compliance_matrix(PZT)
    np.testing.assert_array_equal(s, s.T)
    assert np.linalg.eigvalsh(s).min() > 0.0


@pytest.mark.parametrize("angle", [0.3, 1.1, 2.0])
def test_the_matrices_are_unchanged_by_rotation_about_the_poling_axis(angle: float) -> None:
    vector, stress = turned(angle)
    np.testing.assert_allclose(stress.T @ compliance_matrix(PZT) @ stress, compliance_matrix(PZT), atol=1e-25)
    np.testing.assert_allclose(vector.T @ charge_matrix(PZT) @ stress, charge_matrix(PZT), atol=1e-23)


def test_the_direct_and_the_converse_effect_share_one_matrix() -> None:
    rng = np.random.default_rng(3)
    stress, field = 1e6 * rng.standard_normal(6), 1e5 * rng.standard_normal(3)
    by_field = strain(np.zeros(6), field, PZT) @ stress
    by_stress = electric_displacement(stress, np.zeros(3), PZT) @ field
    assert by_field == pytest.approx(by_stress, rel=1e-12)


def test_a_clamped_ceramic_has_a_smaller_but_positive_permittivity() -> None:
    d, s = charge_matrix(PZT), compliance_matrix(PZT)
    clamped = np.diag([PZT.eps_11, PZT.eps_11, PZT.eps_33]) - d @ np.linalg.solve(s, d.T)
    assert 0.0 < clamped[2, 2] < PZT.eps_33
    assert np.linalg.eigvalsh(clamped).min() > 0.0


def test_charging_a_free_ceramic_takes_energy_and_follows_its_permittivities() -> None:
    for field in 1e5 * np.random.default_rng(4).standard_normal((5, 3)):
        charge = electric_displacement(np.zeros(6), field, PZT)
        assert charge @ field > 0.0
        assert charge[2] / field[2] == pytest.approx(PZT.eps_33)
        assert charge[:2] / field[:2] == pytest.approx([PZT.eps_11, PZT.eps_11])
