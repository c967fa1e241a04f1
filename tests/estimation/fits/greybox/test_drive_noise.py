"""Drive noise adds as much to the covariance as its draws do, whether they are stored or made one after another."""

import numpy as np
import pytest

from estimation.fits.greybox import drive_noise, freed_problem
from estimation.fits.greybox.drive_noise import drive_covariance, effect_of_drive_noise
from estimation.models.flow import MASS_FLOW_FORM
from tests.estimation.fits.short_logs import problem, usual


def test_draws_made_one_by_one_give_the_covariance_of_stored_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    one = problem()
    theta = usual(one)
    slopes = one.slopes(theta)
    bread = np.asarray(np.linalg.inv(slopes.T @ slopes + np.eye(len(theta))), dtype=np.float64)
    kept = drive_covariance(one, theta, bread, slopes)
    assert np.all(np.diag(kept) > 0.0)
    monkeypatch.setattr(drive_noise, "SAMPLES_KEPT", 10)
    np.testing.assert_allclose(
        drive_covariance(one, theta, bread, slopes), kept, rtol=1e-9, atol=1e-12 * float(np.max(kept))
    )


def test_a_run_without_noise_takes_no_kernel_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    one = problem()
    theta = usual(one)
    slopes = one.slopes(theta)
    bread = np.asarray(np.linalg.inv(slopes.T @ slopes + np.eye(len(theta))), dtype=np.float64)
    given = drive_covariance(one, theta, bread, slopes, one.coarse.residuals(theta))
    monkeypatch.setattr(
        freed_problem, "_run_alone", lambda *_: pytest.fail("this kernel would be compiled for one run")
    )
    found = drive_covariance(one.on(one.log), theta, bread, slopes)
    np.testing.assert_allclose(found, given, rtol=1e-6, atol=1e-6 * float(np.max(given)))


def test_the_effect_of_drive_noise_on_one_balance_serves_for_another() -> None:
    one, other = problem(), problem(MASS_FLOW_FORM)
    theta = usual(other)
    slopes = other.slopes(theta)
    bread = np.asarray(np.linalg.inv(slopes.T @ slopes + np.eye(len(theta))), dtype=np.float64)
    own, shared = (
        np.diag(drive_covariance(other, theta, bread, slopes, moved=moved))
        for moved in (None, effect_of_drive_noise(one, usual(one)))
    )
    np.testing.assert_allclose(shared, own, rtol=0.1)
