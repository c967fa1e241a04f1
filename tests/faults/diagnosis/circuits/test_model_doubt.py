"""Covariance of a fitted circuit: sensor noise, a wrong model's error counted once, and rarely known parameters."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COLUMN, COORDINATES, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR, PointFit, least_scales
from faults.diagnosis.circuits.model_doubt import (
    LOOKS,
    NOISE_ALONE,
    RIGHT_SHARE,
    SELDOM_KNOWN,
    error_moment,
    local_variance,
    model_error,
    residuals_of,
    seldom_known_slopes,
    seldom_known_spreads,
)
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())
CENTRE, SURE, ALL = ACTUATOR.conditions[:1], np.zeros(1), np.ones(7)
SPREADS = seldom_known_spreads(ACTUATOR)
NOISE = np.array([1e-4, 1e3])


def log(blocks: int) -> Blocks:
    still = np.full(blocks, 0.1)
    return Blocks(np.zeros(10 * blocks + 1), 1e-3, 10, still, 1e6 * still, NOISE)


def told(blocks: int, share: float = 0.0) -> tuple[PointFit, Blocks]:
    """Return a fit whose residuals exceed sensor noise by a share, and its log; each coordinate has its own blocks."""
    one = log(blocks)
    slopes = np.zeros((7, blocks, 2))
    for i in range(7):
        slopes[i, i::7] = NOISE
    return leaving(
        PointFit(CENTRE[0], 0.0, np.eye(7), NOISE, one.outputs, slopes), one, NOISE / np.sqrt(1.0 - share)
    ), one


def leaving(fit: PointFit, one: Blocks, size: np.ndarray) -> PointFit:
    """Return a fit at its optimum with residuals of a given size that do not last: half of them have each sign."""
    block, which = np.divmod(np.arange(len(fit.fitted)) - one.first, 7)
    up = np.where(np.isin(block % 4, [0, 3]), 1.0, -1.0) * (-1.0) ** which
    return replace(fit, scales=size, fitted=one.outputs - up[:, None] * size)


def nothing_seldom(blocks: int) -> np.ndarray:
    return np.zeros((len(SELDOM_KNOWN), blocks, 2))


def wrong(fit: PointFit, blocks: Blocks) -> np.ndarray:
    return model_error(residuals_of(fit, blocks), blocks)


def variances(blocks: int, share: float = 0.0) -> np.ndarray:
    fit, one = told(blocks, share)
    return np.diag(error_moment(fit, nothing_seldom(blocks), one, CENTRE, SURE, ALL, SPREADS))


def test_noise_averages_out_in_a_longer_log_and_a_model_error_does_not() -> None:
    assert variances(14_010)[0] == pytest.approx(2.0 * variances(28_010)[0], rel=0.02)
    assert variances(14_010, 0.5)[0] == pytest.approx(variances(28_010, 0.5)[0], rel=0.02)


def test_a_model_error_averages_over_ten_looks_and_noise_over_all_blocks() -> None:
    blocks, share = 14_010, 0.5
    seen = blocks - log(blocks).first
    beyond = 1.0 - NOISE_ALONE**2 * (1.0 - share)
    variance = 7.0 / (2.0 * seen) * (1.0 + beyond * seen / LOOKS) / (1.0 - share)
    assert variances(blocks, share)[0] == pytest.approx(
        1.0 / (1.0 / variance + np.linalg.inv(WEAK_PRIOR)[0, 0]), rel=0.01
    )


def test_residuals_within_the_uncertainty_of_the_noise_are_not_a_model_error() -> None:
    as_known = variances(14_010, 1.0 - 1.0 / NOISE_ALONE**2)[0]
    assert as_known == pytest.approx(NOISE_ALONE**2 * variances(14_010)[0], rel=1e-3)
    assert variances(14_010, 1.0 - 0.9 / NOISE_ALONE**2)[0] > 20.0 * as_known


@pytest.mark.parametrize("slope", [1.0, -1.0], ids=["the same in all blocks", "to and fro"])
def test_noise_of_a_differenced_position_is_anticorrelated_between_blocks(slope: float) -> None:
    """Many draws of an encoder's noise give the reference for the error of the fit."""
    fit, one = told(430)
    slopes = np.zeros_like(fit.slopes)
    slopes[0, :, 0] = 100.0 * NOISE[0] * slope ** np.arange(430)  # so large that the prior hardly counts
    lone, noise = replace(fit, slopes=slopes), np.random.default_rng(0).standard_normal((4000, 431)) / np.sqrt(2.0)
    weight = slopes[0, one.first :, 0] / NOISE[0]
    drawn = np.var(np.diff(noise, axis=1)[:, one.first :] @ weight / np.sum(weight**2))
    white, differenced = (
        error_moment(lone, nothing_seldom(430), blocks, CENTRE, SURE, ALL, SPREADS)[0, 0]
        for blocks in (one, replace(one, differenced=True))
    )
    assert white == pytest.approx(1.0 / np.sum(weight**2), rel=0.02)
    assert differenced == pytest.approx(drawn, rel=0.1)
    assert differenced < 0.01 * white if slope > 0.0 else differenced > 1.9 * white


