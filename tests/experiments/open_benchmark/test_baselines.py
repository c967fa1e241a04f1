"""Baselines learn separable classes, and the table counts their correct verdicts."""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from experiments.open_benchmark.baselines import LEARNERS, forest_on_features, ridge_classifier
from experiments.open_benchmark.features import simple_features
from experiments.open_benchmark.study import BASELINES, TEST_KINDS, BaselineSettings, right_shares
from experiments.running.study import StudyResult, write_result
from plant.arrays import Array
from plant.errors import HydrostateError


def waves(seed: int, each: int = 12) -> tuple[Array, NDArray[np.str_]]:
    """Return logs whose velocity either follows the motor, or has a smaller gain and a lag."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 8.0, 400)
    logs, names = list[Array](), list[str]()
    for _ in range(each):
        f, phase = rng.uniform(0.5, 1.5), rng.uniform(0.0, 6.0)
        for name, share, late in (("normal", 1.0, 0.0), ("minor_leakage", 0.7, 0.6)):
            speed = 100.0 * np.sin(f * t + phase)
            velocity = share * 4e-4 * 100.0 * np.sin(f * t + phase - late)
            pressure = 4e5 * np.tanh(velocity / 1e-3)
            logs.append(np.stack([speed, np.cumsum(velocity) * 0.02, velocity, pressure]) * rng.normal(1.0, 0.01))
            names.append(name)
    return np.array(logs), np.array(names)


@pytest.mark.parametrize("name", LEARNERS)
def test_every_learner_separates_two_kinds_of_logs(name: str) -> None:
    if "forest" in name:
        pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra learn)")
    verdicts = LEARNERS[name](*waves(0))
    series, wanted = waves(1)
    assert np.mean(verdicts(series) == wanted) >= 0.9


def test_the_forest_without_scikit_learn_names_the_missing_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.ensemble", None)
    with pytest.raises(HydrostateError, match="learn"):
        forest_on_features(*waves(0, each=1))


def test_a_ridge_classifier_on_noise_mostly_chooses_the_most_frequent_class() -> None:
    rng = np.random.default_rng(0)
    y = np.array(["a"] * 30 + ["b"] * 10)
    verdicts = ridge_classifier(rng.standard_normal((40, 200)), y)
    assert np.mean(verdicts(rng.standard_normal((200, 200))) == "a") > 0.6


def test_features_are_finite_for_a_channel_that_is_not_logged() -> None:
    series, _ = waves(2, each=2)
    series[:, 2] = 0.0
    assert np.isfinite(simple_features(series)).all()


def test_a_verdict_counts_as_right_if_the_truth_accepts_it(tmp_path: Path) -> None:
    truth = pd.DataFrame({"file": ["a", "b"], "accept": ["normal;unknown", "unknown"]})
    truth.to_csv(tmp_path / "truth.csv", index=False)
    assert right_shares([tmp_path], np.array(["normal", "normal"])) == {tmp_path.name: 50.0}


def test_the_page_has_a_row_for_each_method_and_the_number_of_each_kind(tmp_path: Path) -> None:
    table = pd.DataFrame([{"method": "hydrostate diagnose", **dict.fromkeys(TEST_KINDS, 50.0)}])
    write_result(BASELINES, BaselineSettings(9, 1), StudyResult({"baselines": table}), tmp_path / "page")
    page = (tmp_path / "page" / "report.html").read_text("utf-8")
    assert "hydrostate diagnose" in page
    assert "worn pump: 80" in page.replace("\N{NO-BREAK SPACE}", " ")
