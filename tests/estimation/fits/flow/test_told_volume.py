"""Bulk modulus if the log shows the volume of the chambers."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.eha.rig_share import fitted_responses
from estimation.fits.flow.told_volume import RATIO_ENTRIES, determines_volume, explained_bound, ratio_doubt
from estimation.fits.hypotheses import VOLUME
from plant.eha.doubts import DEFAULT_UNCERTAINTIES, PRESSURE_GAIN

SLOPES = {"pump_displacement": {"bulk_modulus": 4e9}, "chamber_volume": {"bulk_modulus": 2e8}}


def explained(*names: str, deviation: float = 1e-3, std: float = 1e7, slopes: Any = SLOPES) -> Any:
    fit = SimpleNamespace(values={"bulk_modulus": 2e8}, std={"bulk_modulus": std}, rig_slopes=slopes)
    return SimpleNamespace(names=names, fit=fit, delivery_open=SimpleNamespace(deviation=deviation))


def test_the_bound_of_a_log_that_shows_chamber_volume_is_that_with_a_known_volume() -> None:
    known: Any = SimpleNamespace(values={"bulk_modulus": 2e8}, std={"bulk_modulus": 1e5})
    assert explained_bound(explained(VOLUME.name), known) == pytest.approx(5e-4)
    assert explained_bound(explained("encoder_zero"), known) == pytest.approx(0.05)
    assert not determines_volume(None)


def test_the_remaining_doubt_of_displacement_over_area_is_in_the_interval() -> None:
    usual = {name: DEFAULT_UNCERTAINTIES[name].usual.up for name in RATIO_ENTRIES}
    assert ratio_doubt(explained(VOLUME.name), usual) == pytest.approx(20.0 * 1e-3)
    for file in (usual, {"pump_displacement": 0.1}, {"piston_area": 0.02}):
        doubt = sum(one**2 for one in file.values()) ** 0.5
        assert ratio_doubt(explained(VOLUME.name, deviation=1.0), file) == pytest.approx(20.0 * doubt)
    assert ratio_doubt(explained("encoder_zero"), usual) == ratio_doubt(explained(VOLUME.name, slopes={}), usual) == 0.0


def test_the_area_carries_the_doubt_of_the_ratio_if_displacement_is_measured() -> None:
    slopes = {"piston_area": {"bulk_modulus": -4e9}}
    doubt = ratio_doubt(explained(VOLUME.name, deviation=1.0, slopes=slopes), {"piston_area": 0.02})
    assert doubt == pytest.approx(20.0 * 0.02)


@pytest.mark.parametrize(
    ("name", "entries"), [(VOLUME.name, {PRESSURE_GAIN}), ("encoder_zero", {PRESSURE_GAIN, *SLOPES})]
)
def test_bulk_modulus_responds_to_pressure_gain_alone_if_the_log_shows_the_volume(name: str, entries: set[str]) -> None:
    fit: Any = SimpleNamespace(parameters={"bulk_modulus": (2e8, 1e6)}, rig_slopes=SLOPES, explanation=explained(name))
    assert set(fitted_responses(fit)["bulk_modulus"]) == entries