def test_differenced_encoder_noise_is_not_a_model_error() -> None:
    """The steps of an encoder do not average out if the piston is slow, so the residuals exceed the noise."""
    fit, one = told(2_010)
    rng, encoder = np.random.default_rng(0), replace(one, differenced=True)
    steps = 2.0 * np.diff(rng.standard_normal((2_011, 1)), axis=0) / np.sqrt(2.0)
    as_steps, as_white = (
        replace(fit, fitted=one.outputs - NOISE * np.hstack([velocity, rng.standard_normal((2_010, 1))]))
        for velocity in (steps, 2.0 * rng.standard_normal((2_010, 1)))
    )
    assert wrong(as_steps, encoder)[0] == 0.0
    assert wrong(as_white, encoder)[0] == pytest.approx((4.0 - NOISE_ALONE**2) * NOISE[0] ** 2, rel=0.1)
    assert wrong(as_steps, one)[0] == pytest.approx(wrong(as_white, one)[0], rel=0.1)


def test_a_fast_log_followed_to_its_noise_shows_no_model_error() -> None:
    """A search counts no residual as less than a thousandth of the signal, but the noise averages to less than that."""
    fit, one = told(14_010)
    quiet = replace(one, noise=0.3 * NOISE)
    followed = replace(leaving(fit, quiet, 0.3 * NOISE), scales=least_scales(quiet))
    assert followed.scales[0] == pytest.approx(NOISE[0], rel=1e-3)
    assert np.array_equal(wrong(followed, quiet), np.zeros(2))
    sure, as_loud = (
        error_moment(each, nothing_seldom(14_010), blocks, CENTRE, SURE, ALL, SPREADS)[0, 0]
        for each, blocks in ((followed, quiet), (fit, one))
    )
    assert sure == pytest.approx(0.3**2 * as_loud, rel=0.01)


