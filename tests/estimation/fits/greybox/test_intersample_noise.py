"""Uncertainty of the motor's course between the samples of a slow log."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.intersample_doubt import IntersampleDoubt
from estimation.fits.greybox.intersample_noise import likeliest_noise, restricted_likelihood_noise
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.models.flow import FLOW_FORM
from estimation.models.flow_parameters import flow_parameters
from plant.eha.model import EhaParameters
from plant.solvers.steps import parameter_row

HEALTHY = EhaParameters()


def still(samples: int, noise: float) -> GreyBoxLog:
    """Return a log at rest with a sample every 5 ms."""
    drives, measured = np.zeros((samples, 2)), np.zeros((samples, 1))
    row, steps = parameter_row(flow_parameters(HEALTHY)), np.ones(samples, dtype=int)
    return GreyBoxLog(drives, measured, row, 5e-3, steps, (OutputNoise(noise**2),), (0.05, 0.0))


@pytest.mark.parametrize(("staying", "passing"), [(0.1, 0.0), (0.0, 0.1)])
def test_lasting_and_passing_effects_of_turns_are_distinguished(staying: float, passing: float) -> None:
    rng, samples = np.random.default_rng(1), 4000
    log, course = (
        still(samples, 5e3),
        IntersampleDoubt(np.where(np.arange(samples) % 20 == 10, 4e5, 0.0), staying, passing),
    )
    walked = np.cumsum(rng.standard_normal(samples) * np.append(0.0, course.walk(samples, 1) ** 0.5))
    beside = rng.standard_normal(samples) * course.beside(samples, 1) ** 0.5
    log.measured[:, 0] = walked + beside + 5e3 * rng.standard_normal(samples)
    problem = FreedProblem(replace(FLOW_FORM, unknowns=(), linear=()), log, (), {})
    assert likeliest_noise(problem, np.empty(0), course) == pytest.approx((staying, passing, 1.0), rel=0.6, abs=0.01)


def test_the_share_of_few_turns_that_unknowns_absorb_is_included() -> None:
    rng, samples, times = np.random.default_rng(5), 1000, np.linspace(-1.0, 1.0, 1000)
    walk = np.where(np.arange(samples) % 62 == 31, (4e5) ** 2, 0.0)
    columns, _ = np.linalg.qr(np.vander(times, 9))
    without, found = list[float](), list[float]()
    for _ in range(8):
        made = np.cumsum(0.1 * np.sqrt(walk) * rng.standard_normal(samples)) + 5e3 * rng.standard_normal(samples)
        left = made - columns @ (columns.T @ made)
        found.append(restricted_likelihood_noise(left, columns, 25e6, walk, np.zeros(samples))[0])
        without.append(restricted_likelihood_noise(left, columns[:, :0], 25e6, walk, np.zeros(samples))[0])
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.1, rel=0.3)
    assert np.sqrt(np.mean(np.square(without))) < 0.75 * np.sqrt(np.mean(np.square(found)))


def test_effects_of_turns_that_leak_off_are_distinguished_from_lasting_ones() -> None:
    rng, samples, kept = np.random.default_rng(3), 2000, 0.99
    gained = np.where(np.arange(samples) % 50 == 25, (4e5) ** 2, 0.0)
    leaking = np.zeros(samples)
    for k in range(1, samples):
        leaking[k] = kept * leaking[k - 1] + 0.1 * gained[k] ** 0.5 * rng.standard_normal()
    noise, none = OutputNoise(25e6), np.zeros((samples, 0))
    left = leaking + 5e3 * rng.standard_normal(samples)
    assert restricted_likelihood_noise(left, none, 25e6, gained, np.zeros(samples), kept)[0] == pytest.approx(
        0.1, rel=0.5
    )
    log = replace(still(samples, 5e3), measured=left[:, None], noise=(noise,))
    form = replace(FLOW_FORM, unknowns=(), linear=())
    assert (
        likeliest_noise(FreedProblem(form, log, (), {}), np.empty(0), IntersampleDoubt(gained**0.5, kept=kept))[2]
        == kept
    )
    alike = dict[float, float]()
    for each in (1.0, kept):
        course = IntersampleDoubt(gained**0.5, 0.1, 0.0, each)
        errors = FreedProblem(form, replace(log, course=course), (), {}).residuals(np.empty(0)).ravel()
        alike[each] = float(errors[1:] @ errors[:-1]) / samples
    assert abs(alike[kept]) < 0.07 < 0.1 < alike[1.0]
