"""The flow balance with all unusual effects of rig and oil."""

from types import SimpleNamespace

import pytest

from estimation.models.wide_flow import QUICK_FLOW_FORM, WIDE_FLOW_FORM, WideFlowParameters
from plant.components.oil import ATMOSPHERE


@pytest.mark.parametrize("held", [2e6, 0.0, -2e6])
def test_at_rest_one_chamber_holds_the_load_and_the_other_has_the_supply_pressure(held: float) -> None:
    p = SimpleNamespace(start_pressure=held, accumulator_pressure=5e5, start_level=1e5, pressure_offset=3e4)
    first, second, *_ = WIDE_FLOW_FORM.initial(p)
    assert first - second == pytest.approx(held)
    assert min(first, second) == pytest.approx(6e5)


def test_a_jump_moves_the_shown_pressure_and_not_the_mean_of_the_chambers() -> None:
    state = (3e6, 1e6, 2e4, 5e5)
    jumped = tuple(value + 1e5 * share for value, share in zip(state, WIDE_FLOW_FORM.jump, strict=True))
    (before,), (after,) = (WIDE_FLOW_FORM.observe(one) for one in (state, jumped))
    assert after - before == pytest.approx(1e5)
    assert sum(jumped[:2]) == pytest.approx(sum(state[:2]))
    assert jumped[2:] == state[2:]


@pytest.mark.parametrize("quick", [False, True])
def test_pumping_aerated_oil_between_the_chambers_conserves_its_mass(quick: bool) -> None:
    share, liquid, stated = 0.02, 2e8, 7e5
    exponent = 1.3 if quick else 1.0
    slope = 1.0 / exponent

    def bubbles(at: float) -> float:
        return share * (ATMOSPHERE / at) ** slope

    def room(at: float) -> float:
        """Return the volume of oil with bubbles over that at the stated pressure (isothermal: atmospheric pressure)."""
        return 1.0 + bubbles(at) - bubbles(stated) - (at - (stated if quick else ATMOSPHERE)) / liquid

    p = WideFlowParameters(
        bulk_modulus=1.0 / (1.0 / liquid + slope * bubbles(stated) / stated),
        by_mass=1.0,
        air_softness=share * ATMOSPHERE,
        air_quickness=1.0 - slope,
        stated_pressure=stated,
        case_leakage=0.0,
        makeup_conductance=0.0,
    )
    pressures, volume, step = (9e5, 3e5), 2.0 * p.chamber_volume, 1e-3
    still = ((0.0, 0.0),) * 4
    drives = ((100.0, 100.0), (0.0, 0.0), (0.5, 0.5), (0.0, 0.0), *still, step)
    form = QUICK_FLOW_FORM if quick else WIDE_FLOW_FORM
    rates = form.rates((*pressures, 0.0, p.accumulator_pressure), drives, SimpleNamespace(**vars(p)), 0.0)

    def gained(at: float, rate: float) -> float:
        return volume * (1.0 / room(at + 1e-3 * rate) - 1.0 / room(at - 1e-3 * rate)) / 2e-3

    into, out_of = (gained(at, rate) for at, rate in zip(pressures, rates[:2], strict=True))
    assert into > 0.0
    assert into + out_of == pytest.approx(0.0, abs=2e-3 * into)
