"""Oil that contains air, compared with the compression of its bubbles."""

from types import SimpleNamespace

import pytest

from estimation.models.aerated_oil import VAPOUR, swellings, tangent_stiffness
from plant.components.oil import ATMOSPHERE


@pytest.mark.parametrize("pressure", [2e5, 7e5, 3e6])
def test_stiffness_of_aerated_oil_follows_the_polytropic_law_of_its_bubbles(
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
    told = tangent_stiffness(pressure, air, p, quick=True)
    assert told == pytest.approx(1.0 / ((1.0 + short**2) / p.bulk_modulus + softer))
    by_mass = SimpleNamespace(**vars(p) | {"by_mass": 1.0})
    at_stated = tangent_stiffness(stated, air, by_mass, quick=True)
    assert at_stated == pytest.approx(p.bulk_modulus, rel=1e-5)


@pytest.mark.parametrize("quick", [False, True])
def test_by_mass_oil_that_flows_to_another_pressure_and_back_has_its_volume_again(quick: bool) -> None:
    p = SimpleNamespace(bulk_modulus=1e8, by_mass=1.0, air_onset=-1.0, air_quickness=0.2, stated_pressure=7e5)
    air = 0.02 * ATMOSPHERE
    first, second = swellings(3e6, 4e5, air, p, quick=quick)
    assert first > 0.0
    assert (1.0 + first) * (1.0 - second) == pytest.approx(1.0, rel=1e-12)
    there, on = swellings(3e6, 1e6, air, p, quick=quick)[0], swellings(1e6, 4e5, air, p, quick=quick)[0]
    assert (1.0 + there) * (1.0 + on) == pytest.approx(1.0 + first, rel=1e-12)
    assert swellings(3e6, 4e5, air, SimpleNamespace(**vars(p) | {"by_mass": 0.0}), quick=quick) == (0.0, 0.0)


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("pressure", [4e5, 7e5, 3e6])
def test_by_mass_the_tangent_stiffness_is_the_slope_of_the_oils_volume(pressure: float, quick: bool) -> None:
    p = SimpleNamespace(bulk_modulus=1e8, by_mass=1.0, air_onset=-1.0, air_quickness=0.2, stated_pressure=7e5)
    air, nudge = 0.02 * ATMOSPHERE, 1.0
    grown, _ = swellings(pressure + nudge, pressure - nudge, air, p, quick=quick)
    assert 2.0 * nudge / grown == pytest.approx(tangent_stiffness(pressure, air, p, quick=quick), rel=1e-3)
