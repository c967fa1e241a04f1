"""A search that begins far off is led on a decimated log, and one near by is not."""

import numpy as np
import pytest

from estimation.fits.flow import rough_search
from estimation.fits.flow.rough_search import rough_optima
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.models.flow import FLOW_FORM, relieving
from plant.arrays import Array
from tests.estimation.fits.flow.test_search import HEALTHY, STARTS, recorded, seen

SHORTEST = 2000
"""Length from which a log is decimated here, in place of `FEW` [samples]."""


@pytest.fixture(scope="module")
def log() -> GreyBoxLog:
    return seen(recorded("major_leakage"))


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rough_search, "FEW", SHORTEST)


def led(log: GreyBoxLog, away: float, *, relieved: bool = False) -> tuple[FreedProblem, Array, Array]:
    """Return a balance, a guess of which bulk modulus is so far off, and where the search from it begins."""
    problem = FreedProblem.of(relieving(FLOW_FORM) if relieved else FLOW_FORM, log)
    guess = problem.model.theta({**rough_optima(log, HEALTHY, STARTS)[0].values, **dict.fromkeys(RELIEF, 1e6)})
    guess[problem.model.unknowns.index("bulk_modulus")] += away
    bounds = (np.full(len(guess), -100.0), np.full(len(guess), 100.0))
    search = rough_search._search(log)  # pyright: ignore[reportPrivateUsage]
    return problem, guess, rough_search._nearer(problem, guess, bounds, search)  # pyright: ignore[reportPrivateUsage]


RELIEF = ("relief_pressure", "relief_conductance")


def test_a_guess_far_off_is_brought_near_before_the_whole_log_is_searched(log: GreyBoxLog) -> None:
    problem, guess, near = led(log, 1.0)
    assert problem.coarse.at(near).cost < 0.05 * problem.coarse.at(guess).cost


@pytest.mark.parametrize(("away", "relieved"), [(0.001, False), (1.0, True)])
def test_a_guess_near_by_and_one_with_a_relief_valve_are_left(log: GreyBoxLog, away: float, relieved: bool) -> None:
    _, guess, near = led(log, away, relieved=relieved)
    assert near is guess


def test_optima_are_where_they_are_without_it(log: GreyBoxLog, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rough_search, "FAR_OFF", 0.0)  # each search begins on a decimated log
    quick = rough_optima(log, HEALTHY, STARTS)
    monkeypatch.setattr(rough_search, "FAR_OFF", np.inf)
    for one, other in zip(quick, rough_optima(log, HEALTHY, STARTS), strict=True):
        assert one.point.cost == pytest.approx(other.point.cost, abs=2.0 * rough_search.ROUGH_ENOUGH)
