"""Bristles that are too stiff for the model's steps: no search begins and no fit ends there with such steps."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion.chatter import MOST_SHORTENED, QUICKEST, STIFFEST, bristle_limits, without_chatter
from estimation.fits.motion.fit import fit_motion
from estimation.fits.motion.search import MotionSearch
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.motion import MOTION_FORMS
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_names
from tests.estimation.fits.motion.test_fit import heard, searches_of, short_log

P = EhaParameters()
MASS = P.moving_mass


@pytest.fixture(scope="module")
def search() -> MotionSearch:
    return searches_of(heard(short_log(0.2)))[0]


def at(problem: FreedProblem, stiffness: float) -> np.ndarray:
    values = problem.model.values(np.zeros(len(problem.model.unknowns)))
    return problem.model.theta({**values, "bristle_stiffness": stiffness})


def test_the_largest_followed_bristle_stiffness_and_damping_match_the_model_steps(search: MotionSearch) -> None:
    limits = bristle_limits(search.whole.log, parameter_names(MOTION_FORMS[0].parameters))
    assert np.sqrt(limits["bristle_stiffness"][1] / MASS) == pytest.approx(STIFFEST)
    assert limits["bristle_damping"][1] / MASS == pytest.approx(QUICKEST)


def test_the_bristle_is_limited_for_the_first_descents_and_less_for_fits(search: MotionSearch) -> None:
    place = search.whole.model.unknowns.index("bristle_stiffness")
    assert np.exp(search.near[1][place]) == pytest.approx(MASS * STIFFEST**2)
    assert search.bounds[1][place] > search.near[1][place]


@pytest.mark.parametrize(("quicker", "times"), [(0.99, 1), (1.01, 2), (2.9, 3), (9.0, MOST_SHORTENED)])
def test_steps_at_piston_reversals_are_shortened_in_proportion_to_the_bristle_frequency(
    search: MotionSearch, quicker: float, times: int
) -> None:
    log = replace(search.whole.log, steps=np.where(np.arange(len(search.whole.log.steps)) % 3 == 0, 16, 4))
    problem = search.whole.on(log)
    found = without_chatter(problem, at(problem, MASS * (quicker * STIFFEST) ** 2))
    assert (found is problem) == (times == 1)
    np.testing.assert_array_equal(found.log.steps, np.where(log.steps == 16, 16 * times, 4))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_rounding_of_the_noise_variance_does_not_get_a_log_refused(seed: int) -> None:
    record = short_log(2.0, seed)
    noise = measurement_variances(record, ("motor_speed_rad_s",))["motor_speed_rad_s"]
    for place in range(4):
        variances = {"motor_speed_rad_s": noise * (1.0 + 1e-13 * place)}
        found = fit_motion(record, P, 2.0 * P.bulk_modulus, variances=variances)
        value, std = found.parameters["bulk_modulus"]
        assert found.reasons == ()
        assert found.chi_square < 0.95 < motion_fit.EXPLAINED
        assert abs(value - P.bulk_modulus) < min(2.0 * std, 0.01 * P.bulk_modulus)
