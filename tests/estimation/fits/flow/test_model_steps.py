"""Model steps whose error is smaller than the noise."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import without_strays
from estimation.fits.flow.model_steps import with_implicit_steps
from estimation.fits.flow.plain import FitStart, Logged, plain_fits
from plant.eha import simulate as simulate_module
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.circuit_start import under_pressure
from plant.eha.drives import chirp
from plant.eha.model import PARAMETER_NAMES, EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

PILOTED = CircuitParameters(
    pump_displacement=1.46e-6,
    piston_area=5.58e-3,
    chamber_volume=1.13e-4,
    moving_mass=127.0,
    bulk_modulus=5.3e8,
    leakage_coefficient=6.86e-10,
    flow_bias=5.33e-5,
    friction_quadratic=4.34e6,
    friction_linear=1.83e4,
    friction_coulomb=608.0,
    relief_pressure=5.98e6,
    relief_conductance=1.36e-9,
    accumulator_pressure=8.74e5,
    makeup_conductance=2.14e-9,
    makeup_opening=9.85e3,
    area_difference=0.227,
    volume_difference=0.193,
    pilot_share=1.17,
    stroke=0.0628,
    pump_crossport_leakage=5.4e-13,
    pump_case_leakage=2.5e-14,
    accumulator_gas=3.28e-4,
    accumulator_oil=3.28e-4,
    motor_lag=1.47e-2,
    motor_speed_per_volt=49.2,
    motor_speed_limit=394.0,
)
"""A leaky single rod of 84 mm; at no load each side in turn holds the other's make-up valve open."""

SPEED = 175.0
"""Amplitude of its motor's speed [rad/s]."""


def test_implicit_steps_explain_a_log_whose_usual_steps_chatter(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the usual steps such logs were refused: the residuals were the model's own error."""
    speed = chirp(1.0, 5e-4, SPEED, 0.5, 4.0)
    sensors, rng = replace(BENCH, pressure_noise=1500.0), np.random.default_rng(1)
    rod = EhaParameters(**{name: getattr(PILOTED, name) for name in PARAMETER_NAMES})
    # the rod is held until the log begins: a creep would need a start under pressure besides
    monkeypatch.setattr(simulate_module, "at_rest", lambda p: under_pressure(0.0, 0.0, p))
    logged = Logged(*without_strays(simulate(CIRCUIT, speed, 5e-4, PILOTED, sensors=sensors, rng=rng)))
    plain = plain_fits(logged, FitStart(rod, rod.bulk_modulus))
    assert not plain.explains(plain.best)
    start = with_implicit_steps(plain)
    assert start is not None
    followed = plain_fits(logged, start)
    assert followed.explains(followed.best)
    assert with_implicit_steps(followed) is None
    monkeypatch.setattr(flow_fit, "plain_fits", lambda _, start: followed if start.implicit else plain)
    assert fit_flow(logged.record, rod, rod.bulk_modulus, {}, logged.variances).chi_square < 1.2
