"""The doubt of a fitted circuit: sensors' noise, a wrong model's error counted once, and what is seldom known."""

from dataclasses import replace

import numpy as np
import pytest

from faults.diagnosis.actuator import Actuator
from faults.diagnosis.blocks import Blocks
from faults.diagnosis.circuit_runs import COORDINATES, parameter_rows, predicted
from faults.diagnosis.class_fit import WEAK, PointFit
from faults.diagnosis.model_doubt import LOOKS, SELDOM_KNOWN, doubt_of, seldom_known_slopes, spreads_of
from plant.eha.model import EhaParameters

ACTUATOR = Actuator.of(EhaParameters())
CENTRE, SURE, ALL = ACTUATOR.conditions[:1], np.zeros(1), np.ones(7)
SPREADS = spreads_of(ACTUATOR)
NOISE = np.array([1e-4, 1e3])


def log(blocks: int) -> Blocks:
    still = np.full(blocks, 0.1)
    return Blocks(np.zeros(10 * blocks + 1), 1e-3, 10, still, 1e6 * still, NOISE)


def told(blocks: int, share: float = 0.0) -> tuple[PointFit, Blocks]:
    """Return a fit that leaves of each output a share that no sensor makes; each coordinate moves its own blocks."""
    one = log(blocks)
    scales = NOISE / np.sqrt(1.0 - share)
    slopes = np.zeros((7, blocks, 2))
    for i in range(7):
        slopes[i, i::7] = NOISE
    return PointFit(CENTRE[0], 0.0, np.eye(7), scales, one.outputs, slopes), one


def nothing_seldom(blocks: int) -> np.ndarray:
    return np.zeros((len(SELDOM_KNOWN), blocks, 2))


def variances(blocks: int, share: float = 0.0) -> np.ndarray:
    fit, one = told(blocks, share)
    return np.diag(doubt_of(fit, nothing_seldom(blocks), one, CENTRE, SURE, ALL, SPREADS))


def test_noise_alone_averages_away_and_the_error_of_a_wrong_model_does_not() -> None:
    assert variances(14_010)[0] == pytest.approx(2.0 * variances(28_010)[0], rel=0.02)
    assert variances(14_010, 0.5)[0] == pytest.approx(variances(28_010, 0.5)[0], rel=0.02)


def test_a_wrong_model_is_counted_once() -> None:
    blocks, share = 14_010, 0.5
    seen = blocks - log(blocks).first
    variance = 7.0 / (2.0 * seen) * (1.0 + share * seen / LOOKS) / (1.0 - share)
    assert variances(blocks, share)[0] == pytest.approx(1.0 / (1.0 / variance + np.linalg.inv(WEAK)[0, 0]), rel=0.01)


def test_each_output_answers_for_its_own_error() -> None:
    fit, one = told(1_410)
    velocity_off = replace(fit, scales=NOISE * [10.0, 1.0])
    both_off = replace(fit, scales=NOISE * 10.0)
    sure, less, least = (
        doubt_of(one_fit, nothing_seldom(1_410), one, CENTRE, SURE, ALL, SPREADS)[0, 0]
        for one_fit in (fit, velocity_off, both_off)
    )
    assert less == pytest.approx(2.0 * sure, rel=0.1)  # pressure still tells all that it told
    assert least > 10.0 * less


def test_what_is_seldom_known_widens_what_answers_like_it_as_far_as_the_log_leaves_it_open() -> None:
    blocks = 1_410
    fit, one = told(blocks)
    alike, apart = nothing_seldom(blocks), nothing_seldom(blocks)
    alike[1] = fit.slopes[0]
    apart[1] = fit.slopes[0] * np.where(np.arange(blocks) % 2, 3.0, -1.0)[:, None]
    sure, open_, seen = (
        np.sqrt(doubt_of(fit, seldom, one, CENTRE, SURE, ALL, SPREADS)[0, 0])
        for seldom in (nothing_seldom(blocks), alike, apart)
    )
    assert open_ == pytest.approx(min(SELDOM_KNOWN["makeup_opening"], np.sqrt(WEAK[0, 0])), rel=0.3)
    assert sure < seen < 2.0 * sure


def test_what_the_log_says_of_what_is_seldom_known_counts_as_far_as_the_fit_went_without_it() -> None:
    blocks, by = 14_010, 0.2
    fit, one = told(blocks)
    seldom = nothing_seldom(blocks)
    seldom[1] = fit.slopes[0] + fit.slopes[1] * 0.5
    rest = seldom[1] - fit.slopes[0]  # what is left once the first coordinate has given way, and the second may not
    given_way = replace(fit, slopes=fit.slopes * np.array([1, 0, 1, 1, 1, 1, 1])[:, None, None])
    without = doubt_of(given_way, seldom, one, CENTRE, SURE, ALL, SPREADS)[0, 0]
    strayed = doubt_of(replace(given_way, fitted=one.outputs - by * rest), seldom, one, CENTRE, SURE, ALL, SPREADS)[
        0, 0
    ]
    assert np.sqrt(strayed - without) == pytest.approx(by, rel=0.05)


def test_friction_of_a_piston_that_sticks_is_open_to_each_condition_that_is_as_likely() -> None:
    blocks = 1_410
    fit, one = told(blocks)
    rated = COORDINATES.index("friction_rated")
    hidden = np.array([0.0 if name.startswith("friction") else 1.0 for name in COORDINATES])
    two = ACTUATOR.conditions[[0, 4]]
    apart = two[1, rated] - two[0, rated]
    alone, even, unlikely = (
        doubt_of(fit, nothing_seldom(blocks), one, two, odds, hidden, SPREADS)
        for odds in (np.array([0.0, -1e3]), np.zeros(2), np.array([0.0, -20.0]))
    )
    assert alone[rated, rated] == pytest.approx(WEAK[rated, rated], rel=1e-6)
    assert even[rated, rated] == pytest.approx(WEAK[rated, rated] + 0.5 * apart**2, rel=1e-6)
    assert unlikely[rated, rated] == pytest.approx(alone[rated, rated], rel=1e-3)
    assert even[0, 0] < 0.01 * even[rated, rated]


def test_slopes_are_those_of_the_circuit_that_was_fitted() -> None:
    speed = np.repeat([60.0, 120.0, -120.0, -70.0], 100)
    empty = np.zeros(40)
    one = Blocks(np.append(speed, speed[-1]), 1e-3, 10, empty, empty, NOISE)
    (row,) = parameter_rows(CENTRE, ACTUATOR.circuit, ACTUATOR.rated)
    (run,) = predicted(one, row[None])
    fit = PointFit(CENTRE[0], 0.0, np.eye(7), NOISE, run, np.zeros((7, 40, 2)))
    slopes = seldom_known_slopes(fit, one, ACTUATOR)
    for name, by in (("moving_mass", np.exp(0.05)), ("makeup_opening", np.exp(0.05)), ("pump_crossport_leakage", None)):
        now = getattr(ACTUATOR.circuit, name)
        changed = now - 0.05 * ACTUATOR.circuit.leakage_coefficient if by is None else now * by
        other = replace(ACTUATOR.circuit, **{name: changed})
        (moved,) = predicted(one, parameter_rows(CENTRE, other, ACTUATOR.rated)) - run
        told_of = 0.05 * slopes[list(SELDOM_KNOWN).index(name)] * (-1.0 if by is None else 1.0)
        assert np.all(np.std(told_of - moved, axis=0) < 0.05 * np.std(moved, axis=0)), name
