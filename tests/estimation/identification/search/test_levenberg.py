"""The descent ends at an optimum, takes no forbidden step, and stops evaluating once nothing can be gained."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.search.levenberg import levenberg


class Valley:
    """Rosenbrock's valley as a sum of squares with a floor; it counts its evaluations."""

    def __init__(self, floor: float = 0.0) -> None:
        self.floor, self.asked = floor, 0

    def __call__(self, x: Array) -> tuple[float, Array, Array]:
        self.asked += 1
        errors = np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0], self.floor])
        slopes = np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0], [0.0, 0.0]])
        return float(errors @ errors), slopes.T @ slopes, slopes.T @ errors


@pytest.mark.parametrize("floor", [0.0, 3.0])
@pytest.mark.parametrize("start", [[-1.2, 1.0], [3.0, -2.0]])
def test_the_search_finds_the_minimum_of_a_curved_valley(start: list[float], floor: float) -> None:
    valley = Valley(floor)
    cost, found = levenberg(valley, np.array(start), lambda _: True, tolerance=1e-12, most_steps=200)
    assert cost == pytest.approx(floor**2, abs=1e-9)
    assert found == pytest.approx([1.0, 1.0], abs=1e-4)
    assert valley.asked < 60


def test_a_search_from_the_minimum_ends_after_one_further_evaluation() -> None:
    valley = Valley(floor=3.0)
    cost, found = levenberg(valley, np.ones(2), lambda _: True, tolerance=1e-9, most_steps=200)
    assert (cost, found.tolist(), valley.asked) == (9.0, [1.0, 1.0], 2)


def test_the_search_gives_up_at_its_start_if_no_step_is_acceptable() -> None:
    valley, tried = Valley(), list[Array]()

    def walled(x: Array) -> bool:
        tried.append(x)
        return False

    cost, found = levenberg(valley, np.array([-1.2, 1.0]), walled, tolerance=0.0, most_steps=1000)
    assert found.tolist() == [-1.2, 1.0]
    assert cost == pytest.approx(24.2)
    assert valley.asked == 1
    sizes = [float(np.linalg.norm(x - found)) for x in tried]
    assert sizes == sorted(sizes, reverse=True)  # each step is shorter than the last
    assert len(sizes) < 20


def test_the_search_evaluates_only_acceptable_points_and_respects_its_largest_number_of_steps() -> None:
    seen: list[Array] = []
    valley = Valley()

    def at(x: Array) -> tuple[float, Array, Array]:
        seen.append(x.copy())
        return valley(x)

    _, found = levenberg(at, np.array([-1.2, 1.0]), lambda x: x[0] <= 0.5, tolerance=1e-12, most_steps=300)
    assert max(x[0] for x in seen) <= 0.5
    assert found[0] == pytest.approx(0.5, abs=0.01)
    seen.clear()
    levenberg(at, np.array([-1.2, 1.0]), lambda _: True, tolerance=1e-12, most_steps=5)
    assert len(seen) <= 6


def test_the_search_ends_after_two_consecutive_steps_with_too_little_gain() -> None:
    asked = list[int]()
    for least_gain in (0.0, 1e-3, 2.0):
        valley = Valley(floor=3.0)
        cost, _ = levenberg(
            valley, np.array([-1.2, 1.0]), lambda _: True, tolerance=1e-12, most_steps=200, least_gain=least_gain
        )
        asked.append(valley.asked)
        if least_gain == 1e-3:
            assert cost == pytest.approx(9.0, rel=0.1)
    assert asked[0] > asked[1] > asked[2]
