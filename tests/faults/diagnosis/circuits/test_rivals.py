"""Among circuits that follow a creeping piston roughly, none is far behind; if they follow it closely, one may be."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.notes import EstimateCode, SensorCode
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits import rivals
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, misfit
from faults.diagnosis.circuits.model_doubt import NOISE_ALONE
from faults.diagnosis.circuits.rivals import (
    LOOKS,
    ROUGH_RESIDUAL,
    covariance_between_fits,
    fits_from_other_friction,
    is_followed_roughly,
    log_likelihood_behind,
    remaining_doubts,
)
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
NOISE = np.array([1e-4, 1e3])
SIZES = np.array([1e-2, 1e6])


def log(blocks: int = 2_010, *, pressure: bool = True) -> Blocks:
    still = np.ones(blocks)
    noise = NOISE if pressure else NOISE[:1]
    return Blocks(np.zeros(10 * blocks + 1), 1e-3, 10, SIZES[0] * still, SIZES[1] * still if pressure else None, noise)


def leaving(velocity: float, pressure: float, one: Blocks, off: float = 0.0) -> PointFit:
    """Return a fit with residuals of given multiples of the sensors' noise."""
    left = (np.array([velocity, pressure]) * NOISE)[: one.outputs.shape[1]]
    fitted = one.outputs - left
    point = ACTUATOR.conditions[0] + off
    return PointFit(point, 0.0, np.eye(7), np.maximum(left, one.noise), fitted, np.zeros((7, *fitted.shape)))


def test_if_the_piston_is_followed_closely_a_circuit_is_behind_by_its_misfit() -> None:
    one = log()
    for better, worse in (((1.0, 1.0), (3.0, 1.0)), ((5.0, 1.5), (5.5, 2.0)), ((1.0, 4.0), (30.0, 8.0))):
        best, other = leaving(*better, one), leaving(*worse, one)
        expected = (misfit(one, other.fitted) - misfit(one, best.fitted)) / LASTING
        assert log_likelihood_behind([other], best, one)[0] == pytest.approx(expected, rel=1e-12)


def test_if_the_piston_is_followed_roughly_the_lead_of_a_circuit_does_not_grow_with_the_log() -> None:
    lead = np.log(1.3)
    for blocks in (2_010, 20_010, 200_010):
        one = log(blocks)
        best, other = leaving(30.0, 1.0, one), leaving(39.0, 1.0, one)
        assert 0.8 * LOOKS * lead < log_likelihood_behind([other], best, one)[0] < 1.01 * LOOKS * lead
        assert misfit(one, other.fitted) - misfit(one, best.fitted) > 10.0 * LOOKS * lead


def test_an_output_followed_to_its_noise_counts_in_full_even_in_a_rough_circuit() -> None:
    one = log()
    best, other = leaving(30.0, 1.0, one), leaving(30.0, 3.0, one)
    assert log_likelihood_behind([other], best, one)[0] == pytest.approx(
        one.counts[1] * np.log(3.0) / LASTING, rel=1e-12
    )
    assert log_likelihood_behind([best], other, one)[0] == pytest.approx(
        -log_likelihood_behind([other], best, one)[0], rel=1e-12
    )


def test_the_lead_of_a_circuit_decreases_gradually_with_roughness() -> None:
    one, lead = log(200_010), np.log(1.2)
    share = [ROUGH_RESIDUAL * SIZES[0] / NOISE[0] * times for times in (1.0, 1.5, 2.0, 4.0)]
    found = [
        log_likelihood_behind([leaving(1.2 * left, 1.0, one)], leaving(left, 1.0, one), one)[0] / lead for left in share
    ]
    assert found[0] == pytest.approx(200_000 / LASTING, rel=1e-3)
    assert found[1] == pytest.approx(2.0 * LOOKS, rel=0.05)
    assert found[2:] == pytest.approx([LOOKS, LOOKS], rel=0.05)


def test_without_pressure_the_misfit_decides_and_a_diverged_circuit_is_infinitely_behind() -> None:
    one = log(pressure=False)
    best, other = leaving(30.0, 1.0, one), leaving(39.0, 1.0, one)
    assert log_likelihood_behind([other], best, one)[0] == pytest.approx(
        one.counts[0] * np.log(1.3) / LASTING, rel=1e-12
    )
    away = replace(other, fitted=np.full_like(other.fitted, np.inf))
    assert log_likelihood_behind([best, away], best, one).tolist() == [0.0, np.inf]


