"""Air that explains a log: its amount, the oil without it, and the actuator whose oil contains it."""

import pytest

from estimation.eha.entrained_air import amount_of_air, entrained_air, with_air
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.models.wide_flow import QUICKEST
from plant.components.oil import ATMOSPHERE
from plant.eha.aerated import AeratedParameters
from plant.eha.circuit_parameters import MOST_AIR, circuit_of
from plant.eha.doubts import Spread
from plant.eha.model import EhaParameters

RIG = EhaParameters()
STATED = 1e6
SHARE, LIQUID = 0.02, 2.5e8


def explanation(share: float = SHARE, liquid: float = LIQUID, quickness: float = 0.0, **values: float) -> Explanation:
    """Return air as a search finds it, in oil of the given stiffness without air."""
    bubbles = share * (ATMOSPHERE / STATED) ** (1.0 - quickness)
    whole = 1.0 / (1.0 / liquid + (1.0 - quickness) * bubbles / STATED)
    found = {"air_softness": share * ATMOSPHERE, "bulk_modulus": whole, "air_quickness": quickness} | values
    told = {name: (value, 0.1 * value) for name, value in found.items()}
    return Explanation(("air",), told, {}, (), (), STATED)  # type: ignore[arg-type]


@pytest.mark.parametrize("quickness", [0.0, 0.2, QUICKEST])
def test_air_free_bulk_modulus_does_not_depend_on_the_bubbles_exponent(quickness: float) -> None:
    air = entrained_air(explanation(quickness=quickness))
    assert air is not None
    assert air.share == pytest.approx(SHARE)
    assert air.liquid == pytest.approx(LIQUID)


def test_a_circuits_isothermal_bubbles_are_as_compliant_at_the_accumulator_pressure() -> None:
    pressure, found = RIG.accumulator_pressure, explanation(quickness=0.2)
    air, p = entrained_air(found), with_air(RIG, found)
    assert air is not None
    assert isinstance(p, AeratedParameters)
    share = p.air_fraction / (1.0 - p.air_fraction)
    assert share * ATMOSPHERE / pressure**2 == pytest.approx(air.compliance_at(pressure))
    whole = 1.0 / p.bulk_modulus + share * ATMOSPHERE / STATED**2
    assert whole == pytest.approx(air.compliance)
    assert circuit_of(p).air_fraction == p.air_fraction
    assert circuit_of(p).piston_area == RIG.piston_area


def test_an_actuator_is_unchanged_if_no_oil_can_hold_the_air_found() -> None:
    late = explanation(air_onset=0.4)
    stiffer_than_any = explanation(bulk_modulus=2.0 * LIQUID, share=0.2)
    foam = explanation(share=2.0 * MOST_AIR / (1.0 - MOST_AIR))
    assert entrained_air(late) is None
    for found in (None, late, stiffer_than_any, foam):
        assert with_air(RIG, found) is RIG


def test_uncertain_chamber_volume_widens_the_interval_of_air_more_downwards() -> None:
    spreads = {"chamber_volume": Spread(0.1, 0.2)}
    air = amount_of_air(explanation(), {"chamber_volume": 1.0}, spreads)
    assert air is not None
    assert air.ci95 is not None
    assert air.ci95_total is not None
    value = 100.0 * SHARE
    assert air.value == pytest.approx(value)
    below, above = value - air.ci95_total[0], air.ci95_total[1] - value
    assert below > above > value - air.ci95[0]
    assert amount_of_air(None, {}, spreads) is None
