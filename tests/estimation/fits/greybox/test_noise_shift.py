"""The shift of a fit by motor speed noise is corrected, and nothing is if the noise has no effect."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.greybox.deviations import Information, information
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.noise_shift import noise_shift
from plant.arrays import Array
from tests.estimation.fits.short_logs import problem, usual

SPREAD = 0.3
"""Standard deviation of motor speed noise [rad/s]."""


def loud(walk: float = 1e9) -> FreedProblem:
    """Return a problem with noisy motor speed, and with zero residuals at the usual values."""
    one = problem()
    left = one.residuals(usual(one)).T * one.log.noise[0].variance ** 0.5
    noisy = (replace(one.log.noise[0], walk=walk),)
    return one.on(replace(one.log, measured=one.log.measured + left, drive_std=(SPREAD, 0.0), noise=noisy))


def known(one: FreedProblem, theta: Array) -> Information:
    errors, slopes = one.linearised(theta)
    felt = np.flatnonzero(np.einsum("ij,ij->j", slopes, slopes) > 1.0)
    return information(one, theta, errors, slopes, felt, warned=False)


def test_the_noise_shift_equals_the_shift_of_the_solution_by_drawn_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("estimation.fits.greybox.noise_shift.noise_behind_motion", lambda *_: SPREAD**2)
    one = loud()
    theta = usual(one)
    told = known(one, theta)
    shift, variance = noise_shift(one, theta, told)
    rng, pulls = np.random.default_rng(5), list[Array]()
    for _ in range(40):
        noise = np.column_stack([SPREAD * rng.standard_normal(len(one.log.drives)), np.zeros(len(one.log.drives))])
        for side in (1.0, -1.0):
            pulls.append(one.on(replace(one.log, drives=one.log.drives + side * noise)).at(theta).gradient)
    pull = np.mean(pulls, axis=0) - one.at(theta).gradient
    modulus = one.model.unknowns.index("bulk_modulus")
    moved = -(told.fitted_bread @ pull[told.felt])[told.felt.tolist().index(modulus)]
    assert moved < 0.0  # noise makes the oil look softer
    assert shift["bulk_modulus"] == pytest.approx(-moved, rel=0.3)
    assert variance["bulk_modulus"] == pytest.approx((0.2 * shift["bulk_modulus"]) ** 2)


def test_noise_without_effect_causes_no_shift() -> None:
    one = loud(walk=0.0)
    theta = usual(one)
    assert noise_shift(one, theta, known(one, theta)) == ({}, {})
