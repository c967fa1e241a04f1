"""Regressors of a loss: each is one where the loss is largest, and none is tried on a log that cannot show it."""

import numpy as np
import pytest

from estimation.fits.hypothesis_search.loss_regressors import (
    BORE,
    FILLING,
    LEAST_POWER,
    LIFTING,
    NARROWEST,
    ONE_WAY,
    TOOTH,
    WEAR,
    WIDEST_TOOTH,
    LossRegressor,
    LossSignals,
    shifted_regressor,
)

SEEN = LossSignals(
    speed=np.array([-100.0, 20.0, 60.0, 100.0]),
    angle=np.array([0.0, 1.0, np.pi, 2.0 * np.pi + 1.0]),
    position=np.array([0.0, 0.01, 0.02, 0.03]),
    pressure=np.array([-4e5, 1e5, 2e5, 4e5]),
    steady=np.array([-4e5, 1e5, 2e5, 4e5]),
    leakage=5e-12,
    displacement=5e-7,
)
LEAKED = SEEN.leakage * SEEN.pressure


@pytest.mark.parametrize(
    ("course", "expected"),
    [
        (LossRegressor(BORE, 0.01, 0.01), LEAKED * np.exp([-0.5, 0.0, -0.5, -2.0])),
        (LossRegressor(TOOTH, 1.0, 0.5), LEAKED * np.exp(4.0 * (np.cos([-1.0, 0.0, np.pi - 1.0, 0.0]) - 1.0))),
        (LossRegressor(FILLING, 50.0), [-2.5e-5, 0.0, 5e-6, 2.5e-5]),
        (LossRegressor(LIFTING, 1e5), [-1.5e-6, 0.0, 5e-7, 1.5e-6]),
        (LossRegressor(LIFTING, 1e5, 2.0), [-4.5e-6, 0.0, 5e-7, 4.5e-6]),
        (LossRegressor(ONE_WAY, 1.0), [0.0, 5e-7, 1e-6, 2e-6]),
        (LossRegressor(WEAR, 0.0), 5e-7 * SEEN.speed),
        (LossRegressor(ONE_WAY, -1.0), [-2e-6, 0.0, 0.0, 0.0]),
    ],
    ids=lambda one: one.kind if isinstance(one, LossRegressor) else "",
)
def test_the_regressor_of_each_loss_has_the_course_of_its_cause(course: LossRegressor, expected: np.ndarray) -> None:
    assert SEEN.of(course) == pytest.approx(np.asarray(expected), rel=1e-9, abs=1e-18)


def test_every_kind_of_loss_is_tried_within_the_range_of_the_log() -> None:
    tried = SEEN.regressors_tried()
    assert {one.kind for one in tried} == {BORE, TOOTH, FILLING, LIFTING, ONE_WAY, WEAR}
    assert all(0.0 <= one.at <= 0.03 for one in tried if one.kind == BORE)
    assert all(0.0 < one.at < 100.0 for one in tried if one.kind == FILLING)
    assert all(np.any(SEEN.of(one) != 0.0) for one in tried)


def test_no_scored_bore_is_tried_if_the_piston_hardly_moves() -> None:
    still = SEEN._replace(position=1e-4 * SEEN.position)
    assert all(one.kind != BORE for one in still.regressors_tried())


def test_losses_with_a_threshold_are_not_tried_with_dead_pressure_and_a_motor_at_rest() -> None:
    still = SEEN._replace(speed=np.zeros(4), pressure=np.zeros(4), steady=np.zeros(4))
    assert not {FILLING, LIFTING} & {course.kind for course in still.regressors_tried()}


def test_each_kind_of_loss_varies_only_its_own_parameters() -> None:
    assert {
        kind: tuple(SEEN.field_steps(LossRegressor(kind, 1.0, 0.1)))
        for kind in (BORE, TOOTH, FILLING, LIFTING, ONE_WAY, WEAR)
    } == {
        BORE: ("at", "width"),
        TOOTH: ("at", "width"),
        FILLING: ("at", "width"),
        LIFTING: ("at", "width"),
        ONE_WAY: (),
        WEAR: (),
    }


def test_a_width_stays_within_its_bounds() -> None:
    assert shifted_regressor(LossRegressor(BORE, 0.0, NARROWEST), {"width": -1.0}, 1.0).width == NARROWEST
    assert shifted_regressor(LossRegressor(TOOTH, 0.0, 0.8), {"width": 5.0}, 1.0).width == WIDEST_TOOTH
    assert shifted_regressor(LossRegressor(BORE, 0.0, 0.004), {"width": 5.0}, 1.0).width == 0.008
    assert shifted_regressor(LossRegressor(LIFTING, 1e5, 1.0), {"width": -5.0}, 1.0).width == LEAST_POWER
    assert shifted_regressor(LossRegressor(FILLING, 50.0), {"at": -80.0}, 1.0).at == 25.0
