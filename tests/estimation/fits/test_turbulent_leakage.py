"""Leakage with the square root of pressure, as through a worn edge, leaves bulk modulus right and is named."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.hypotheses import LEAKAGE_RISE, LEAKAGE_TURBULENT
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem
from estimation.log_checks.clean import clean_log
from estimation.models.wide_flow import (
    LAMINAR_BELOW,
    QUICK_FLOW_FORM,
    QUICKNESS,
    TURBULENT_AT,
    TURBULENT_FLOW_FORM,
    TURBULENT_QUICK_FLOW_FORM,
    WIDE_FLOW_FORM,
    turbulent_leakage,
)
from estimation.notes import RigCode
from experiments.open_benchmark.draws import course_of, draw_plain
from experiments.open_benchmark.run import run
from plant.eha.model import EhaParameters
from plant.log.record import Record

RIG = EhaParameters()
SHARE = 0.3


def leaking(share: float) -> tuple[Record, float, float]:
    """Return six seconds of an actuator with other equations, of whose leakage a share is turbulent at 5 bar.

    Its bulk modulus [Pa] and its leakage [m^3/(s Pa)] are returned too.
    """
    drawing, driving, logging = np.random.default_rng(3).spawn(3)
    drawn = draw_plain("minor_leakage_minor_friction", "prbs", drawing).with_machine(turbulent=share)
    setup = replace(drawn, duration=6.0)
    log = setup.logger.log(run(setup.machine, course_of(setup, driving)), logging)
    return Record.from_frame(log), setup.machine.bulk_modulus, setup.machine.leakage


def test_a_turbulent_share_of_leakage_is_identified_and_bulk_modulus_is_right() -> None:
    record, modulus, leakage = leaking(SHARE)
    log = clean_log(record, RIG)
    fit = fit_flow(log.record, RIG, RIG.bulk_modulus, {}, log.variances)
    found = fit.explanation
    assert found is not None
    assert not fit.reasons
    (value, std), (share, share_std) = fit.parameters["bulk_modulus"], found.values["leakage_turbulent"]
    assert abs(value - modulus) < 3.0 * std
    assert std < 0.01 * modulus
    assert abs(share - SHARE) < max(3.0 * share_std, 0.03)
    assert fit.parameters["leakage_coefficient"][0] == pytest.approx(leakage, rel=0.03, abs=0.0)
    (note,) = notes_of(found, RIG)
    assert note.code is RigCode.LEAKAGE_TURBULENT
    assert note.data["percent"] == pytest.approx(100.0 * share)


def test_turbulent_leakage_follows_the_orifice_law_at_high_pressure_and_is_laminar_at_low() -> None:
    pressures = TURBULENT_AT * np.array([1.0, 4.0, 16.0])
    assert turbulent_leakage(pressures, 1.0) == pytest.approx([1.0, 0.5, 0.25], rel=1e-3)
    assert turbulent_leakage(pressures, 0.0) == pytest.approx(1.0)
    low = turbulent_leakage(LAMINAR_BELOW * np.array([0.0, 1e-3]), 0.3)
    assert low[1] == pytest.approx(low[0], rel=1e-6)


def test_the_form_computes_roots_and_powers_only_if_a_hypothesis_needs_them() -> None:
    record, *_ = leaking(0.0)
    sound, variances = without_strays(record)
    log = widened_log(flow_log(sound, RIG, {}, variances), RIG)
    asked, turbulent = (LEAKAGE_RISE,), (LEAKAGE_RISE, LEAKAGE_TURBULENT)
    assert hypothesis_problem(log, asked).model.rates is WIDE_FLOW_FORM.rates
    assert hypothesis_problem(log, turbulent).model.rates is TURBULENT_FLOW_FORM.rates
    assert hypothesis_problem(log, asked, QUICKNESS).model.rates is QUICK_FLOW_FORM.rates
    assert hypothesis_problem(log, turbulent, QUICKNESS).model.rates is TURBULENT_QUICK_FLOW_FORM.rates
