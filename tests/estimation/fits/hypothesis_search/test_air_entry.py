"""Air that enters the oil during a log: when, how much, and bulk modulus before it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import AIR_MIDWAY, HYPOTHESES
from estimation.fits.hypothesis_search.lost_flow import NO_CHANGE, likeliest_entry, likeliest_step
from estimation.fits.hypothesis_search.predicted_gains import AIR_SHARE, by_predicted_gain
from estimation.fits.hypothesis_search.wide_log import usual_values, widened_log
from estimation.log_checks.clean import clean_log
from estimation.notes import RigCode
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import run
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.thinned import thinned

PAPER, MACHINE = EhaParameters(), Machine(quadratic=1.1e6, linear=0.0, coulomb=490.0)


@cache
def logged(air: float, *, at: float = 2.0, lasting: float = 0.5) -> Record:
    """Return five seconds of an actuator whose oil takes in ``air`` per unit of oil."""
    time = 1e-3 * np.arange(5000)
    course = np.ones((len(time), 5))
    course[:, 0] = 110.0 * np.sin(2.0 * np.pi * time) + 60.0 * np.sin(5.2 * np.pi * time)
    course[:, 3] = air * np.clip((time - at) / lasting, 0.0, 1.0)
    frame = Logger().log(run(MACHINE, course), np.random.default_rng(3))
    return Record(1e-3, {name: frame[name].to_numpy() for name in PLAIN_CHANNELS})


def seen(record: Record) -> GreyBoxLog:
    sound, variances = without_strays(record)
    return widened_log(flow_log(sound, PAPER, {}, variances), PAPER)


def test_lost_flow_shows_when_air_enters() -> None:
    entry = likeliest_entry(seen(logged(0.03)))
    assert entry.share > AIR_SHARE
    assert entry.at == pytest.approx(0.45, abs=0.06)  # the middle of an entry that lasts half a second


@pytest.mark.parametrize("course", ["none", "throughout"])
def test_oil_with_constant_air_content_shows_no_air_entry(course: str) -> None:
    log = logged(0.0) if course == "none" else logged(0.02, at=-1.0)
    assert likeliest_entry(seen(log)).share < AIR_SHARE


def test_a_dead_pressure_sensor_shows_no_change() -> None:
    log = seen(logged(0.0))
    dead = replace(log, measured=np.full_like(log.measured, np.nan))
    assert likeliest_entry(dead) == likeliest_step(dead) == NO_CHANGE


def test_air_entry_is_tested_first_if_lost_flow_shows_it() -> None:
    log = seen(logged(0.03))
    likely, others, _ = by_predicted_gain(log, (), {**usual_values(log), "case_leakage": 1e-13}, HYPOTHESES)
    assert likely[0] is AIR_MIDWAY
    assert AIR_MIDWAY not in others


@pytest.mark.parametrize(("at", "lasting"), thinned([(2.0, 0.5), (3.0, 0.1)], [(2.0, 0.5)]))
def test_air_entry_is_identified_with_its_time_and_bulk_modulus_is_right(at: float, lasting: float) -> None:
    clean = clean_log(logged(0.03, at=at, lasting=lasting), PAPER)
    fit = fit_flow(clean.record, PAPER, PAPER.bulk_modulus, {}, clean.variances)
    assert fit.explanation is not None
    assert not fit.reasons
    (note,) = notes_of(fit.explanation, PAPER)
    assert note.code is RigCode.AIR_ENTERS
    assert note.data["percent_of_log"] == pytest.approx(20.0 * at, abs=0.2)
    assert fit.explanation.values["air_width"][0] == pytest.approx(lasting / 5.0, rel=0.1)
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - MACHINE.bulk_modulus) < std
    # the rate at which bubbles yield is not known; in the first log a delay that is hardly chance is doubted as well
    assert 2e-3 < std / value < 4e-3
