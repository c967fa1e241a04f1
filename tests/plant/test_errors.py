"""Names given by a user are checked for being known and given only once, and the message lists the known ones."""

import re

import pytest

from plant.errors import HydrostateError, require_each_known


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["ekf", "kf"], "a filter must be one of ekf, ukf, got 'kf'"),
        (["ukf", "ukf"], "a filter must be given once, got 'ukf' twice"),
    ],
    ids=["unknown", "twice"],
)
def test_a_name_that_is_unknown_or_comes_twice_is_refused(names: list[str], said: str) -> None:
    """Before, the message for both was "must be one of ekf, ukf, once", where the last reads like a name."""
    with pytest.raises(HydrostateError, match=re.escape(said)):
        require_each_known("a filter", names, ("ekf", "ukf"))


def test_known_names_pass_in_any_order_and_so_does_an_empty_list() -> None:
    require_each_known("filters", ["ukf", "ekf"], ("ekf", "ukf"))
    require_each_known("filters", [], ("ekf", "ukf"))
