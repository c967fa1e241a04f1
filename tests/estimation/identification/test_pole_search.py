import numpy as np

from estimation.identification import LinearModel
from estimation.identification.criterion import Structure
from estimation.identification.pole_search import search_poles


def test_the_best_candidate_is_near_the_true_poles(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.choice([-1.0, 1.0], 1_000), 5)
    y = plant_30hz.simulate(u)
    best = np.sort_complex(np.roots(search_poles(Structure(2, 2, 1), u, y / y.std())[0]))
    wanted = np.sort_complex(plant_30hz.poles)
    assert np.abs(best - wanted).max() < 0.35 * np.abs(1.0 - wanted).max()


def test_a_slow_pole_that_a_zero_nearly_cancels_gets_a_start(table6: dict[str, LinearModel]) -> None:
    """Minor leakage of Table 6: pole 0.9884, zero 0.9882."""
    rng = np.random.default_rng(4)
    u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    y = table6["minor_leakage"].simulate(u)
    starts = search_poles(Structure(3, 2), u, y / y.std())
    slowest = [np.abs(np.roots(start)).max() for start in starts]
    assert any(0.97 < radius < 0.995 for radius in slowest)


def test_candidates_differ_from_each_other(plant_30hz: LinearModel) -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(3_000)
    starts = search_poles(Structure(3, 3, 1), u, plant_30hz.simulate(u))
    rounded = {tuple(start.round(9)) for start in starts[:4]}
    assert len(rounded) == 4
