import numpy as np
import pytest

from benchmarks.diagnosis.fit_diagnosis import FAR, HELD, TWICE, fitted_width


def test_a_fitted_width_covers_its_share_and_grows_if_the_tail_exceeds_twice_that_width() -> None:
    short = np.random.default_rng(0).uniform(0.0, 1.5, 2_000)
    assert fitted_width(short.tolist()) == pytest.approx(1.5 * HELD, abs=0.02)
    tailed = short.copy()
    tailed[-20:] = 6.0
    assert fitted_width(tailed.tolist()) == pytest.approx(6.0 / TWICE)
    tailed[-20:] = short[-20:]
    tailed[-round(0.5 * (1.0 - FAR) * len(tailed)) :] = 6.0
    assert fitted_width(tailed.tolist()) == pytest.approx(1.5 * HELD, abs=0.02)


def test_a_fitted_width_never_narrows_an_interval() -> None:
    assert fitted_width(np.linspace(0.0, 0.5, 100).tolist()) == 1.0


def test_a_fitted_width_also_covers_the_first_population_alone() -> None:
    ratios = np.random.default_rng(0).uniform(0.0, 1.0, 2_000)
    ratios[:400] *= 1.5
    assert fitted_width(ratios.tolist()) > 1.3
