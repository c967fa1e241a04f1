"""The flow balance with all that may be strange about rig and oil."""

from types import SimpleNamespace

import pytest

from estimation.models.wide_flow import VAPOUR, WIDE_FLOW_FORM, _stiffness
from plant.components.oil import ATMOSPHERE


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


@pytest.mark.parametrize("pressure", [2e5, 7e5, 3e6])
def test_bubbles_are_squeezed_as_their_exponent_says_and_bulk_modulus_is_that_at_the_stated_pressure(
    pressure: float,
) -> None:
    share, exponent, stated = 0.02, 1.3, 7e5
    p = SimpleNamespace(
        bulk_modulus=1e8, by_mass=0.0, air_onset=-1.0, air_quickness=1.0 - 1.0 / exponent, stated_pressure=stated
    )
    air = share * ATMOSPHERE

    def bubbles(at: float) -> float:
        return share * (ATMOSPHERE / at) ** (1.0 / exponent)

    softer = (bubbles(pressure) / pressure - bubbles(stated) / stated) / exponent
    short = (VAPOUR / pressure) ** 2
    told = _stiffness(pressure, air, p, quick=True)
    assert told == pytest.approx(1.0 / ((1.0 + short**2) / p.bulk_modulus + softer))
    by_mass = SimpleNamespace(**vars(p) | {"by_mass": 1.0})
    at_stated = _stiffness(stated, air, by_mass, quick=True)
    assert at_stated == pytest.approx(p.bulk_modulus, rel=1e-5)
