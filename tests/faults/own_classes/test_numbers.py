"""Results of features, folds and classifiers on a few runs, kept in `numbers.json`."""

from typing import Any

import numpy as np
import pytest

from estimation.arrays import Array
from tests.edges import edge
from tests.numbers import Numbers, or_refused

pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra learn)")

from faults.own_classes import classifier, features
from faults.own_classes.calibration import Calibration, fit_calibration, log_loss
from faults.own_classes.classifier import Classifier
from faults.own_classes.discriminant import learn
from faults.own_classes.features import Recipe, channel_features
from faults.own_classes.groups import contiguous_blocks, folds
from faults.own_classes.verdicts import Verdicts

NUMBERS = Numbers(__file__)


def run(seed: int, count: int = 61) -> Array:
    rng = np.random.default_rng(seed)
    t = np.arange(count)
    return np.stack(
        [
            3.0 + np.sin(0.7 * t) + 0.1 * rng.standard_normal(count),
            1e-3 * rng.standard_normal(count) ** 3,
            np.full(count, 2.0),
        ]
    )


@NUMBERS.case()
def features_of_runs() -> dict[str, Any]:
    def told(recipe: Recipe, count: int = 61, sample_time: float = 0.01) -> Any:
        frame = channel_features(["p", "q", "c"], [run(1, count), run(2, count + 7)], sample_time, recipe)
        return {name: frame[name].to_numpy() for name in frame.columns}

    def refused(recipe: Recipe, count: int = 61, sample_time: float = 0.01) -> Any:
        return or_refused(lambda: len(channel_features(["p", "q", "c"], [run(1, count)], sample_time, recipe).columns))

    huge, small = run(1), run(1)
    huge[0, 3], small[0] = np.inf, 0.0
    return {
        "unless told": list(channel_features(["p"], [run(1)[:1]], 0.01, Recipe()).columns),
        "three parts": told(Recipe(parts=3)),
        "bands": told(Recipe(parts=1, edges=(0.0, 5.0, 20.0, 50.0))),
        "octaves": list(told(Recipe(parts=1, octaves=3))),
        "octaves of a slow run": list(told(Recipe(parts=1, octaves=9), 12, 3.0)),
        "octaves of a short run": list(told(Recipe(parts=1, octaves=9), 12)),
        "parts": [refused(Recipe(parts=parts), 20) for parts in (0, 1, 20, 21)],
        "edges": [
            refused(Recipe(edges=edges))
            for edges in ((1.0,), (1.0, 1.0), (-1.0, 5.0), (0.0, 5.0), (5.0, 4.0), (0.1, 0.2), (0.0, 1e3), (60.0, 70.0))
        ],
        "sample times": [refused(Recipe(), 61, one) for one in (0.0, -1.0, np.inf, 1e-9)],
        "no run": or_refused(lambda: channel_features(["p"], [], 1.0, Recipe())),
        "what is not finite": or_refused(lambda: channel_features(["p", "q", "c"], [run(3), huge], 1.0, Recipe())),
        "what is nothing": channel_features(["p", "q", "c"], [small], 1.0, Recipe(parts=1, octaves=1)).to_numpy()[
            0, :7
        ],
        "inside": [features._is_inside_band(np.array([1.0, 1.0 + 5e-10, 2.0, 2.0 + 1e-9, 2.0 + 4e-9]), (1.0, 2.0))],  # pyright: ignore[reportPrivateUsage]
    }


PLACES = np.array([0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2])


