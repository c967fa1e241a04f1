"""Uncertainty of the motor's course between the samples of a slow log."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.arrays import Array
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.intersample_doubt import IntersampleDoubt
from estimation.fits.greybox.intersample_noise import (
    SHARES,
    UNCERTAINTIES_TRIED,
    likeliest_noise,
    restricted_likelihood_noise,
)
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


@pytest.mark.parametrize(("kept", "known", "found"), [(0.95, 0.95, 0.95), (1.0, 0.9, 1.0)])
def test_means_of_blocks_show_what_turns_leave_and_whether_it_leaks_off(
    kept: float, known: float, found: float
) -> None:
    rng, samples, block = np.random.default_rng(0), 4000, 8
    log = replace(still(samples, 5e3), block=block * 5e-3)
    turns = np.where(np.arange(samples) % (5 * block) == 2 * block, 4e5, 0.0)
    gained = 0.1 * turns * rng.standard_normal(samples)
    log.measured[:, 0] = lfilter([1.0], [1.0, -kept], gained) + 5e3 * rng.standard_normal(samples)
    problem = FreedProblem(replace(FLOW_FORM, unknowns=(), linear=()), log, (), {})
    likeliest = likeliest_noise(problem, np.empty(0), IntersampleDoubt(turns, kept=known))
    assert likeliest == pytest.approx((0.1, 0.0, found), rel=0.4, abs=0.01)
    assert likeliest[2] == found


def test_an_offset_of_motor_speed_is_not_taken_for_turns() -> None:
    rng, samples = np.random.default_rng(2), 400
    log, form = still(samples, 5e3), replace(FLOW_FORM, unknowns=(), linear=())
    course = IntersampleDoubt(np.where(np.arange(samples) % 20 == 10, 4e5, 0.0))
    velocity = (HEALTHY.pump_displacement * 50.0 - HEALTHY.flow_bias) / HEALTHY.piston_area
    log.drives[:] = np.column_stack([np.full(samples, 50.0), velocity * log.sample_time * np.arange(samples)])
    (more,) = FreedProblem(form, log, (), {}).disturbed(np.empty(0), [np.add(log.drives, (0.3, 0.0))])
    log.measured[:, 0] = 5e3 * (more.ravel() + rng.standard_normal(samples))
    assert np.ptp(more) > 4.0
    assert likeliest_noise(FreedProblem(form, log, (), {}), np.empty(0), course)[0] == 0.0


@pytest.mark.parametrize("columns", [0, 2])
def test_the_restricted_likelihood_is_that_of_whole_matrices(columns: int) -> None:
    rng, blocks, kept, level = np.random.default_rng(4), 30, 0.9, 25e6
    walk, beside = (rng.uniform(0.0, (4e5) ** 2, blocks) * (rng.random(blocks) < 0.3) for _ in range(2))
    freed = np.linalg.qr(rng.standard_normal((blocks, 2)))[0][:, :columns]
    gained = 0.05 * walk**0.5 * rng.choice([-1.0, 1.0], blocks)
    left = lfilter([1.0], [1.0, -kept], gained) + rng.uniform(-8e3, 8e3, blocks)  # nothing is an outlier
    left[7], freed[7] = 0.0, 0.0  # a missing block
    there = np.arange(blocks) != 7
    y, X = left[there], freed[there]
    decay = np.tril(kept ** np.maximum(np.subtract.outer(np.arange(blocks), np.arange(blocks)), 0.0))

    def cost(share: float, staying: float, passing: float) -> float:
        stays, passes = (decay * (staying**2 * walk)) @ decay.T, np.diag(passing**2 * beside + share * level)
        V = (stays + passes)[np.ix_(there, there)]
        told: Array = X.T @ np.linalg.solve(V, np.column_stack([y, X]))
        explained = told[:, 0] @ np.linalg.solve(told[:, 1:], told[:, 0])
        return float(sum(np.linalg.slogdet(one)[1] for one in (V, told[:, 1:])) + y @ np.linalg.solve(V, y) - explained)

    tried = [(s, p, cost(n, s, p)) for n in SHARES for s in UNCERTAINTIES_TRIED for p in UNCERTAINTIES_TRIED]
    wanted = min(tried, key=lambda one: one[2])
    assert restricted_likelihood_noise(left, freed, level, walk, beside, kept) == pytest.approx(wanted, rel=1e-9)


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
