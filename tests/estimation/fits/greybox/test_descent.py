import numpy as np

from estimation.fits.greybox.descent import Point, cached_cost, descend, descend_together

FAR = np.full(3, 10.0)


def bowl(x: np.ndarray) -> Point:
    """Return a point of a least-squares problem with two coupled coordinates, and a third one without effect."""
    slopes = np.array([[1.0, 1.0, 0.0], [0.0, 1e-2, 0.0], [0.0, 0.0, 0.0]])
    errors = slopes @ (x - np.array([2.0, 3.0, 0.0]))
    return Point(x, 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)


def test_the_minimum_is_found_and_a_coordinate_without_effect_keeps_its_value() -> None:
    found = descend(bowl, np.array([-5.0, 4.0, 1.5]), 60, (-FAR, FAR), 1e-12)
    np.testing.assert_allclose(found.theta, [2.0, 3.0, 1.5], atol=1e-3)


def test_the_minimum_within_bounds_is_found_at_a_bound() -> None:
    lower = np.array([-10.0, 4.0, -10.0])
    found = descend(bowl, np.array([-5.0, 6.0, 0.0]), 60, (lower, FAR), 1e-12)
    np.testing.assert_allclose(found.theta[:2], [1.0, 4.0], atol=2e-3)


def test_the_cost_is_evaluated_no_more_often_than_allowed() -> None:
    tried: list[np.ndarray] = []

    def counted(x: np.ndarray) -> Point:
        tried.append(x)
        return bowl(x)

    descend(counted, np.array([-5.0, 6.0, 0.0]), 3, (-FAR, FAR), 0.0)
    assert len(tried) == 3


def test_searches_together_end_where_each_ends_alone() -> None:
    starts = [np.array([-5.0, 4.0, 1.5]), np.array([2.0, 3.0, 0.0]), np.array([9.0, -9.0, -3.0])]
    evaluated: list[int] = []

    def at_each(points) -> list[Point]:
        evaluated.append(len(points))
        return [bowl(one) for one in points]

    together = descend_together(at_each, starts, 60, (-FAR, FAR), 1e-12)
    for start, found in zip(starts, together, strict=True):
        np.testing.assert_array_equal(found.theta, descend(bowl, start, 60, (-FAR, FAR), 1e-12).theta)
    assert evaluated[0] == len(starts)  # the search that begins at the optimum then drops out
    assert evaluated[-1] < len(starts)


def test_a_second_search_from_the_same_start_evaluates_only_new_points() -> None:
    tried: list[np.ndarray] = []

    def counted(x: np.ndarray) -> Point:
        tried.append(x)
        return bowl(x)

    at, start = cached_cost(counted), np.array([-5.0, 4.0, 1.5])
    short = descend(at, start, 2, (-FAR, FAR), 1e-12, radius=1.0)
    assert len(tried) == 2
    long = descend(at, start, 5, (-FAR, FAR), 1e-12, radius=1.0)
    assert len(tried) == 5
    assert long.cost < short.cost
    np.testing.assert_array_equal(long.theta, descend(bowl, start, 5, (-FAR, FAR), 1e-12, radius=1.0).theta)


def test_a_search_ends_early_only_if_it_cannot_reach_what_is_wanted_or_is_good_enough() -> None:
    tried: list[np.ndarray] = []

    def bent(x: np.ndarray) -> Point:
        """Return a point of Rosenbrock's valley, which takes many steps to descend, with a floor of 5."""
        tried.append(x)
        slopes = np.array([[1.0, 0.0], [-20.0 * x[0], 10.0]])
        errors = np.array([x[0] - 1.0, 10.0 * (x[1] - x[0] ** 2)])
        return Point(x, 5.0 + 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)

    far, start = np.full(2, 10.0), np.array([-1.2, 1.0])
    found = descend(bent, start, 40, (-far, far), 1e-9, 0.5)
    needed = len(tried)
    tried.clear()
    assert descend(bent, start, 40, (-far, far), 1e-9, 0.5, wanted=5.1).cost == found.cost
    assert len(tried) == needed
    tried.clear()
    descend(bent, start, 40, (-far, far), 1e-9, 0.5, wanted=-20.0)
    assert len(tried) < needed
    tried.clear()
    assert descend(bent, start, 40, (-far, far), 1e-9, 0.5, good=6.0).cost < 6.0  # it ends once it is good enough
    assert len(tried) < needed
    tried.clear()
    descend(bent, start, 40, (-far, far), 1e-9, 0.5, good=99.0)
    assert len(tried) == 1


def test_a_step_that_predicts_less_than_the_least_share_is_not_taken() -> None:
    def slow(x: np.ndarray) -> Point:
        """Return a point of a quartic: each step removes the same share of the cost above a floor of 1."""
        error, slope = x[0] ** 2, 2.0 * x[0]
        return Point(x, 1.0 + 0.5 * error**2, np.array([slope * error]), np.array([[slope**2]]))

    far = np.full(1, 10.0)
    ends = [descend(slow, far, 60, (-far, far), 0.0, least_share=share).cost - 1.0 for share in (0.0, 0.01, 0.5)]
    assert ends[0] < 1e-9 < ends[1] < 0.01 < ends[2] < 1.0
