"""Small pump ripple is integrated out: its shift, its share of the interval, and a value for a log that has some."""

from functools import cache

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.greybox.pump_ripple import LEAST_TEETH, Ripple, ShownRipple
from estimation.fits.greybox.small_pump_ripple import SMALL_STD, small_pump_ripple, with_shifts
from estimation.fits.hypothesis_search.pump_ripple_fits import with_ripple_test
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import run
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER

NAMES = ["bulk_modulus", "leakage_coefficient"]
ANSWERS = np.array([[2.0, 0.0], [0.0, -1.0]])


def shown(cosine: float, std: float, offset: float = 0.0) -> dict[int, ShownRipple]:
    power = np.eye(2) / std**2
    gain = 0.5 * (cosine / std) ** 2
    return {11: ShownRipple(Ripple(11, cosine, 0.0), gain, std, np.zeros(2), offset, 0.0, power, ANSWERS)}


def test_a_ripple_that_the_log_determines_shifts_the_unknowns_as_if_it_were_fitted() -> None:
    moved, variance = small_pump_ripple(shown(0.02, 1e-3), NAMES)
    assert moved["bulk_modulus"] == pytest.approx(-2.0 * 0.02, rel=0.01)
    assert moved["leakage_coefficient"] == pytest.approx(0.0, abs=1e-12)
    assert variance["bulk_modulus"] == pytest.approx((2.0 * 1e-3) ** 2, rel=0.02)
    assert variance["leakage_coefficient"] == pytest.approx(1e-6, rel=0.02)


def test_an_insignificant_ripple_hardly_shifts_the_unknowns() -> None:
    moved, variance = small_pump_ripple(shown(1e-3, 1e-3), NAMES)
    assert abs(moved["bulk_modulus"]) < 1e-5
    assert variance["bulk_modulus"] < (2.0 * 1e-4) ** 2


def test_a_ripple_that_the_log_does_not_determine_adds_less_than_its_prior_variance() -> None:
    moved, variance = small_pump_ripple(shown(0.5, 1.0), NAMES)
    assert abs(moved["bulk_modulus"]) < 1e-3
    assert 0.0 < variance["bulk_modulus"] < (2.0 * SMALL_STD) ** 2


def test_a_ripple_that_needs_a_speed_offset_causes_no_shift() -> None:
    moved, variance = small_pump_ripple(shown(0.02, 1e-3, offset=0.3), NAMES)
    assert moved == dict.fromkeys(NAMES, 0.0)
    assert variance == dict.fromkeys(NAMES, 0.0)


def test_bulk_modulus_is_shifted_and_widened_and_the_motor_lead_is_not() -> None:
    found = {"bulk_modulus": (2e8, 3e5), "speed_lead": (1e-5, 1e-6)}
    told = with_shifts(found, ({"bulk_modulus": 0.01, "speed_lead": 1.0}, {"bulk_modulus": 4e-6, "speed_lead": 1}))
    assert told["bulk_modulus"] == pytest.approx((2e8 * np.exp(0.01), 5e5))
    assert told["speed_lead"] == found["speed_lead"]


def test_a_shift_beyond_the_linear_range_widens_the_deviation_and_keeps_the_value() -> None:
    found = with_shifts({"bulk_modulus": (2e8, 0.0)}, ({"bulk_modulus": 800.0}, {"bulk_modulus": 4.0}))
    assert found == {"bulk_modulus": (2e8, 4e8)}


@cache
def logged(ripple: float) -> Record:
    """Return a log at 2 kHz of a leaky actuator that is driven slowly, and whose pump has 11 teeth."""
    machine = Machine(leakage=6.0 * Machine().leakage, teeth=11.0, ripple=ripple)
    time = 1e-3 * np.arange(4000)
    course = np.ones((len(time), 5))
    course[:, 0] = 60.0 * np.sin(np.pi * time) + 40.0 * np.sin(2.6 * np.pi * time)
    course[:, 3] = 0.0
    log = Logger(sample_time=5e-4).log(run(machine, course), np.random.default_rng(5))
    return Record(5e-4, {name: log[name].to_numpy() for name in PLAIN_CHANNELS})


def test_small_ripple_does_not_bias_bulk_modulus(monkeypatch: pytest.MonkeyPatch) -> None:
    ripple = 0.8 * LEAST_TEETH
    (value, std), (found, _) = (fit_flow(logged(one), PAPER, 2e8).parameters["bulk_modulus"] for one in (0.0, ripple))
    monkeypatch.setattr("estimation.fits.flow.fit.with_shifts", lambda given, *_: given)
    monkeypatch.setattr("estimation.fits.hypothesis_search.pump_ripple_fits.MOST_LINEAR", np.inf)
    left, _ = fit_flow(logged(ripple), PAPER, 2e8).parameters["bulk_modulus"]
    assert abs(found - value) < 0.5 * std < abs(left - value)


def test_ripple_is_not_tested_in_a_log_with_gaps_in_speed() -> None:
    sound, variances = without_strays(logged(0.0))
    log = flow_log(sound, PAPER, {}, variances)
    assert with_ripple_test(log).counts
    speed = logged(0.0)["motor_speed_rad_s"].copy()
    speed[2000:2400] = np.nan
    gone = flow_log(sound.replace(motor_speed_rad_s=speed), PAPER, {}, variances)
    assert gone.gaps.size
    assert not with_ripple_test(gone).counts