def test_equally_good_ends_of_a_search_widen_the_spread_and_worse_ones_do_not() -> None:
    one, off = log(), np.full(7, 0.3)
    fit, alike = leaving(1.0, 1.0, one), leaving(1.0, 1.0, one, 0.3)

    def added(fits: list[PointFit]) -> np.ndarray:
        return covariance_between_fits(fits, fit, log_likelihood_behind(fits, fit, one))

    np.testing.assert_allclose(added([fit, alike]), 0.5 * np.outer(off, off), rtol=1e-12)
    assert np.all(added([leaving(3.0, 3.0, one, 0.3), fit]) < 1e-4)
    assert np.all(added([fit]) == 0.0)


def test_circuits_that_follow_a_creeping_piston_roughly_widen_the_spread() -> None:
    one, off = log(), np.full(7, 0.3)
    fit, other = leaving(30.0, 1.0, one), leaving(33.0, 1.0, one, 0.3)
    assert misfit(one, other.fitted) - misfit(one, fit.fitted) > 5.0 * LASTING
    assert np.all(
        covariance_between_fits([fit, other], fit, log_likelihood_behind([fit, other], fit, one))
        > 0.3 * np.outer(off, off)
    )


def test_a_piston_creeps_if_residuals_exceed_noise_and_a_share_of_its_velocity() -> None:
    one = log()
    limit = ROUGH_RESIDUAL * SIZES[0] / NOISE[0]
    assert not is_followed_roughly(one, leaving(0.99 * limit, 1.0, one))
    assert is_followed_roughly(one, leaving(1.01 * limit, 1.0, one))
    noisy = replace(one, noise=NOISE * [1.01 * limit / NOISE_ALONE, 1.0])
    assert not is_followed_roughly(noisy, leaving(1.0 * limit, 1.0, one))


def test_other_friction_levels_are_tried_at_the_leakage_and_friction_at_rest_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun: dict[str, np.ndarray] = {}

    def kept(blocks: Blocks, _: Actuator, condition: str, start: np.ndarray) -> PointFit:
        begun[condition] = start
        return leaving(1.0, 1.0, blocks)

    monkeypatch.setattr(rivals, "fit_freely", kept)
    one = log()
    best = leaving(30.0, 1.0, one, 0.1)
    found = fits_from_other_friction(one, ACTUATOR, best, "minor_leakage_minor_friction")
    assert list(begun) == ["minor_leakage", "minor_leakage_major_friction"]
    assert len(found) == 2
    sliding = [COORDINATES.index(name) for name in ("friction_quadratic", "friction_rated")]
    for name, start in begun.items():
        nominal = ACTUATOR.conditions[list(CONDITIONS).index(name)]
        np.testing.assert_array_equal(start[sliding], nominal[sliding])
        np.testing.assert_array_equal(np.delete(start, sliding), np.delete(best.coordinates, sliding))


def test_a_failed_motion_fit_is_not_an_objection_to_a_followed_log_that_its_form_cannot_describe() -> None:
    resting, size = log(pressure=False), SIZES[0] / NOISE[0]
    running, warming = replace(resting, settling=1.0), replace(resting, leakage_course=np.ones(len(resting.speed)))
    stopped = replace(resting, stop=0.1)
    far = EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=40.0, motion_percent=20.0)
    froze = SensorCode.SENSOR_FROZE.note(channel="position_m", value=0.0, begin_s=0.0, length_s=1.0)
    followed = [(running, 0.9, (froze,)), (warming, 0.9, (froze,)), (resting, 0.9, (far, froze))]
    missed = [(running, 1.1, (far, froze)), (stopped, 1.1, (far, froze)), (warming, 1.1, (froze,))]
    for one, share, left in (*followed, (stopped, 0.9, (froze,)), *missed):
        assert remaining_doubts((far, froze), one, leaving(share * ROUGH_RESIDUAL * size, 1.0, one)) == left
