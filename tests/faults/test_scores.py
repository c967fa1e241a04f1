"""A confusion matrix counts every run once, and accuracy is the share on its diagonal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from faults.conditions import CONDITIONS
from faults.scores import accuracy, confusion_matrix

NAMES = st.sampled_from(list(CONDITIONS))
PAIRS = st.lists(st.tuples(NAMES, NAMES), min_size=1, max_size=30)


@given(PAIRS)
def test_every_run_is_counted_once_in_the_row_of_its_truth(pairs: list[tuple[str, str]]) -> None:
    true, found = (list(side) for side in zip(*pairs, strict=True))
    table = confusion_matrix(true, found)
    assert int(table.to_numpy().sum()) == len(pairs)
    assert {name: int(count) for name, count in table.sum(axis=1).items()} == {n: true.count(n) for n in CONDITIONS}
    assert {name: int(count) for name, count in table.sum(axis=0).items()} == {n: found.count(n) for n in CONDITIONS}
    assert accuracy(table) == pytest.approx(np.mean([a == b for a, b in pairs]))


def test_rows_and_columns_of_the_confusion_matrix_are_in_the_order_of_table_1() -> None:
    table = confusion_matrix(["normal"], ["major_leakage"])
    assert list(table.index) == list(table.columns) == list(CONDITIONS)
    assert (table.index.name, table.columns.name) == ("true", "found")
    assert table.loc["normal", "major_leakage"] == 1


def test_the_accuracy_of_no_runs_is_not_a_number() -> None:
    assert np.isnan(accuracy(confusion_matrix([], [])))


@pytest.mark.parametrize(("true", "found"), [(["normal"], []), (["normal"], ["broken"]), (["worn"], ["normal"])])
def test_lists_of_unequal_length_or_with_unknown_conditions_are_refused(true: list[str], found: list[str]) -> None:
    with pytest.raises(ValueError, match=r"zip\(\)|is not in list"):
        confusion_matrix(true, found)
