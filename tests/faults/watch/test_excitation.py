import numpy as np
import pytest

from faults.watch.excitation import (
    COUNT,
    LARGEST_SCORE,
    LAST_BLOCK,
    LEAST_BLOCKS,
    MEAN,
    OCTAVES,
    SLOWEST_SPEED,
    SPEED_CLASSES,
    SPEED_RATIO,
    STALE,
    STILL,
    VARIANCE,
    excitation_octave,
    speed_class,
    standardise,
)


def test_steady_motion_is_in_the_first_octave_and_reversals_are_in_higher_ones() -> None:
    assert excitation_octave(0.0) == 0
    assert excitation_octave(0.9 * STILL) == 0
    assert excitation_octave(4.0) == 11
    assert excitation_octave(2.0) == 10
    assert excitation_octave(1e9) == OCTAVES - 1


def test_scores_of_a_class_have_mean_zero_and_deviation_one() -> None:
    rng, usual = np.random.default_rng(0), np.zeros(4)
    scores = [standardise(-6.0 + 0.3 * rng.standard_normal(), 300.0, True, 0.0, 0.0, usual) for _ in range(5000)]
    assert np.mean(scores[500:]) == pytest.approx(0.0, abs=0.05)
    assert np.std(scores[500:]) == pytest.approx(1.0, abs=0.05)
    assert usual[MEAN] == pytest.approx(-6.0, abs=0.1)
    assert usual[VARIANCE] == pytest.approx(0.09, rel=0.3)


def test_a_class_is_learnt_before_it_is_scored_and_the_score_of_a_block_is_limited() -> None:
    usual = np.zeros(4)
    values = [0.0, 0.1] * int(LEAST_BLOCKS)
    scores = [standardise(value, 300.0, True, 0.0, 0.0, usual) for value in values]
    assert not any(scores[: int(LEAST_BLOCKS)])
    assert any(scores[int(LEAST_BLOCKS) :])
    assert standardise(50.0, 300.0, True, 0.0, 0.0, usual) == LARGEST_SCORE
    assert standardise(50.0, 300.0, False, 0.0, 0.0, usual) == 0.0
    assert usual[COUNT] == len(values) + 2


def test_moments_weight_all_values_equally_and_fade_beyond_the_memory() -> None:
    values, memory = 3.0 + 2.0 * np.random.default_rng(2).standard_normal(60), 20.0
    usual = np.zeros(4)
    for n, value in enumerate(values, 1):
        standardise(value, memory, False, 0.0, 0.0, usual)
        shares = np.minimum(1.0, 1.0 / np.minimum(np.arange(1, n + 1), memory))
        weights = shares * np.append(np.cumprod((1.0 - shares[1:])[::-1])[::-1], 1.0)
        mean = weights @ values[:n]
        assert usual[COUNT] == min(n, memory)
        assert usual[MEAN] == pytest.approx(mean)
        assert usual[VARIANCE] == pytest.approx(weights @ (values[:n] - mean) ** 2, abs=1e-12)
        if n <= memory:
            assert usual[VARIANCE] == pytest.approx(np.var(values[:n]), abs=1e-12)


def test_classes_by_speed_separate_amplitudes_that_differ_by_a_quarter() -> None:
    assert speed_class(0.0) == speed_class(SLOWEST_SPEED) == 0
    assert speed_class(1.01 * SLOWEST_SPEED) == 1
    for fast in (0.06, 0.3, 1.0):
        assert speed_class(SPEED_RATIO * fast) == speed_class(fast) + 1
    assert speed_class(100.0) == SPEED_CLASSES - 1


def test_a_class_that_did_not_occur_for_long_is_learnt_again() -> None:
    memory, usual = 300.0, np.array([-6.0, 0.04, 300.0, 1000.0])
    soon = usual.copy()
    assert standardise(-5.0, memory, True, 0.0, 1000.0 + STALE * memory, soon) == pytest.approx(5.0)
    assert soon[LAST_BLOCK] == 1000.0 + STALE * memory
    assert standardise(-5.0, memory, True, 0.0, 1001.0 + STALE * memory, usual) == 0.0
    assert usual.tolist() == [-5.0, 0.0, 1.0, 1001.0 + STALE * memory]


def test_no_class_is_tighter_than_its_least_deviation() -> None:
    for least, score in ((0.0, 2.5), (0.4, 1.25)):
        usual = np.array([-6.0, 0.04, 300.0, 0.0])
        assert standardise(-5.5, 300.0, True, least, 1.0, usual) == pytest.approx(score)


def test_a_class_of_few_blocks_scores_less_than_one_that_is_well_known() -> None:
    """Before, a block of a class seen twenty times had the score of one that is known for long."""
    scores = []
    for blocks in (LEAST_BLOCKS, 300.0):
        usual = np.array([-6.0, 0.09, blocks, 0.0])
        scores.append(standardise(-4.5, 300.0, True, 0.0, 0.0, usual))
    assert scores == [pytest.approx(5.0 / (1.0 + 2.0 * (20.0**-0.5 - 300.0**-0.5))), pytest.approx(5.0)]
