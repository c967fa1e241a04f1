"""A seal that fails during a log: bulk modulus, both leakages and the time."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.greybox.fit import Asked, fit_at_solution
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import LEAKAGE_STEP
from estimation.fits.hypothesis_search.lost_flow import likeliest_step
from estimation.fits.hypothesis_search.predicted_gains import STEP_SHARE
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem
from estimation.log_checks.clean import clean_log
from estimation.models.completed_flow import CRACKS
from estimation.models.wide_flow import WideFlowParameters, stepped_leakage
from estimation.notes import RigCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_names

HEALTHY = EhaParameters()


@cache
def stepping(factor: float, at: float = 2.0, before: float = 1.0) -> Record:
    """Return five seconds in which leakage steps to ``factor`` times a healthy one."""
    rng = np.random.default_rng(7)
    first, last = (replace(HEALTHY, leakage_coefficient=n * HEALTHY.leakage_coefficient) for n in (before, factor))
    path = ParameterPath((0.0, at), (circuit_of(first), circuit_of(last)))
    return simulate(CIRCUIT, make_drive("multisine", 5.0, 1e-3, HEALTHY, rng), 1e-3, path, sensors=BENCH, rng=rng)


def seen(record: Record) -> GreyBoxLog:
    sound, variances = without_strays(record)
    return widened_log(flow_log(sound, HEALTHY, {}, variances), HEALTHY)


def test_lost_flow_shows_the_time_and_size_of_a_leakage_step() -> None:
    step = likeliest_step(seen(stepping(6.0)))
    assert step.share > STEP_SHARE
    assert step.at == pytest.approx(0.4, abs=0.01)
    assert step.before / step.after == pytest.approx(1.0 / 6.0, abs=0.3)
    assert step.after == pytest.approx(6.0 * HEALTHY.leakage_coefficient, rel=0.1)


def test_apparently_negative_leakage_before_a_step_counts_as_a_tight_seal() -> None:
    """Small rigs leak so little that noise makes leakage negative, and only times with positive leakage were tried."""
    log = seen(stepping(6.0, before=1e-3))
    parameters = log.parameters.copy()
    parameters[parameter_names(WideFlowParameters).index("pump_displacement")] *= 0.7
    step = likeliest_step(replace(log, parameters=parameters))
    assert step.share > STEP_SHARE
    assert step.at == pytest.approx(0.4, abs=0.01)
    assert step.before == 0.0


def test_a_gap_in_pressure_does_not_shift_the_time_of_a_leakage_step() -> None:
    """With three of ten pieces missing, it was reported at 0.2 instead of 0.4."""
    log = seen(stepping(6.0))
    measured = log.measured.copy()
    measured[round(0.1 * len(measured)) : round(0.3 * len(measured))] = np.nan
    assert likeliest_step(replace(log, measured=measured)).at == pytest.approx(0.4, abs=0.02)


def test_constant_leakage_shows_no_step() -> None:
    assert likeliest_step(seen(stepping(1.0))).share < STEP_SHARE


def test_a_failing_seal_is_identified_and_bulk_modulus_is_right() -> None:
    clean = clean_log(stepping(6.0), HEALTHY)
    fit = fit_flow(clean.record, HEALTHY, HEALTHY.bulk_modulus, {}, clean.variances)
    assert fit.explanation is not None
    assert not fit.reasons
    (note,) = notes_of(fit.explanation, HEALTHY)
    assert note.code is RigCode.LEAKAGE_STEPS
    assert note.data["percent_of_log"] == pytest.approx(40.0, abs=0.2)
    assert note.data["within_percent"] < 1.0
    assert note.data["last"] / note.data["first"] == pytest.approx(6.0, rel=0.05)
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - HEALTHY.bulk_modulus) < 3.0 * std


def test_cracking_pressures_widen_the_interval_of_bulk_modulus_beside_a_leakage_step() -> None:
    """Held at their values in the plain form, they made intervals too narrow."""
    log = seen(stepping(6.0))
    values = {"leakage_before": 1.0 / 6.0 - 1.0, "step_at": 0.4, "step_width": 1e-3, **dict.fromkeys(CRACKS, 0.0)}
    values |= {"makeup_conductance": 1e-9, "makeup_opening": 1e3, "case_leakage": 1e-13, "speed_lead": 1e-5}
    values |= {name: getattr(HEALTHY, name) for name in ("bulk_modulus", "flow_bias")}
    values |= {"leakage_coefficient": 6.0 * HEALTHY.leakage_coefficient}
    stds: list[float] = []
    for one in (LEAKAGE_STEP, replace(LEAKAGE_STEP, beside=())):
        problem = hypothesis_problem(log, (one,))
        fit = fit_at_solution(problem, problem.at(problem.model.theta(values)), asked=Asked(disturbed=False))
        stds.append(fit.std["bulk_modulus"])
    assert stds[0] > 1.2 * stds[1]


def test_leakage_rises_linearly_over_the_step_to_its_final_value() -> None:
    elapsed = np.array([0.0, 0.3, 0.375, 0.4, 0.425, 0.5, 1.0])
    assert stepped_leakage(elapsed, -0.8, 0.4, 0.1) == pytest.approx([0.2, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0])
