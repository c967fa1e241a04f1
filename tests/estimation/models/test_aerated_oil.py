"""Oil that contains air, compared with the compression of its bubbles."""

from types import SimpleNamespace

import pytest

from estimation.models.aerated_oil import VAPOUR, tangent_stiffness
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