@NUMBERS.case()
def folds_of_runs() -> dict[str, Any]:
    mixed = np.tile([0, 1, 2], 6)
    groups = np.array([0, 0, 1, 1, 2, 2, 2, 3, 4, 4, 5, 5, 5, 6, 6, 7, 7, 7])
    return {
        "blocks": [
            contiguous_blocks(places, count, most)
            for places in (PLACES, mixed)
            for count in (2, 3, 5)
            for most in (1.0, 0.5, 0.3)
        ],
        "block at the limit": [contiguous_blocks(np.array([0, 0, 1, 1, 0, 0, 1, 1]), 2, most) for most in (0.5, 0.51)],
        "folds without groups": [one.tolist() for one in folds(mixed, None, 4)],
        "folds of few runs": [one.tolist() for one in folds(np.array([0, 1, 0]), None, 5)],
        "folds of groups": [one.tolist() for one in folds(mixed, groups, 3)],
        "folds of as many groups": [one.tolist() for one in folds(mixed, groups, 8)],
        "refused": [
            or_refused(lambda one=one: len(folds(mixed, one, 3))) for one in (np.zeros(18), np.zeros(5), ["a", "b"] * 9)
        ],
    }


def labelled(count: int = 90, apart: float = 2.0) -> tuple[Array, Any]:
    rng = np.random.default_rng(5)
    labels = np.tile(np.repeat(["sound@1", "sound@2", "worn"], 5), count // 15)
    x = rng.standard_normal((count, 4)) * [1.0, 10.0, 0.1, 1.0] + 5.0
    x[:, 0] += apart * (labels == "worn")
    x[:, 1] += 20.0 * (labels == "sound@2")
    x[:, 3] = 0.5 * x[:, 0] + 0.2 * rng.standard_normal(count)
    return x, labels


@NUMBERS.case(relative=1e-4)
def classes_that_are_learnt() -> dict[str, Any]:
    x, labels = labelled()
    places = np.unique(labels, return_inverse=True)[1]
    told: dict[str, Any] = {}
    for share, one in zip((1.0, 0.1), learn(x, places, 4, (1.0, 0.1)), strict=True):
        told[f"share {share:g}"] = {
            "mean": one.mean,
            "scale": one.scale,
            "centres": one.centres,
            "factor": one.factor,
            "log priors": one.log_priors,
            "scores": one.scores(x[:3])[:, :3],
            "distances": one.distances(x[[0, 7, 12]]),
        }
    few = learn(np.column_stack([x[:6], np.ones(6)]), places[:6], 2)[0]
    told["of few and of one that is constant"] = [few.scale, few.distances(np.column_stack([x[:2], np.ones(2)]))]
    told["of two that lie together"] = learn(np.vstack([x[:6], x[:6]]), np.repeat([0, 1], 6), 2)[0].distances(x[:3])[
        :, 1
    ]
    return told


@NUMBERS.case(relative=1e-4)
def probabilities_that_hold() -> dict[str, Any]:
    rng = np.random.default_rng(9)
    true = np.tile([0, 1], 40)
    scores = rng.standard_normal((80, 3)) * 6.0 + 8.0 * np.eye(2)[true][:, [0, 1, 1]]
    merged = np.array([0, 1, 1])
    scores[3, 2] = -np.inf
    found = fit_calibration(scores, merged, true)
    crude = fit_calibration(40.0 * scores, merged, true)
    sure = fit_calibration(np.eye(2)[true][:, [0, 1, 1]] * 0.1, merged, true)
    return {
        "probabilities": [Calibration(t, s).probabilities(scores[:5], merged) for t, s in ((1.0, 0.0), (5.0, 0.1))],
        "far scores": Calibration().probabilities(np.array([[0.0, -900.0, -600.0]]), merged),
        "log loss": [log_loss(Calibration(t, 0.01).probabilities(scores, merged), true) for t in (0.5, 3.0, 50.0)],
        "log loss of nothing": log_loss(np.array([[1.0, 0.0]]), np.array([1])),
        "calibrated": [found.temperature, found.spread],
        "crude": [crude.temperature, crude.spread],
        "sure": [sure.temperature, sure.spread],
    }


@NUMBERS.case(relative=1e-3)
def classifiers() -> dict[str, Any]:
    x, labels = labelled()
    made = Classifier(merge="@", unknown=0.05).fit(x, labels)
    strange = np.array([[5.0, 5.0, 5.0, 2.5], [30.0, 5.0, 5.0, 2.5], [8.0, 25.0, 5.3, 4.0]])
    grouped = Classifier(unknown=0.2).fit(x, labels, np.arange(90) // 6)
    verdicts = Classifier(merge="@").judge(x, labels, blocks=6)
    few = Classifier().fit(x[:12], labels[:12])
    wide = Classifier().fit(np.hstack([x, np.random.default_rng(1).standard_normal((90, 40))]), labels)

    def refused(**of: Any) -> Any:
        return or_refused(lambda: len(Classifier(**of).fit(x, labels).classes_))

    return {
        "classes": [list(made.classes_), list(made.learnt_classes_), list(grouped.classes_)],
        "shrinkages": [made.shrinkage_, grouped.shrinkage_, few.shrinkage_, wide.shrinkage_],
        "calibrations": [[one.calibration_.temperature, one.calibration_.spread] for one in (made, grouped, few, wide)],
        "probabilities": made.predict_proba(strange),
        "likeness": [made.likeness(strange), grouped.likeness(x[:4]), few.likeness(x[:2])],
        "found": [[str(one) for one in model.predict(strange)] for model in (made, grouped, few)],
        "score": [
            made.score(x, labels),
            made.score(x, labels, np.arange(90)),
            made.score(x, ["sound" if one != "worn" else one for one in labels]),
        ],
        "judged": [
            verdicts.accuracy,
            verdicts.balanced_accuracy,
            verdicts.log_loss,
            verdicts.calibration_error,
            verdicts.probabilities[::20],
            verdicts.likeness[::20],
        ],
        "judged in groups": Classifier().judge(x, labels, np.arange(90) // 9).probabilities[::30],
        "likeness of distances": classifier._likeness(
            np.array([[1.0, 1.0], [2.0, 3.0], [3.0, 9.0]]), np.array([[0.5, 0.5], [2.0, 4.0], [9.0, 9.0], [9.5, 1.0]])
        ),  # pyright: ignore[reportPrivateUsage]
        "merged": [
            [list(map(str, names)), list(places)]
            for names, places in (
                classifier._merged_classes(np.array(["a", "b"]), merge) for merge in (None, {"a": "b"}, str.upper)
            )
        ],  # pyright: ignore[reportPrivateUsage]
        "shares": [refused(unknown=one) for one in (0.0, 1e-9, 0.999, 1.0)],
        "one class": or_refused(lambda: Classifier(merge=lambda _: "x").fit(x, labels)),
        "a wrong merge": or_refused(lambda: Classifier(merge=3).fit(x, labels)),  # type: ignore[arg-type]
        "blocks": [or_refused(lambda one=one: Classifier().judge(x, labels, blocks=one).accuracy) for one in (1, 91)],
        "shapes": [
            or_refused(lambda: Classifier().judge(x[0], labels)),
            or_refused(lambda: Classifier().judge(x, labels[:5])),
        ],
        "a class in one block": or_refused(lambda: Classifier().judge(x[:12], labels[:12], np.repeat([0, 1, 2], 4))),
    }


@NUMBERS.case()
def verdicts_of_runs() -> dict[str, Any]:
    share = np.array([0.05, 0.34, 0.41, 0.55, 0.62, 0.77, 0.91, 1.0, 0.95, 0.3])
    made = Verdicts(
        ("a", "b", "c"),
        np.array([0, 1, 0, 1, 0, 0, 1, 0, 0, 1]),
        np.column_stack([share, 0.9 * (1.0 - share), 0.1 * (1.0 - share)]),
        share,
    )
    return {
        "found": made.found,
        "confusion": made.confusion.to_numpy(),
        "accuracies": [made.accuracy, made.balanced_accuracy],
        "log loss": made.log_loss,
        "reliability": {str(bins): made.reliability(bins).to_numpy() for bins in (4, 10)},
        "ranges unless told": len(made.reliability()),
        "calibration error": made.calibration_error,
        "said": str(made).splitlines()[0],
        "edges of a range": edge(
            lambda one: len(
                Verdicts(
                    ("a", "b"), np.array([0, 0]), np.array([[one, 1.0 - one], [0.95, 0.05]]), np.ones(2)
                ).reliability()
            ),
            0.86,
            0.94,
        ),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
