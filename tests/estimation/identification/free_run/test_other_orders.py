"""Reordered inputs keep their values, and distinguish a model that leaves its range from one that stays within it."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.other_orders import (
    MOST_REORDERED,
    PIECES,
    disagreement,
    is_wild,
    reordered_channels,
)
from estimation.identification.free_run.polynomial_fit import OUTPUT_MARGIN, PolynomialFit
from estimation.identification.free_run.polynomial_variables import Variables


def channels(u: Array) -> Channels:
    return Channels(("u",), "y", 1.0, (u[:, None],), (np.zeros(u.size),))


def moves(gain: float, square: float = 0.0, level: float = 0.0) -> PolynomialFit:
    """Return ``y = gain u[-1] + square u[-1]^2 + level``, for an output that was seen from -1 to 1."""
    limits = np.array([[-2.0, 2.0], [-9.0, 9.0]])
    variables = Variables(np.array([0, 1]), np.array([1, 1]), limits)
    terms = np.array([[1, -1, -1], [1, 1, -1], [-1, -1, -1]])
    return PolynomialFit(variables, terms, np.array([gain, square, level, 0.0]), 0.0)


def test_pieces_of_the_inputs_are_permuted_and_some_are_reversed() -> None:
    u = np.arange(200.0)
    found = [one.u[0][:, 0] for one in reordered_channels(channels(u))]
    assert len(found) == MOST_REORDERED
    backwards: list[float] = []
    for k, one in enumerate(found):
        assert np.array_equal(np.sort(one), u)
        steps = np.diff(one)
        breaks = int(np.count_nonzero(np.abs(steps) != 1.0))
        assert PIECES[k % 2] // 2 <= breaks < PIECES[k % 2]
        backwards.append(float(np.mean(steps == -1.0)))
    assert 0.3 < np.mean(backwards) < 0.7


def test_a_model_is_wild_if_it_leaves_its_range_in_more_than_three_samples_of_a_thousand() -> None:
    low, high = moves(1.0).variables.extended_ends(OUTPUT_MARGIN)
    quiet = np.zeros(1000)
    for end in (low, high):
        for count, wild in ((0, False), (2, False), (5, True)):
            u = np.where(np.arange(1000) % 199 == 7, 1.01 * end, quiet)
            u[np.flatnonzero(u)[count:]] = 0.0
            assert is_wild(moves(1.0, 1e-9), channels(u)) is wild
            assert not is_wild(moves(0.98, 1e-9), channels(u))
    assert not is_wild(moves(1.0), channels(np.zeros(20)))  # nor for a short record


def test_the_disagreement_of_fits_is_the_root_mean_square_of_their_difference() -> None:
    u = np.random.default_rng(0).uniform(-1.0, 1.0, 100)
    whole = moves(0.5)
    same = disagreement([whole, whole], whole, channels(u))
    assert same == 0.0
    apart = disagreement([moves(0.5, level=0.3), moves(0.5, level=-0.1)], whole, channels(u))
    # both begin at the same first sample
    assert apart == pytest.approx(np.sqrt(0.99 * (0.3**2 + 0.1**2) / 2.0))
