"""The compliance of a diaphragm's chamber is the slope of the volume that it takes in."""

import pytest

from plant.components.diaphragm import centre_deflection, chamber_compliance

GAS, EXPONENT, REST = 3e-10, 1.2, 1.5e5


@pytest.mark.parametrize("pressure", [2e4, 1e5, 3e5])
def test_the_compliance_of_the_gas_is_the_slope_of_its_polytropic_volume(pressure: float) -> None:
    def volume(p: float) -> float:
        return GAS * (REST / p) ** (1.0 / EXPONENT)

    slope = (volume(pressure - 1.0) - volume(pressure + 1.0)) / 2.0
    found = float(chamber_compliance(pressure, 1e-13, 2e-16, GAS, EXPONENT, REST))
    assert found - 1e-13 - 2e-16 == pytest.approx(slope, rel=1e-6, abs=0.0)


def test_gas_softens_a_chamber_most_at_low_pressure() -> None:
    low, high = (float(chamber_compliance(p, 1e-13, 2e-16, GAS, EXPONENT, REST)) for p in (1e4, 3e5))
    assert low > 10.0 * high - 9.0 * (1e-13 + 2e-16)


def test_chamber_pressure_reduces_the_deflection_of_the_centre() -> None:
    assert centre_deflection(100.0, 1e4, 8.38e-8, 5.193e-10) < centre_deflection(100.0, 0.0, 8.38e-8, 5.193e-10)
