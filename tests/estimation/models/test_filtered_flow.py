"""The wide flow form with a second-order pressure filter."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.models.filtered_flow import FILTERED_FLOW_FORM
from estimation.models.wide_flow import WIDE_FLOW_FORM, WideFlowParameters
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.fits.short_logs import PRESSURE, log


def test_a_pressure_filter_changes_the_reading_and_not_the_circuit() -> None:
    p = WideFlowParameters(pressure_lag=4e-3, filter_time=3e-3, pressure_offset=2e4)
    still = ((0.0, 0.0),) * 4
    drives = ((100.0, 100.0), (0.0, 0.0), (0.5, 0.5), (0.0, 0.0), *still, 1e-3)
    circuit, climbs, behind = (9e5, 3e5), 5e6, 1e5
    wide = WIDE_FLOW_FORM.rates((*circuit, behind, 4e5), drives, SimpleNamespace(**vars(p)), 0.0)
    rates = FILTERED_FLOW_FORM.rates((*circuit, behind, 4e5, climbs), drives, SimpleNamespace(**vars(p)), 0.0)
    assert (rates[0], rates[1], rates[3]) == (wide[0], wide[1], wide[3])
    assert rates[2] == pytest.approx(rates[0] - rates[1] - climbs)
    assert p.filter_time**2 * rates[4] + p.pressure_lag * climbs == pytest.approx(behind + 2e4)


def test_a_30_hz_butterworth_filter_and_the_bulk_modulus_are_found_together() -> None:
    """With a delay of whole milliseconds and a lag instead, bulk modulus was up to five deviations off."""
    plain = log(1.0, p=EhaParameters(), drive="prbs")
    over, under = butter(2, 30.0, fs=1e3)
    read = np.asarray(lfilter(over, under, plain[PRESSURE])) + 5e3 * np.random.default_rng(1).standard_normal(
        len(plain)
    )
    found = estimate_bulk_modulus(Record(1e-3, {**plain.channels, PRESSURE: read}), EhaParameters())
    assert found.explanation is not None
    assert found.explanation.names == ("pressure_late",)
    values = found.explanation.values
    assert values["filter_time"][0] == pytest.approx(1.0 / (2.0 * np.pi * 30.0), rel=0.1)
    assert values["pressure_lag"][0] == pytest.approx(2.0**0.5 / (2.0 * np.pi * 30.0), rel=0.1)
    assert found.value is not None
    assert found.value == pytest.approx(EhaParameters().bulk_modulus, rel=0.01)
