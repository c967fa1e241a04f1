"""Stretches contain every sample that satisfies a condition, and no other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimation.stretches import in_long_stretches, stretches


@given(st.lists(st.booleans(), max_size=40))
def test_stretches_contain_exactly_the_true_samples_and_do_not_touch(given_: list[bool]) -> None:
    where = np.array(given_, dtype=np.bool_)
    first, behind = stretches(where)
    assert [i for a, b in zip(first, behind, strict=True) for i in range(a, b)] == np.flatnonzero(where).tolist()
    assert np.all(first[1:] > behind[:-1])


@pytest.mark.parametrize(("least", "kept"), [(1, [0, 2, 3, 5, 6, 7]), (2, [2, 3, 5, 6, 7]), (2.5, [5, 6, 7]), (4, [])])
def test_stretches_shorter_than_the_limit_are_dropped(least: float, kept: list[int]) -> None:
    where = np.array([1, 0, 1, 1, 0, 1, 1, 1], dtype=np.bool_)
    assert np.flatnonzero(in_long_stretches(where, least)).tolist() == kept
