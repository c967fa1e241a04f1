"""Names given by a user are checked for being known and given only once, and the message lists the known ones."""

import pytest

from plant.errors import HydrostateError, require_each_known


@pytest.mark.parametrize("names", [["ekf", "kf"], ["ukf", "ukf"]], ids=["unknown", "twice"])
def test_a_name_that_is_unknown_or_comes_twice_is_refused(names: list[str]) -> None:
    with pytest.raises(HydrostateError, match=f"filters must be one of ekf, ukf, once, got '{names[1]}'"):
        require_each_known("filters", names, ("ekf", "ukf"))


def test_known_names_pass_in_any_order_and_so_does_an_empty_list() -> None:
    require_each_known("filters", ["ukf", "ekf"], ("ekf", "ukf"))
    require_each_known("filters", [], ("ekf", "ukf"))
