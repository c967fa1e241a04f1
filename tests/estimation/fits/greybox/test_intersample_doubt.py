"""Uncertainty due to the motor's course between the samples of a slow log."""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest

from estimation.fits.flow import fit
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log import flow_log
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.intersample_doubt import IntersampleDoubt, turns
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.fits.hypothesis_search.between_samples import with_course
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.models.flow_parameters import flow_parameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row
from tests.thinned import thinned

HEALTHY = EhaParameters()
VARIANCES = {"motor_speed_rad_s": 2.5e-3, "position_m": 1e-13, "differential_pressure_pa": 2.5e7}


def logged(rate: int, seed: int) -> Record:
    rng = np.random.default_rng(seed)
    drive = make_drive("steps", 10.0, 1.0 / rate, HEALTHY, rng)
    return simulate(CIRCUIT, drive, 1.0 / rate, HEALTHY, sensors=BENCH, rng=rng)


def still(samples: int, noise: float) -> GreyBoxLog:
    """Return a log at rest with a sample every 5 ms."""
    drives, measured = np.zeros((samples, 2)), np.zeros((samples, 1))
    row, steps = parameter_row(flow_parameters(HEALTHY)), np.ones(samples, dtype=int)
    return GreyBoxLog(drives, measured, row, 5e-3, steps, (OutputNoise(noise**2),), (0.05, 0.0))


def test_a_speed_turns_if_its_second_difference_exceeds_noise() -> None:
    log = still(7, 1.0)
    log.drives[:, 0] = [0.0, 0.1, 0.0, 0.0, 10.0, 20.0, 30.0]
    assert turns(log) == pytest.approx([0.0, 0.0, 0.0, 9.8, 9.8, 0.0, 9.8])  # nothing follows the last rise


@pytest.mark.parametrize(("turned", "passes"), [([0.0, 5.0, 5.0, 0.01, 0.01, 3.0, 3.0], 2.0), ([0.0, 0.1], 1.0)])
def test_a_turn_between_two_samples_counts_once_if_it_exceeds_noise(turned: list[float], passes: float) -> None:
    assert IntersampleDoubt(np.array(turned)).turn_count(0.2) == pytest.approx(passes, rel=0.15)


def test_the_variance_of_a_block_sums_those_of_its_samples() -> None:
    course = IntersampleDoubt(np.array([0.0, 0.0, 3.0, 4.0, 1.0]))
    assert course.walk(5, 2).tolist() == [25.0, 1.0]
    assert course.beside(5, 2).tolist() == [9.0 / 4.0, 32.0 / 4.0, 1.0]
    assert course.walk(2, 2).tolist() == [0.0]


def test_a_log_of_1_khz_is_left_as_it_is() -> None:
    log = flow_log(logged(1000, 0), HEALTHY, {}, VARIANCES)
    assert with_course(log, lambda _: pytest.fail("it was fitted"), HEALTHY) is log


@cache
def fitted(rate: int, seed: int) -> tuple[FormFit, float]:
    """Return the fit of a log, and the divisor of log-likelihood differences between its balances."""
    tempers, original = list[float](), fit.weights_of

    def heard(fits: Sequence[GreyBoxFit], temper: float, priors: Sequence[float]) -> np.ndarray:
        tempers.append(temper)
        return original(fits, temper, priors)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit, "weights_of", heard)
        found = fit_flow(logged(rate, seed), HEALTHY, HEALTHY.bulk_modulus)
    (temper,) = tempers
    return found, temper


@pytest.mark.parametrize("seed", thinned([0, 4], [0]))
def test_bulk_modulus_of_a_log_of_200_hz_is_within_its_interval(seed: int) -> None:
    value, std = fitted(200, seed)[0].parameters["bulk_modulus"]
    assert abs(value - HEALTHY.bulk_modulus) < 2.5 * std
    assert std < 0.005 * value


def test_cost_differences_between_balances_count_less_in_a_slow_log() -> None:
    slow, fast = (fitted(rate, 0)[1] for rate in (200, 1000))
    assert fast == fit.BALANCE_TEMPER
    assert slow > 5.0 * fit.BALANCE_TEMPER


def test_a_steady_curvature_of_speed_is_not_a_turn() -> None:
    log = still(200, 1.0)
    log.drives[:, 0] = 500.0 * np.sin(0.05 * np.arange(200))
    bent = turns(log)[2:-2]
    assert np.mean(bent == 0.0) > 0.8
    assert np.max(bent) < 0.5 * np.max(np.abs(np.diff(log.drives[:, 0], n=2)))
