"""Channels that are slightly late or early, and a speed that leads position and pressure."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.eha.explanation_notes import corrected_log, notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.lateness import (
    BY_CHANCE,
    LATE_NUDGE,
    LEAD,
    LEAST_LATE,
    late_and_play,
    latest_channel,
    omitted_delay_doubt,
    residuals_and_changes,
)
from estimation.fits.hypotheses import LATEST
from estimation.log_checks.clean import clean_log
from estimation.notes import RigCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import circuit_of
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import problem, usual
from tests.estimation.fits.strange_logs import HEALTHY, PRESSURE, SPEED, explained, log
from tests.thinned import thinned

SENSORS = replace(BENCH, pressure_noise=0.0, position_noise=2e-6)


def test_the_latest_channel_is_the_one_that_gains_most_if_its_delay_is_plausible() -> None:
    late = {"motor_speed_rad_s": (-3e-3, 12.0), "position_m": (1e-3, 9.0)}
    assert latest_channel(late) == ("motor_speed_rad_s", -3e-3, 12.0)
    assert latest_channel({}) == ("", 0.0, 0.0)
    for behind, gain in ((0.9 * LEAST_LATE, 0.0), (1.1 * LEAST_LATE, 30.0), (-0.9 * LATEST, 30.0), (1.1 * LATEST, 0.0)):
        assert latest_channel({"position_m": (behind, 30.0)}) == ("position_m", behind, gain)


def test_a_speed_ahead_of_position_and_pressure_is_identified_and_shifted_back() -> None:
    record = log()
    ahead = np.concatenate([record[SPEED][3:], np.full(3, record[SPEED][-1])])
    given = record.replace(**{SPEED: ahead})
    found = explained(given)
    assert found.names == ("speed_early",)
    (note,) = notes_of(found, HEALTHY)
    assert note.code is RigCode.INPUT_EARLY
    assert note.data["early_ms"] == pytest.approx(3.0, abs=0.1)
    back = corrected_log(clean_log(given, HEALTHY), found).record[SPEED]
    assert np.std((back - record[SPEED])[:-3]) < 0.1 * np.std(ahead - record[SPEED])


def test_a_position_late_by_half_a_millisecond_is_identified() -> None:
    record = log(duration=3.0)
    rows = np.arange(len(record))
    given = record.replace(position_m=np.interp(rows - 0.5, rows, record["position_m"]))
    fit = fit_flow(given, HEALTHY, HEALTHY.bulk_modulus)
    assert fit.explanation is not None
    assert fit.explanation.names == ("position_late",)
    assert notes_of(fit.explanation, HEALTHY)[0].data["late_ms"] == pytest.approx(0.5, abs=0.25)
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - HEALTHY.bulk_modulus) < 2.0 * std


TIGHT = EhaParameters(
    pump_displacement=3.756e-7,
    piston_area=1.6344e-3,
    chamber_volume=2.895e-4,
    moving_mass=37.5,
    bulk_modulus=7.6e8,
    leakage_coefficient=3.35e-13,
    flow_bias=2.27e-6,
    friction_quadratic=3.2e4,
    friction_linear=2300.0,
    friction_coulomb=402.0,
    relief_pressure=1.85e7,
    accumulator_pressure=4.5e5,
    motor_speed_per_volt=58.4,
    motor_speed_limit=467.5,
)
"""A tight actuator with small chambers: under major leakage compressed oil leaks off within 4 ms."""


def leaky(frequency: float, lag: float) -> Record:
    """Return a log of it under a sine at 1 kHz; each port drains 2 % of the leakage, and pressure lags [s]."""
    worn = parameters_for(CONDITIONS["major_leakage_minor_friction"], TIGHT)
    circuit = replace(circuit_of(worn), cylinder_drain_leakage=0.02 * worn.leakage_coefficient, pump_case_leakage=0.0)
    rng, time = np.random.default_rng(3), 1e-4 * np.arange(30_000)
    record = simulate(CIRCUIT, 200.0 * np.sin(2.0 * np.pi * frequency * time), 1e-4, circuit, sensors=SENSORS, rng=rng)
    kept = np.exp(-1e-4 / lag)
    late = lfilter([1.0 - kept], [1.0, -kept], record[PRESSURE])[::10]
    logged = {name: record[name][::10] for name in (SPEED, "position_m")}
    return Record(1e-3, {**logged, PRESSURE: late + 1.4e4 * rng.standard_normal(len(late))})


LAGS = [(4.0, 1e-6), (4.0, 8.5e-4), (8.0, 8.5e-4)]


@pytest.mark.parametrize(("frequency", "lag"), thinned(LAGS, LAGS[:2]))
def test_a_lag_that_looks_like_soft_oil_is_within_the_interval(frequency: float, lag: float) -> None:
    fit = fit_flow(leaky(frequency, lag), TIGHT, TIGHT.bulk_modulus)
    value, std = fit.parameters["bulk_modulus"]
    assert not fit.reasons
    assert abs(value - TIGHT.bulk_modulus) < 2.5 * std < 0.2 * TIGHT.bulk_modulus


def test_a_late_pressure_is_the_log_of_drives_that_are_all_early() -> None:
    one = problem()
    _, (speed, position, pressure, *_) = residuals_and_changes(one, usual(one), one.linearised(usual(one))[0])
    assert one.log.timed == (SPEED, "position_m", PRESSURE)
    np.testing.assert_allclose(pressure, -speed - position, atol=0.1 * float(np.abs(pressure).max()))


def test_a_delay_that_may_be_chance_is_no_doubt() -> None:
    assert omitted_delay_doubt({}) == 0.0
    assert omitted_delay_doubt({SPEED: (3e-4, 2.8, 0.2), PRESSURE: (2e-4, 3.0, -0.1)}) == 0.1


def test_the_lead_takes_up_a_late_speed_but_not_a_late_pressure() -> None:
    """A spring load and a ramp told 90 and 190 % of bulk modulus by delays of speed that gained 4 and 7: no number."""
    softness, rest, other = np.linalg.qr(np.random.default_rng(2).standard_normal((400, 3)))[0].T
    slopes = np.column_stack([softness, 0.9 * softness + 0.2 * rest])  # a ramp hardly tells a lead from soft oil
    change = 1e3 * LATE_NUDGE * (slopes[:, 1] + 1e-3 * other)
    asked: Any = SimpleNamespace(
        log=SimpleNamespace(timed=(SPEED, "position_m", PRESSURE)),
        model=SimpleNamespace(unknowns=("bulk_modulus", LEAD)),
    )
    known_of: Any = SimpleNamespace(
        felt=np.arange(2),
        left_over=3.0 * other,
        fitted_slopes=slopes,
        fitted_bread=np.linalg.inv(slopes.T @ slopes),
        response=lambda _: np.zeros(2),
    )
    late, _ = late_and_play(asked, known_of, 3 * [change[None]], np.array([True, True]))
    assert late[SPEED][:2] == late[PRESSURE][:2] == pytest.approx((-3.0, 4.5))
    assert late[SPEED][1] > BY_CHANCE
    assert abs(late[SPEED][2]) < 1e-6 * abs(late[PRESSURE][2])
