"""The flow balance with all that may be strange about rig and oil."""

from types import SimpleNamespace

import pytest

from estimation.models.wide_flow import WIDE_FLOW_FORM


@pytest.mark.parametrize("held", [2e6, 0.0, -2e6])
def test_at_rest_the_load_is_held_by_one_chamber_and_the_other_has_the_supplys_pressure(held: float) -> None:
    p = SimpleNamespace(start_pressure=held, accumulator_pressure=5e5, start_level=1e5, pressure_offset=3e4)
    first, second, *_ = WIDE_FLOW_FORM.initial(p)
    assert first - second == pytest.approx(held)
    assert min(first, second) == pytest.approx(6e5)
