"""A search that ended in one of several valleys along the scale of forces looks into the others."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from estimation.fits.descent import Point
from estimation.fits.force_scale import Way, rescaled
from estimation.fits.freed_problem import FreedProblem
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS

MODEL = replace(MOTION_FORMS[0], unknowns=UNKNOWNS, linear=tuple(LINEAR.items()))
HERE = MODEL.theta({name: 2e8 if name == "bulk_modulus" else 1.0 for name in UNKNOWNS})
FAR = np.full(len(UNKNOWNS), 40.0)
SECOND = np.log(0.7)


def problem(lean: float) -> FreedProblem:
    """Return a problem with valleys at the scales 1 and 0.7 of bulk modulus; the second is lower by ``lean``."""

    def at(theta: np.ndarray) -> Point:
        off = theta[0] - HERE[0]
        tilt = np.sqrt(2.0 * lean) / abs(SECOND)
        errors = np.array([200.0 * off * (off - SECOND), tilt * (off - SECOND)])
        slopes = np.zeros((2, len(theta)))
        slopes[:, 0] = 200.0 * (2.0 * off - SECOND), tilt
        return Point(theta, 0.5 * float(errors @ errors), slopes.T @ errors, slopes.T @ slopes)

    return cast("FreedProblem", SimpleNamespace(model=MODEL, at=at))


def found(lean: float) -> tuple[Point, list[Point]]:
    valleys = problem(lean)
    return rescaled(valleys, valleys.at(HERE), Way(valleys, 12, 0.01, 25, (-FAR, FAR)))


def test_a_lower_optimum_on_another_scale_takes_the_place_of_the_best() -> None:
    best, others = found(lean=40.0)
    assert best.theta[0] - HERE[0] == pytest.approx(SECOND, abs=1e-3)
    assert any(other.theta[0] - HERE[0] == pytest.approx(0.0, abs=1e-2) for other in others)


def test_an_optimum_on_another_scale_that_is_as_good_is_told_of() -> None:
    best, others = found(lean=1.0)
    assert best.theta[0] == HERE[0]
    assert any(other.theta[0] - HERE[0] == pytest.approx(SECOND, abs=1e-3) for other in others)
