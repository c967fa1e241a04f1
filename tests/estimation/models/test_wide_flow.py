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


def test_a_jump_moves_what_is_shown_by_as_much_and_the_mean_of_the_chambers_not_at_all() -> None:
    state = (3e6, 1e6, 2e4, 5e5)
    jumped = tuple(value + 1e5 * share for value, share in zip(state, WIDE_FLOW_FORM.jump, strict=True))
    (before,), (after,) = (WIDE_FLOW_FORM.observe(one) for one in (state, jumped))
    assert after - before == pytest.approx(1e5)
    assert sum(jumped[:2]) == pytest.approx(sum(state[:2]))
    assert jumped[2:] == state[2:]
