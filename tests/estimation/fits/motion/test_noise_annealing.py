"""A search that nearly explains a log is led on under larger noise, which removes the local minima of its misfit."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.greybox.descent import Point
from estimation.fits.motion import noise_annealing
from estimation.fits.motion.noise_annealing import LARGER_WALK, annealed
from plant.arrays import Array

BOUNDS = (np.full(1, -9.0), np.full(1, 9.0))
PIT = Point(np.array([3.0]), 50.0, np.zeros(1), np.eye(1))


def valley(theta: Array, *, rough: bool) -> Point:
    """Return a point of a misfit with its minimum at 0; a rough one stops a search anywhere but near the minimum."""
    away = theta if not rough or abs(theta[0]) < 0.5 else np.zeros(1)
    return Point(theta, 5.0 + 5.0 * float(theta @ theta), 10.0 * away, 10.0 * np.eye(1))


def problem(asked: list[str]) -> Any:
    """Return a problem that is smooth only under a larger random walk of the noise."""

    def softened(variance: float, walk: float) -> str:
        assert (variance, walk) == (1.0, LARGER_WALK)
        return "softened"

    def at(theta: Array, log: str = "own") -> Point:
        asked.append(log)
        return valley(theta, rough=log == "own")

    soft = SimpleNamespace(at=lambda theta: at(theta, "softened"))
    return SimpleNamespace(at=at, log=SimpleNamespace(with_larger_noise=softened), on=lambda _: soft)


def test_a_local_minimum_is_left_for_the_global_one_which_is_not_left_again() -> None:
    asked: list[str] = []
    found = annealed(problem(asked), PIT, BOUNDS, 1e-3, 1.0)
    assert found.cost == pytest.approx(5.0, abs=1e-3)
    assert asked.index("own") > asked.index("softened")
    assert len([one for one, last in zip(asked, ["own", *asked[:-1]], strict=True) if one != last == "own"]) == 2


def test_a_result_is_kept_if_annealing_finds_nothing_lower() -> None:
    low = Point(np.array([3.0]), 4.0, np.zeros(1), np.eye(1))
    assert annealed(problem([]), low, BOUNDS, 1e-3, 1.0) is low


def test_the_least_share_applies_only_to_descents_under_the_original_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []
    descended = noise_annealing.descend

    def noted(*given: Any, least_share: float = 0.0) -> Point:
        shares.append(least_share)
        return descended(*given, least_share=least_share)

    monkeypatch.setattr(noise_annealing, "descend", noted)
    annealed(problem([]), PIT, BOUNDS, 1e-3, 1.0, least_share=0.01)
    assert shares
    assert shares == [0.0, 0.01] * (len(shares) // 2)
