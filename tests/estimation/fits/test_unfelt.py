"""An unknown whose unit has no effect may still vary by many units, and then makes others uncertain."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.log import MOST_LEAD
from estimation.fits.greybox.fit import LEAST_EFFECT, Asked, GreyBoxFit, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.models.flow import FLOW_FORM
from tests.estimation.fits.short_logs import PAPER, WORN, log, seen

BULK_MODULUS = "bulk_modulus"


def fitted(lead_std: float, late: int = 0) -> GreyBoxFit:
    """Return the fit of a log with few samples of pressure, for a prior deviation of the motor's lead.

    Pressure is late by ``late`` samples.
    """
    record = log(2.0)
    pressure = np.roll(record["differential_pressure_pa"], late)
    pressure = np.where(np.arange(len(record)) % 10 == 0, pressure, np.nan)
    sparse = seen(record.replace(differential_pressure_pa=pressure), PAPER)
    sparse = replace(sparse, presumed={**sparse.presumed, "speed_lead": (0.0, lead_std)})
    problem = FreedProblem.of(FLOW_FORM, sparse)
    values = {"makeup_conductance": 1e-9, "makeup_opening": 1e3, "case_leakage": 1e-13, "speed_lead": 1e-5}
    values |= {name: getattr(WORN, name) for name in (BULK_MODULUS, "leakage_coefficient", "flow_bias")}
    return fit_at_solution(problem, problem.at(problem.model.theta(values)), asked=Asked(disturbed=late > 0))


def test_a_motor_lead_with_little_effect_per_unit_widens_the_deviation_of_bulk_modulus() -> None:
    free, held = fitted(25.0), fitted(1e-6)
    place = free.model.unknowns.index("speed_lead")
    assert np.linalg.norm(free.slopes[:, place]) < LEAST_EFFECT
    assert np.isinf(free.std["speed_lead"])
    assert free.std[BULK_MODULUS] > 1.1 * held.std[BULK_MODULUS]


def test_the_prior_deviation_of_the_motor_lead_is_proportional_to_the_sample_time() -> None:
    for sample_time in (1e-3, 2e-3):
        value, std = seen(log(1.0, sample_time)).presumed["speed_lead"]
        assert value == 0.0
        assert std * dict(FLOW_FORM.linear)["speed_lead"] == pytest.approx(MOST_LEAD * sample_time)


def test_a_motor_lead_with_little_effect_per_unit_does_not_absorb_a_late_channel() -> None:
    """In the linear approximation it becomes negative: a pressure 2 ms late passed, with bulk modulus 2.3 % too low."""
    free, held = fitted(25.0, late=2), fitted(1e-6, late=2)
    place = free.model.unknowns.index("speed_lead")
    assert 0.0 < np.linalg.norm(free.slopes[:, place]) < LEAST_EFFECT
    assert held.late["motor_speed_rad_s"][1] > 10.0
    for channel, told in held.late.items():
        assert free.late[channel] == pytest.approx(told, rel=1e-3)


def test_a_limited_prior_of_a_barely_felt_make_up_valve_narrows_the_deviation_of_leakage() -> None:
    """Its logarithm was known to within e^30 or not at all, and the deviation of leakage differed fourfold with it."""
    sparse = seen(log(2.0), PAPER)
    values = {"makeup_conductance": 1e-13, "makeup_opening": 1e3, "case_leakage": 1e-13, "speed_lead": 1e-5}
    values |= {name: getattr(WORN, name) for name in (BULK_MODULUS, "leakage_coefficient", "flow_bias")}
    deviations: list[float] = []
    for within in (sparse.within, {"makeup_conductance": 30.0}):
        problem = FreedProblem.of(FLOW_FORM, replace(sparse, within=within))
        fit = fit_at_solution(problem, problem.at(problem.model.theta(values)), asked=Asked(disturbed=False))
        deviations.append(fit.std["leakage_coefficient"])
    assert 2.0 * deviations[0] < deviations[1]
