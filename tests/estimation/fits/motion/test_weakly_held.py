"""A log that determines bulk modulus far too weakly skips the search on other scales; an accepted one never does."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.motion import fit as motion_fit
from estimation.fits.motion import weakly_held
from estimation.fits.motion.fit import fit_motion
from estimation.fits.motion.search import SearchResult
from estimation.fits.motion.weakly_held import FAR_TOO_WEAK, LARGEST_UNSEEN_SHIFT, is_far_too_weak, unseen_shift
from estimation.models.motion import MOTION_FORMS
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.log.record import Record

WHOLE = 20_000


def problem_of(samples: int) -> Any:
    return SimpleNamespace(log=SimpleNamespace(measured=np.zeros((samples, 1))), at=None)


def at(cost: float) -> Point:
    return Point(np.ones(1), cost, np.zeros(1), np.zeros((1, 1)))


@pytest.mark.parametrize("samples", [WHOLE // 4, WHOLE])
@pytest.mark.parametrize("size", [0.99, 1.01])
def test_the_deviation_from_a_beginning_is_scaled_to_the_whole_log(
    samples: int, size: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    needed = FAR_TOO_WEAK * LARGEST_UNSEEN_SHIFT / unseen_shift(1.0, WHOLE) * np.sqrt(WHOLE / samples)
    monkeypatch.setattr(weakly_held, "deviation", lambda *_: size * needed)
    assert is_far_too_weak(problem_of(samples), at(0.5 * samples), problem_of(WHOLE)) == (size > 1.0)


def test_a_visible_misfit_makes_bulk_modulus_less_certain() -> None:
    assert unseen_shift(1.1, WHOLE) > 3.0 * unseen_shift(1.0, WHOLE)
    assert unseen_shift(0.5, WHOLE) == unseen_shift(1.0, WHOLE)


@pytest.mark.parametrize(("std", "asked"), [(1e6, [True]), (1e5, [True, False])])
def test_a_log_that_does_determine_bulk_modulus_is_fitted_again_on_other_scales(
    std: float, asked: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    sparing: list[bool] = []

    def fitted(_: Any, *, sparing: bool) -> Any:
        noted(sparing)
        fit = GreyBoxFit(
            MOTION_FORMS[0], np.zeros(1), {"bulk_modulus": 2e8}, {"bulk_modulus": std}, 50.0, (1.0,), (0.0,)
        )
        return [fit], [2e8], sparing

    noted = sparing.append
    monkeypatch.setattr(motion_fit, "search_results", lambda _: [])
    monkeypatch.setattr(motion_fit, "_fitted", fitted)
    position = 1e-3 * np.sin(0.01 * np.arange(2000)) + 1e-6 * np.random.default_rng(1).standard_normal(2000)
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(2000), "position_m": position})
    found = fit_motion(record, EhaParameters(), 2e8, variances={"motor_speed_rad_s": 1e-4})
    assert sparing == asked
    weak = [note.code for note in found.reasons] == [EstimateCode.WEAKLY_HELD]
    assert weak == (len(asked) == 1)


@pytest.mark.parametrize("sparing", [True, False])
def test_the_bulk_modulus_of_the_search_replaces_those_of_skipped_scales(
    sparing: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends: list[list[float]] = []
    followed: list[Any] = []

    def noted(moduli: list[float]) -> bool:
        ends.append(moduli)
        return False

    def shortened(problem: Any, _: Any) -> Any:
        followed.append(problem)
        return problem

    monkeypatch.setattr(motion_fit, "explained_cost", lambda _: 1.0)
    monkeypatch.setattr(motion_fit, "is_far_too_weak", lambda *_: True)
    monkeypatch.setattr(motion_fit, "bulk_modulus", lambda *_: 2e8)
    monkeypatch.setattr(motion_fit, "_rescaled", lambda *_: (at(0.5), [3e8]))
    monkeypatch.setattr(motion_fit, "descend", lambda *_, **__: at(0.5))
    monkeypatch.setattr(motion_fit, "fit_at_solution", lambda *_: "concluded")
    monkeypatch.setattr(motion_fit, "_rival_fits", lambda *_, **__: [])
    monkeypatch.setattr(motion_fit, "disagree", noted)
    monkeypatch.setattr(motion_fit, "without_chatter", shortened)
    search: Any = SimpleNamespace(part=problem_of(10), whole=problem_of(10), bounds=None)
    ended = [SearchResult(search, at(0.5), explains=True)] * 2
    others = [2e8] if sparing else [3e8]
    assert motion_fit._fitted(ended, sparing=sparing) == (["concluded"], others, sparing)
    assert ends == [[2e8, *others]] * 2
    assert bool(followed) is not sparing, "what is hardly believed is not followed in shorter steps"