def test_with_a_model_error_the_noise_of_a_position_counts_as_white() -> None:
    fit, one = told(410, 0.5)
    # neighbouring residuals agree in sign as often as they differ
    up = np.where(np.arange(410) // 2 % 2, 1.0, -1.0)[:, None]
    steady = replace(fit, slopes=fit.slopes + NOISE, fitted=one.outputs - up * fit.scales)
    white, differenced = (
        error_moment(steady, nothing_seldom(410), blocks, CENTRE, SURE, ALL, SPREADS)
        for blocks in (one, replace(one, differenced=True))
    )
    np.testing.assert_array_equal(white, differenced)


def test_a_lasting_error_below_the_noise_of_a_block_is_detected() -> None:
    fit, one = told(14_010)
    noise = NOISE * np.random.default_rng(0).normal(size=fit.fitted.shape)
    noise -= np.mean(noise[one.first :], axis=0)
    hidden = np.where(np.arange(14_010) // 100 % 2, 0.4, -0.4)[:, None] * NOISE
    alone, lasting = (replace(fit, fitted=one.outputs - left) for left in (noise, noise + hidden))
    assert np.array_equal(wrong(alone, one), np.zeros(2))
    assert wrong(lasting, one) == pytest.approx((0.4 * NOISE) ** 2, rel=0.2)
    wide, narrow = (
        error_moment(each, nothing_seldom(14_010), one, CENTRE, SURE, ALL, SPREADS) for each in (lasting, alone)
    )
    assert wide[0, 0] > 20.0 * narrow[0, 0]


def test_a_local_model_error_widens_only_coordinates_that_act_there() -> None:
    left = np.zeros((1_000, 1))
    left[100:200] = 2.0
    seen = np.ones((1_000, 1), dtype=bool)
    assert local_variance(left, seen)[150] == pytest.approx(10.0)
    assert local_variance(left, seen)[300] == 0.0
    assert np.all(local_variance(0.0 * left, seen) == 1.0)
    seen[150:160] = False
    assert local_variance(np.where(seen, left, 0.0), seen)[155] == pytest.approx(990 / 90)
    blocks = 14_010
    fit, one = told(blocks, 0.5)
    slopes = np.zeros_like(fit.slopes)
    slopes[0, : blocks // 2] = slopes[1, blocks // 2 :] = 30.0 * NOISE
    here = np.where(np.arange(blocks) < blocks // 2, 2.0, 0.0)[:, None] * NOISE * (-1.0) ** np.arange(blocks)[:, None]
    errs = replace(fit, slopes=slopes, fitted=one.outputs - here)
    found = np.diag(error_moment(errs, nothing_seldom(blocks), one, CENTRE, SURE, ALL, SPREADS))
    assert found[0] > 50.0 * found[1]


def test_an_error_in_one_output_leaves_the_information_of_the_other() -> None:
    fit, one = told(1_410)
    velocity_off = leaving(fit, one, NOISE * [10.0, 1.0])
    both_off = leaving(fit, one, NOISE * 10.0)
    sure, less, least = (
        error_moment(one_fit, nothing_seldom(1_410), one, CENTRE, SURE, ALL, SPREADS)[0, 0]
        for one_fit in (fit, velocity_off, both_off)
    )
    assert less == pytest.approx(2.0 * sure, rel=0.1)  # pressure still contributes all its information
    assert least > 10.0 * less


def test_a_rarely_known_parameter_widens_a_coordinate_with_the_same_effect() -> None:
    blocks = 1_410
    fit, one = told(blocks)
    alike, apart = nothing_seldom(blocks), nothing_seldom(blocks)
    alike[1] = fit.slopes[0]
    apart[1] = fit.slopes[0] * np.where(np.arange(blocks) % 2, 3.0, -1.0)[:, None]
    sure, open_, seen = (
        np.sqrt(error_moment(fit, seldom, one, CENTRE, SURE, ALL, SPREADS)[0, 0])
        for seldom in (nothing_seldom(blocks), alike, apart)
    )
    weak, valve = WEAK_PRIOR[0, 0], SELDOM_KNOWN["makeup_opening"] ** 2
    odds = (
        RIGHT_SHARE / (1.0 - RIGHT_SHARE) * np.sqrt((weak + valve) / weak)
    )  # the log agrees with the rig file's valve
    assert open_**2 == pytest.approx(weak * valve / (weak + valve) / (1.0 + odds), rel=0.03)
    assert sure < seen < 2.0 * sure


def test_residuals_like_the_effect_of_a_rarely_known_parameter_widen_a_coordinate() -> None:
    blocks, by = 14_010, 0.2
    fit, one = told(blocks)
    seldom = nothing_seldom(blocks)
    seldom[1] = fit.slopes[0] + fit.slopes[1] * 0.5
    rest = seldom[1] - fit.slopes[0]  # the remainder if the first coordinate is free and the second is fixed
    given_way = replace(fit, slopes=fit.slopes * np.array([1, 0, 1, 1, 1, 1, 1])[:, None, None])
    without = error_moment(given_way, seldom, one, CENTRE, SURE, ALL, SPREADS)[0, 0]
    strayed = error_moment(replace(given_way, fitted=one.outputs - by * rest), seldom, one, CENTRE, SURE, ALL, SPREADS)[
        0, 0
    ]
    assert np.sqrt(strayed - without) == pytest.approx(by, rel=0.05)


def test_the_uncertainty_of_a_force_from_the_log_is_added_in_full() -> None:
    blocks = 1_410
    fit, one = told(blocks)
    force = np.concatenate([nothing_seldom(blocks), fit.slopes[:1]])
    open_ = error_moment(fit, force, one, CENTRE, SURE, ALL, np.append(SPREADS, 0.1))[0, 0]
    sure = error_moment(fit, nothing_seldom(blocks), one, CENTRE, SURE, ALL, SPREADS)[0, 0]
    assert open_ - sure == pytest.approx(0.1**2 * WEAK_PRIOR[0, 0] / (0.1**2 + WEAK_PRIOR[0, 0]), rel=0.05)


def test_the_friction_of_a_stuck_piston_has_the_spread_of_all_likely_conditions() -> None:
    blocks = 1_410
    fit, one = told(blocks)
    rated = COORDINATES.index("friction_rated")
    hidden = np.array([0.0 if name.startswith("friction") else 1.0 for name in COORDINATES])
    two = ACTUATOR.conditions[[0, 4]]
    apart = two[1, rated] - two[0, rated]
    alone, even, unlikely = (
        error_moment(fit, nothing_seldom(blocks), one, two, odds, hidden, SPREADS)
        for odds in (np.array([0.0, -1e3]), np.zeros(2), np.array([0.0, -20.0]))
    )
    assert alone[rated, rated] == pytest.approx(WEAK_PRIOR[rated, rated], rel=1e-6)
    assert even[rated, rated] == pytest.approx(WEAK_PRIOR[rated, rated] + 0.5 * apart**2, rel=1e-6)
    assert unlikely[rated, rated] == pytest.approx(alone[rated, rated], rel=1e-3)
    assert even[0, 0] < 0.01 * even[rated, rated]


def fitted(at: int) -> tuple[PointFit, Blocks, np.ndarray]:
    """Return a fit at a condition, its log without the measured outputs, and its row of parameters."""
    speed = make_drive("prbs", 4.0, 1e-3, EhaParameters(), np.random.default_rng(0))[:4_001]
    count = (len(speed) - 1) // 10
    one = Blocks(speed, 1e-3, 10, np.zeros(count), np.zeros(count), NOISE)
    centre = ACTUATOR.conditions[at]
    (row,) = parameter_rows(centre[None], ACTUATOR.circuit, ACTUATOR.rated)
    (run,) = predicted_outputs(one, row[None])
    return PointFit(centre, 0.0, np.eye(7), NOISE, run, np.zeros((7, count, 2))), one, row


def nudged(fit: PointFit, one: Blocks, row: np.ndarray, name: str, by: float) -> np.ndarray:
    """Return the change of the outputs for a change of one parameter."""
    other = row.copy()
    other[COLUMN[name]] += by
    return predicted_outputs(one, other[None])[0] - fit.fitted


def same(slope: np.ndarray, expected: np.ndarray) -> bool:
    return bool(np.all(np.std(slope - expected, axis=0) < 0.05 * np.std(expected, axis=0)))


def test_slopes_of_rarely_known_parameters_match_finite_differences_of_the_circuit() -> None:
    fit, one, row = fitted(0)
    slopes = dict(zip(SELDOM_KNOWN, seldom_known_slopes(fit, one, ACTUATOR), strict=True))
    for name in ("moving_mass", "makeup_opening"):
        by = np.expm1(0.05) * row[COLUMN[name]]
        assert same(slopes[name], nudged(fit, one, row, name, by) / 0.05), name
    name, by = "pump_crossport_leakage", -0.05 * row[COLUMN["leakage_coefficient"]]
    assert same(slopes[name], nudged(fit, one, row, name, by) / -0.05)


def test_the_slope_of_case_leakage_is_the_mean_of_a_rise_and_a_fall() -> None:
    fit, one, row = fitted(list(CONDITIONS).index("major_leakage"))
    name = "pump_case_leakage"
    slope = seldom_known_slopes(fit, one, ACTUATOR)[list(SELDOM_KNOWN).index(name)]
    whole, case = row[COLUMN["leakage_coefficient"]], row[COLUMN[name]]
    up = nudged(fit, one, row, name, SELDOM_KNOWN[name] * whole) / SELDOM_KNOWN[name]
    down = nudged(fit, one, row, name, -case) / (-case / whole)
    assert not same(up, down)
    assert same(slope, 0.5 * (up + down))
    tight = replace(ACTUATOR, circuit=replace(ACTUATOR.circuit, pump_case_leakage=0.0))
    assert np.all(np.isfinite(seldom_known_slopes(fit, one, tight)))
