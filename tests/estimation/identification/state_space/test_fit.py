"""Bounds of a state-space descent: no step leaves the unit circle, and a step that would is judged by its poles."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import channels_from, scaled
from estimation.identification.state_space import fit
from estimation.identification.state_space.fit import Effort, _minimum_near
from estimation.identification.state_space.joint import joined_outputs
from estimation.identification.state_space.problem import Problem, Size


def problem() -> Problem:
    rng = np.random.default_rng(3)
    u = rng.normal(size=(80, 1))
    y = [np.convolve(u[:, 0], one ** np.arange(30.0))[:80] for one in (0.6, 0.3)]
    return Problem(
        Size(2, 1, 2, direct=False),
        joined_outputs([scaled(channels_from([u], [one], 0.1, ("u",), "y"))[0] for one in y]),
    )


def test_a_step_is_allowed_as_long_as_all_poles_stay_within_the_unit_circle(monkeypatch: pytest.MonkeyPatch) -> None:
    one = problem()
    theta = np.zeros(one.size.n_matrices + one.size.n)
    theta[:4] = [0.8, 0.1, 0.0, 0.3]
    theta[4:] = 0.2
    held: list[Callable[[Array], bool]] = []

    def captured(_: Any, begin: Array, stable: Callable[[Array], bool], **__: Any) -> tuple[float, Array]:
        held.append(stable)
        return 0.0, begin

    monkeypatch.setattr(fit, "levenberg", captured)
    assert np.array_equal(_minimum_near(one, theta, np.eye(2), Effort(1, 1, 1, 1e-3))[1], theta)
    basis, seen = one.directions(theta), set[bool]()
    for direction in np.eye(basis.shape[1]):
        for length in (0.1, 0.3, 1.0, 3.0, 10.0):
            moved = length * direction
            radius = float(np.abs(np.linalg.eigvals((theta + basis @ moved)[:4].reshape(2, 2))).max())
            assert held[0](moved) is (radius < 1.0)
            seen.add(radius < 1.0)
    assert seen == {True, False}
