import pickle
import sys
from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from plant.errors import HydrostateError

pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra learn)")

from sklearn.base import clone
from sklearn.model_selection import cross_val_score
from sklearn.utils.estimator_checks import parametrize_with_checks

from faults.own_classes.classifier import Classifier


def runs(seed: int, count: int, apart: float, width: int = 3) -> tuple[Array, np.ndarray[Any, Any]]:
    """Return features and labels of two classes that alternate every five runs."""
    rng = np.random.default_rng(seed)
    labels = np.tile(np.repeat(["sound", "worn"], 5), count // 10)
    return rng.standard_normal((count, width)) + apart * (labels == "worn")[:, None], labels


@parametrize_with_checks([Classifier()])
@pytest.mark.filterwarnings("ignore")
def test_the_classifier_passes_the_checks_of_scikit_learn(estimator: Any, check: Any) -> None:
    # the checks divide by zero on purpose, and our tests otherwise raise floating-point errors
    with np.errstate(all="ignore"):
        check(estimator)


def test_well_separated_classes_are_recognized_in_held_out_blocks() -> None:
    verdicts = Classifier().judge(*runs(1, 200, 4.0))
    assert verdicts.balanced_accuracy > 0.98
    assert verdicts.classes == ("sound", "worn")
    np.testing.assert_allclose(verdicts.probabilities.sum(axis=1), 1.0)


def test_classes_of_pure_noise_get_chance_accuracy_and_low_probabilities() -> None:
    verdicts = Classifier().judge(*runs(2, 400, 0.0))
    assert 0.4 < verdicts.balanced_accuracy < 0.6
    assert verdicts.probabilities.max() < 0.7


def test_probabilities_match_the_normal_distributions_that_made_the_runs() -> None:
    x, labels = runs(3, 2000, 0.8)
    learnt = Classifier().fit(x, labels)
    other, _ = runs(4, 400, 0.8)
    odds = 0.8 * (other.sum(axis=1) - 1.2)
    truth = 1.0 / (1.0 + np.exp(-odds))
    assert np.abs(learnt.predict_proba(other)[:, 1] - truth).max() < 0.08


def test_duplicated_runs_in_a_group_do_not_make_probabilities_overconfident() -> None:
    # every run occurs ten times, each ten form a group, and the labels are noise
    x, labels = runs(5, 60, 0.0)
    order = np.random.default_rng(6).permutation(60)
    x, labels = np.repeat(x[order], 10, axis=0), np.repeat(labels[order], 10)
    groups = np.repeat(np.arange(60), 10)
    assert Classifier().fit(x, labels, groups).predict_proba(x).max() < 0.75
    assert 0.3 < Classifier().judge(x, labels, groups).balanced_accuracy < 0.7


def signs(seed: int) -> tuple[Array, np.ndarray[Any, Any], list[str]]:
    """Return runs in which the sign of the state's effect depends on the load."""
    rng = np.random.default_rng(seed)
    worn, load = np.arange(300) // 10 % 2, np.arange(300) // 5 % 2
    x = np.column_stack([(2 * worn - 1.0) * (2 * load - 1.0), 5.0 * load]) + 0.3 * rng.standard_normal((300, 2))
    states = np.where(worn == 1, "worn", "sound")
    return x, states, [f"{state}@{place}" for state, place in zip(states, load, strict=True)]


def test_a_state_that_differs_by_load_is_recognized_if_classes_are_learnt_per_load_and_merged() -> None:
    x, states, under_load = signs(7)
    assert Classifier().judge(x, states).balanced_accuracy < 0.7
    merged = Classifier(merge="@").judge(x, under_load)
    assert merged.classes == ("sound", "worn")
    assert merged.balanced_accuracy > 0.98


@pytest.mark.parametrize(
    "merge",
    [
        "@",
        {f"{state}@{load}": state for state in ("sound", "worn") for load in (0, 1)},
        lambda name: name.split("@")[0],
    ],
)
def test_classes_are_merged_by_a_separator_a_mapping_or_a_function(merge: Any) -> None:
    x, states, under_load = signs(8)
    learnt = Classifier(merge=merge).fit(x, under_load)
    assert learnt.classes_.tolist() == ["sound", "worn"]
    assert learnt.learnt_classes_.tolist() == ["sound@0", "sound@1", "worn@0", "worn@1"]
    assert learnt.score(x, states) == learnt.score(x, under_load) > 0.98


def test_runs_unlike_all_learnt_classes_are_unknown_and_others_are_not() -> None:
    x, labels = runs(9, 400, 5.0)
    learnt = Classifier(unknown=0.01).fit(x, labels)
    fresh, _ = runs(10, 2000, 5.0)
    assert np.mean(learnt.predict(fresh) == "unknown") < 0.02
    along = learnt.predict([[12.0, 12.0, 12.0]])
    across = learnt.predict([[9.0, -9.0, 0.0]])
    assert [*along, *across] == ["unknown", "unknown"]


def test_a_new_class_is_unknown_despite_variation_common_to_all_classes() -> None:
    x, labels = runs(11, 400, 6.0, width=1)
    drift = 100.0 * np.random.default_rng(12).standard_normal((400, 1))
    blocks = np.repeat(np.random.default_rng(13).standard_normal((4, 30)) * 20.0, 100, axis=0)
    x = np.column_stack([x + drift, drift, blocks + np.random.default_rng(14).standard_normal((400, 30))])
    learnt = Classifier(unknown=0.01).fit(x, labels)
    worse = x[labels == "worn"] + np.concatenate([[9.0], np.zeros(31)])
    assert np.mean(learnt.predict(worse) == "unknown") > 0.8
    assert np.mean(learnt.predict(x) == "unknown") < 0.02


def test_a_classifier_can_be_cloned_pickled_and_cross_validated() -> None:
    x, labels = runs(15, 100, 3.0)
    learnt = clone(Classifier(merge="@", unknown=0.02)).fit(x, labels)
    again = pickle.loads(pickle.dumps(learnt))  # noqa: S301 -- our own
    np.testing.assert_array_equal(again.predict_proba(x), learnt.predict_proba(x))
    assert cross_val_score(Classifier(), x, labels).mean() > 0.95


@pytest.mark.parametrize(
    ("arguments", "labels", "message"),
    [
        ({"unknown": 1.5}, "ab", "unknown must be a share between 0 and 1"),
        ({"merge": 3}, "ab", "merge must be a text, a mapping or a function"),
        ({"merge": {"a": "c", "b": "c"}}, "ab", "two classes at least are needed, got one class: c"),
    ],
)
def test_invalid_options_and_a_single_class_are_refused(arguments: dict[str, Any], labels: str, message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        Classifier(**arguments).fit(np.arange(20.0)[:, None], list(labels) * 10)


def test_a_class_that_occurs_in_only_one_group_cannot_be_judged() -> None:
    x, labels = runs(16, 100, 3.0)
    groups = np.where(labels == "worn", 9, np.arange(100) // 10)
    with pytest.raises(HydrostateError, match="class worn occurs in one block alone"):
        Classifier().judge(x, labels, groups)


@pytest.mark.parametrize(("labels", "blocks"), [(9, 2), (10, 1), (10, 11)])
def test_inconsistent_numbers_of_labels_or_blocks_are_refused(labels: int, blocks: int) -> None:
    with pytest.raises(HydrostateError, match="as many labels, and blocks from 2 to that are needed"):
        Classifier().judge(np.zeros((10, 2)), np.arange(labels) % 2, blocks=blocks)


def test_without_scikit_learn_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    import faults.own_classes.face as face

    monkeypatch.setitem(sys.modules, "sklearn.base", None)
    monkeypatch.delitem(sys.modules, "faults.own_classes.classifier")
    with pytest.raises(HydrostateError, match=r"hydrostate\[learn\]"):
        face.Classifier(merge="@")
