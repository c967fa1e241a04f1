from collections.abc import Sequence

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.parallel_descents import PARALLEL_SEARCHES, Way, descend_in_turn

FAR = np.full(3, 10.0)


def bent(x: np.ndarray) -> Point:
    """Return a point of Rosenbrock's valley, which takes many steps to descend; the third coordinate sets its floor."""
    slopes = np.array([[1.0, 0.0, 0.0], [-20.0 * x[0], 10.0, 0.0]])
    errors = np.array([x[0] - 1.0, 10.0 * (x[1] - x[0] ** 2)])
    return Point(x, x[2] ** 2 + 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)


@pytest.mark.parametrize("share", [1.05, 1.5, np.inf])
@pytest.mark.parametrize("logs", [1, 2])
def test_parallel_searches_end_at_the_points_of_sequential_searches(share: float, logs: int) -> None:
    rng = np.random.default_rng(3)
    starts = rng.uniform(-3.0, 3.0, (12, 3))
    alone, wanted = list[Point](), np.inf
    waited = 0

    def counted(x: np.ndarray) -> Point:
        nonlocal waited
        waited += 1
        return bent(x)

    for start in starts:
        alone.append(descend(counted, start, 9, (-FAR, FAR), radius=1.0, wanted=wanted))
        wanted = min(wanted, share * alone[-1].cost)

    together: list[int] = []

    def evaluated(points: Sequence[np.ndarray]) -> list[Point]:
        together.append(len(points))
        return [bent(one) for one in points]

    each_log = [lambda points: evaluated(points), lambda points: evaluated(points)][:logs]
    asked: list[int] = []

    def after(way: int, point: Point) -> float:
        asked.append(way)
        return share * point.cost

    ways = [Way(each_log[i % logs], start, (-FAR, FAR)) for i, start in enumerate(starts)]
    found = descend_in_turn(ways, 9, np.inf, after, radius=1.0)
    for one, other in zip(found, alone, strict=True):
        np.testing.assert_array_equal(one.theta, other.theta)
    assert asked == [*range(len(starts))]
    assert max(together) == PARALLEL_SEARCHES
    assert len(together) < 0.5 * waited
    assert sum(together) == waited if share == np.inf else sum(together) > waited  # some searches went on in vain
