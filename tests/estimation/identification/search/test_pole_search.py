import numpy as np

from estimation.identification import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.pole_search import banded_spectra, reflected, search_poles


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


def test_two_records_say_more_than_one(plant_30hz: LinearModel) -> None:
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
