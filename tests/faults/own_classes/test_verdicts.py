import numpy as np
import pytest

from faults.own_classes.calibration import Calibration, fit_calibration
from faults.own_classes.verdicts import Verdicts


def test_balanced_accuracy_weights_classes_equally() -> None:
    probabilities = np.array([[1.0, 0.0]] * 8 + [[0.4, 0.6], [0.7, 0.3]])
    verdicts = Verdicts(("sound", "worn"), np.array([0] * 8 + [1, 1]), probabilities, np.ones(10))
    assert verdicts.balanced_accuracy == pytest.approx(0.75)
    assert verdicts.accuracy == pytest.approx(0.9)
    assert verdicts.confusion.loc["worn"].tolist() == [1, 1]


def test_the_calibration_error_is_zero_for_correct_probabilities_only() -> None:
    right = np.array([0] * 8 + [1] * 2)
    claimed = np.tile([0.8, 0.2], (10, 1))
    assert Verdicts(("a", "b"), right, claimed, np.ones(10)).calibration_error == pytest.approx(0.0)
    bold = Verdicts(("a", "b"), right, np.tile([1.0, 0.0], (10, 1)), np.ones(10))
    assert bold.calibration_error == pytest.approx(0.2)
    assert bold.reliability().iloc[0].tolist() == pytest.approx([1.0, 0.8, 10])


def test_calibration_corrects_overconfident_scores() -> None:
    rng = np.random.default_rng(0)
    truth = rng.uniform(-4.0, 4.0, 4000)
    true = (rng.uniform(size=4000) < 1.0 / (1.0 + np.exp(-truth))).astype(np.int64)
    scores = np.column_stack([np.zeros(4000), 7.0 * truth])
    found = fit_calibration(scores, np.arange(2), true)
    assert found.temperature == pytest.approx(7.0, rel=0.1)
    assert found.spread < 0.02


def test_learnt_classes_are_summed_into_reported_ones_and_missing_ones_count_zero() -> None:
    scores = np.log(np.array([[0.2, 0.3, 0.5], [0.1, 0.9, 1.0]]))
    scores[1, 2] = -np.inf
    found = Calibration().probabilities(scores, np.array([0, 1, 0]))
    np.testing.assert_allclose(found, [[0.7, 0.3], [0.1, 0.9]])
