import numpy as np
import pytest

from faults.own_classes.groups import contiguous_blocks, folds
from plant.errors import HydrostateError


def test_runs_with_alternating_classes_are_cut_into_contiguous_blocks() -> None:
    places = np.arange(60) // 3 % 2
    blocks = contiguous_blocks(places, 5)
    assert (np.diff(blocks) >= 0).all()
    assert np.bincount(blocks).tolist() == [12] * 5


def test_runs_sorted_by_class_are_cut_class_by_class() -> None:
    places = np.repeat([0, 1], [50, 20])
    for held in folds(places, None, 5, 0.5):
        assert np.bincount(places[held]).tolist() == [10, 4]
    assert [len(held) for held in folds(places, None, 5)] == [14] * 5


def test_no_group_is_split_across_folds_and_every_run_is_held_out_once() -> None:
    rng = np.random.default_rng(0)
    places, groups = rng.integers(0, 3, 300), rng.integers(0, 23, 300)
    seen = np.zeros(300, dtype=int)
    for held in folds(places, groups, 5):
        seen[held] += 1
        assert not set(groups[held]) & set(np.delete(groups, held))
    assert (seen == 1).all()


def test_groups_of_one_class_each_are_spread_over_folds() -> None:
    groups = np.repeat(np.arange(20), 6)
    places = (groups >= 12).astype(np.int64)
    for held in folds(places, groups, 4):
        assert np.bincount(places[held], minlength=2).tolist() == [18, 12]


@pytest.mark.parametrize(("groups", "message"), [([1] * 10, "two groups at least"), ([1, 2], "a group for each of 10")])
def test_a_single_group_or_a_wrong_number_of_group_labels_is_refused(groups: list[int], message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        folds(np.arange(10) % 2, groups, 5)
