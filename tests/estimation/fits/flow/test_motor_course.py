"""Whether the motor's command is held between samples is read from the log if it has an effect."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow import motor_course, search
from estimation.fits.flow.log import without_strays
from estimation.fits.flow.motor_course import NEARLY_EXPLAINED, with_motor_course, with_open_turns
from estimation.fits.flow.plain import FitStart, Logged, PlainFits, plain_fits
from estimation.fits.greybox.pump_ripple import NO_RIPPLE
from plant.eha.circuit_parameters import circuit_of
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.fits.short_logs import PAPER, POSITION, PRESSURE, SPEED, log, made_fit, seen

STIFF = replace(PAPER, bulk_modulus=1.4e9)

FINE = 10
"""Simulation steps between two samples [count]."""


def logged(*, held: bool) -> Logged:
    """Return a log of a motor that follows a fast command, held from sample to sample or not."""
    rng, time = np.random.default_rng(2), np.arange(3000.0 * FINE) / FINE
    tones = 2.0 * np.pi * np.array([0.011, 0.023, 0.041, 0.061])
    waves = [np.sin(tone * (np.floor(time) if held else time) + k) for k, tone in enumerate(tones)]
    sensors = replace(BENCH, pressure_noise=1e3, pressure_quantum=0.0, speed_noise=0.01)
    record = simulate(CIRCUIT, 40.0 * np.sum(waves, axis=0), 1e-3 / FINE, circuit_of(STIFF), sensors=sensors, rng=rng)
    sampled = {name: record[name][::FINE] for name in (SPEED, POSITION, PRESSURE)}
    return Logged(*without_strays(Record(1e-3, sampled)))


@pytest.mark.parametrize("held", [False, True])
def test_a_held_motor_command_is_detected_from_the_log(held: bool) -> None:
    log = logged(held=held)
    plain = plain_fits(log, FitStart(STIFF, STIFF.bulk_modulus))
    found = with_motor_course(log, plain)
    assert found.start.held is held
    error = found.swinging.values["bulk_modulus"] / STIFF.bulk_modulus - 1.0
    assert abs(error) < 2e-3


def test_the_fit_with_a_held_command_begins_at_the_smooth_fit_if_bends_can_gain_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both fits of a log were searched from the start, which took a third of the time of an estimate."""
    log = logged(held=True)
    plain = plain_fits(log, FitStart(STIFF, STIFF.bulk_modulus))
    whole = with_motor_course(log, plain)
    monkeypatch.setattr(search, "rough_optima", lambda *_: pytest.fail("it was searched anew"))
    with pytest.raises(pytest.fail.Exception, match="searched anew"):
        with_motor_course(log, plain)
    monkeypatch.setattr(motor_course, "RESTART_GAIN", 1e3)
    known = {fit.model.name: fit for fit in with_motor_course(log, plain).fits}  # also the fits that are far behind
    for fit in whole.fits:
        assert known[fit.model.name].cost < fit.cost + 0.05
        for name in ("bulk_modulus", "leakage_coefficient"):
            assert known[fit.model.name].values[name] == pytest.approx(fit.values[name], abs=0.05 * fit.std[name])


@pytest.mark.parametrize(
    ("left", "felt", "then", "opened"),
    [
        (2.0, True, 1.0, True),
        (2.0, True, 1.9, False),  # turns do not explain it either
        (2.0, False, 1.0, False),
        (1.1, True, 1.0, False),  # the log is already explained
        (NEARLY_EXPLAINED + 0.1, True, 1.0, False),
    ],
)
def test_turns_are_freed_only_in_a_log_that_nothing_else_explains(
    monkeypatch: pytest.MonkeyPatch, left: float, felt: bool, then: float, opened: bool
) -> None:
    """Tried before the gains of two gauges, free turns absorbed the effect of these gains."""

    def fits(chi: float, start: FitStart) -> PlainFits:
        fit, bare = made_fit(500.0 * chi, 2e8, 1e5, chi=chi), seen(log(0.2))
        explains = [fit].__contains__ if chi < 1.44 else lambda _: False
        return PlainFits(start, (), lambda _: [fit], bare, bare, [fit], explains, (), (), NO_RIPPLE)

    monkeypatch.setattr(motor_course, "_turns_matter", lambda _: felt)
    monkeypatch.setattr(motor_course, "plain_fits", lambda _, start: fits(then, start))
    plain = fits(left, FitStart(PAPER, PAPER.bulk_modulus))
    found = with_open_turns(Logged(log(0.2), {}), plain)
    assert found.start.turns_open is opened
    assert (found is plain) is not opened


def test_a_held_command_is_not_tested_if_bends_move_pressure_by_less_than_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The test took two runs of the model for each log, and chance had some logs fitted twice."""

    def asked(*_: object) -> float:
        raise AssertionError

    monkeypatch.setattr(motor_course, "_held_gains", asked)
    soft = Logged(*without_strays(log(2.0)))
    plain = plain_fits(soft, FitStart(PAPER, PAPER.bulk_modulus))
    assert with_motor_course(soft, plain) is plain
    stiff = logged(held=True)
    with pytest.raises(AssertionError):
        with_motor_course(stiff, plain_fits(stiff, FitStart(STIFF, STIFF.bulk_modulus)))


def test_a_fast_log_that_is_averaged_differently_under_a_held_command_keeps_its_fit() -> None:
    """Corners of motor speed decide how many samples are averaged: such a log caused an internal error."""
    plain = plain_fits(Logged(*without_strays(log(0.3))), FitStart(PAPER, PAPER.bulk_modulus))
    halved = Logged(*without_strays(log(0.3).slice(0, 150)))
    assert with_motor_course(halved, plain) is plain
