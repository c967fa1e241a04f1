"""Bulk modulus if the log shows the volume of the chambers."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.eha.rig_share import fitted_responses
from estimation.finding import NORMAL_95
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow.told_volume import (
    RATIO_ENTRIES,
    determines_volume,
    explained_bound,
    ratio_doubt,
    unlikely_volume,
    unlikely_volume_doubt,
)
from estimation.fits.hypotheses import VOLUME
from plant.eha.doubts import DEFAULT_UNCERTAINTIES, PRESSURE_GAIN
from tests.estimation.fits.short_logs import made_fit
from tests.estimation.fits.strange_logs import HEALTHY, log

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


def told(modulus: float) -> Any:
    values = {"chamber_volume": (0.5 * HEALTHY.chamber_volume, 1e-6), "bulk_modulus": (modulus, 1e6)}
    return SimpleNamespace(names=(VOLUME.name,), values=values)


def test_a_volume_that_is_not_believed_is_named_with_the_bulk_modulus_that_goes_with_it() -> None:
    (note,) = unlikely_volume(told(1e8), made_fit(1e3, 2e8, 1e6), HEALTHY.chamber_volume)
    assert note.data["percent"] == pytest.approx(50.0)
    assert note.data["modulus_percent"] == pytest.approx(-50.0)
    other: Any = SimpleNamespace(names=("delivery",), values={})
    assert unlikely_volume(other, made_fit(1e3, 2e8, 1e6), HEALTHY.chamber_volume) == ()


def test_the_interval_reaches_the_bulk_modulus_of_a_volume_that_is_not_believed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    record = log(duration=1.0)
    monkeypatch.setattr(flow_fit, "_asked", lambda *_: ((VOLUME,), ()))
    monkeypatch.setattr(flow_fit, "_ask", lambda *_: (None, ()))
    value, sure = flow_fit.fit_flow(record, HEALTHY, HEALTHY.bulk_modulus).parameters["bulk_modulus"]
    note = unlikely_volume(told(0.7 * value), made_fit(1e3, value, 1e6), HEALTHY.chamber_volume)
    monkeypatch.setattr(flow_fit, "_ask", lambda *_: (None, note))
    fit = flow_fit.fit_flow(record, HEALTHY, HEALTHY.bulk_modulus)
    again, std = fit.parameters["bulk_modulus"]
    assert again == value
    assert std == pytest.approx(unlikely_volume_doubt(note) * value, rel=0.01)
    assert value * (1.0 - NORMAL_95 * std / value) < 0.7 * value < value - NORMAL_95 * sure
    assert note[0] in fit.remarks
