import numpy as np
import pytest

from estimation.identification import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.pole_search import (
    DAMPING_RATIOS,
    _multiplied,
    _pole_pairs,
    _real_poles,
    banded_spectra,
    reflected,
    search_poles,
)


def found(structure: Structure, u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return search_poles(structure, banded_spectra([(u, y / y.std())]), u.size)


def poles_of(theta: np.ndarray, n_numerator: int) -> np.ndarray:
    return np.sort_complex(np.roots(np.concatenate([[1.0], theta[n_numerator:]])))


def test_the_best_candidate_has_nearly_the_true_poles(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 1_000), 5)
    costs, thetas = found(Structure(2, 2, 1), u, plant_30hz.simulate(u))
    assert (np.diff(costs) > 0.0).all()
    np.testing.assert_allclose(poles_of(thetas[0], 2), np.sort_complex(plant_30hz.poles), atol=0.01)


def test_a_slow_pole_that_a_zero_nearly_cancels_gets_a_start(table6: dict[str, LinearModel]) -> None:
    """Minor leakage of Table 6: pole 0.9884, zero 0.9882."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    _, thetas = found(Structure(3, 2), u, table6["minor_leakage"].simulate(u))
    slowest = [np.abs(poles_of(theta, 3)).max() for theta in thetas]
    assert any(0.97 < radius < 0.995 for radius in slowest)


def test_the_spectra_of_two_records_are_added(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(5)
    signals = [rng.standard_normal(n) for n in (700, 1_100)]
    spectra = banded_spectra([(u, plant_30hz.simulate(u)) for u in signals])
    alone = banded_spectra([(signals[0], plant_30hz.simulate(signals[0]))])
    assert spectra.power.sum() > 2.0 * alone.power.sum()
    assert spectra.omega[0] == 0.0
    assert (np.diff(spectra.omega) > 0.0).all()


def test_unstable_roots_are_reflected_into_the_unit_circle() -> None:
    rows = reflected([np.poly([1.25, 0.5]), np.poly([0.3, -0.2])])
    np.testing.assert_allclose(np.sort(np.roots([1.0, *rows[0]])), [0.5, 0.8])
    np.testing.assert_allclose(rows[1], np.poly([0.3, -0.2])[1:])


def test_pairs_of_poles_are_real_or_conjugate_with_the_listed_damping_ratios() -> None:
    n = 2000
    real = -_real_poles(n)[:, 0]
    assert np.all((real > -1.0) & (real < 1.0))
    ratios, frequencies = list[float](), list[float]()
    for row in _pole_pairs(n):
        roots = np.roots([1.0, *row])
        assert np.abs(roots).max() < 1.0
        if np.iscomplex(roots).any():
            continuous = np.log(roots[0])
            frequencies.append(abs(continuous))
            ratios.append(-continuous.real / abs(continuous))
        else:
            assert all(np.min(np.abs(real - root.real)) < 1e-6 for root in roots)
    assert np.unique(np.round(ratios, 6)).tolist() == pytest.approx(sorted(DAMPING_RATIOS), abs=1e-6)
    assert min(frequencies) == pytest.approx(8.0 * np.pi / n)
    assert max(frequencies) == pytest.approx(0.97 * np.pi)


def test_products_of_denominators_equal_polynomial_products() -> None:
    rng = np.random.default_rng(0)
    kept, additions = rng.normal(size=(3, 2)), rng.normal(size=(4, 1))
    wanted = [np.polymul([1.0, *a], [1.0, *b])[1:] for a in kept for b in additions]
    np.testing.assert_allclose(_multiplied(kept, additions), wanted)
