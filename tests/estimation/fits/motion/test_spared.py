"""How far the search of a log without pressure goes on if nothing explains the log."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion.fit import BEGINNING_SHARE, SPARED_NIS, SPARED_SHARE
from estimation.fits.motion.force_scale import SHORT
from estimation.fits.motion.search import EXPLAINED, SearchResult

LONG = round(1e3 * SHORT) + 1

BEGUN = Point(np.ones(1), 1.0, np.zeros(1), np.zeros((1, 1)))


def problem_of(chi_square: float, samples: int) -> Any:
    """Return a problem with the same residuals at every point."""
    point = Point(np.ones(1), 0.5 * chi_square * samples, np.zeros(1), np.zeros((1, 1)))
    return SimpleNamespace(log=SimpleNamespace(measured=np.zeros((samples, 1)), sample_time=1e-3), at=lambda _: point)


@pytest.mark.parametrize("counts", [1.0, BEGINNING_SHARE])
@pytest.mark.parametrize(
    ("large", "far", "samples", "ends"),
    [
        (0.99, 9.0, LONG, True),  # so small a residual rules out no class
        (1.01, 0.99, LONG, True),  # neither does so small a share of the motion
        (1.01, 1.01, LONG, False),
        (0.99, 0.99, LONG - 1, False),  # short logs take little time
    ],
)
def test_a_search_of_a_long_log_may_end_early_if_its_residuals_rule_out_no_class(
    large: float, far: float, samples: int, ends: bool, counts: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = problem_of(large * counts * SPARED_NIS, samples)
    monkeypatch.setattr(motion_fit, "share_of_motion", lambda *_: far * counts * SPARED_SHARE)
    found = motion_fit._wanted_cost(problem, BEGUN, counts)
    assert found == pytest.approx(0.5 * EXPLAINED * samples if ends else np.inf)


@pytest.mark.parametrize(("chi_square", "spared"), [(9.9, (True, True)), (10.1, (False, True)), (50.1, (False, False))])
def test_the_beginning_of_a_log_is_searched_further_than_the_whole(
    chi_square: float, spared: tuple[bool, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert tuple(searched(problem_of(chi_square, 10_000), problem_of(chi_square, 20_000), monkeypatch)) == spared


def test_a_log_that_is_no_longer_than_its_beginning_is_searched_further_once(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(searched(problem_of(50.1, 10_000), problem_of(50.1, 10_000), monkeypatch)) == 1


def searched(part: Any, whole: Any, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Return whether the searches of a log that nothing explains may end early, in their order."""
    asked: list[bool] = []

    def noted(*_: Any, wanted: float = np.inf, **__: Any) -> Point:
        asked.append(np.isfinite(wanted))
        return Point(np.ones(1), 1e9, np.zeros(1), np.zeros((1, 1)))

    monkeypatch.setattr(motion_fit, "descend", noted)
    monkeypatch.setattr(motion_fit, "share_of_motion", lambda *_: 1.0)
    monkeypatch.setattr(motion_fit, "fit_at_solution", lambda *_: "concluded")
    monkeypatch.setattr(motion_fit, "_rival_fits", lambda *_, **__: [])
    search: Any = SimpleNamespace(part=part, whole=whole, bounds=None)
    ended = [SearchResult(search, BEGUN, explains=False)] * 2
    assert motion_fit._fitted(ended) == (["concluded"], [], False)
    return asked
