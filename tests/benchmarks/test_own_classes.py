import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.own_classes import COMPONENTS, Verdicts, cycle_features, judged_in_blocks, read_rig_cycles
from plant.errors import HydrostateError, LogError


@pytest.fixture(scope="module")
def rig(shared: Path) -> Path:
    folder = shared / "data" / "uci_hydraulic"
    if not folder.is_dir():
        pytest.skip(f"no data of the ZeMA test rig in {folder}")
    return folder


def test_features_of_a_cycle_ignore_the_order_within_a_part() -> None:
    cycles = np.random.default_rng(0).standard_normal((4, 3, 60))
    shuffled = cycles.copy()
    shuffled[:, :, :5] = cycles[:, :, 4::-1]
    np.testing.assert_allclose(cycle_features(shuffled), cycle_features(cycles))
    assert cycle_features(cycles).shape == (4, 72)


@pytest.mark.parametrize("shape", [(4, 60), (4, 3, 61)])
def test_cycles_of_another_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(HydrostateError, match="multiple of 12"):
        cycle_features(np.zeros(shape))


def test_balanced_accuracy_weighs_classes_alike() -> None:
    probabilities = np.array([[1.0, 0.0]] * 8 + [[0.4, 0.6], [0.7, 0.3]])
    verdicts = Verdicts(("sound", "worn"), np.array([0] * 8 + [1, 1]), probabilities)
    assert verdicts.balanced_accuracy == pytest.approx(0.75)
    assert verdicts.confusion.loc["worn"].tolist() == [1, 1]


def test_separate_classes_are_told_apart_from_other_blocks_alone() -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra rig-examples)")
    rng = np.random.default_rng(1)
    labels = np.tile(np.repeat(["sound", "worn"], 5), 20)
    features = rng.standard_normal((200, 3)) + 4.0 * (labels == "worn")[:, None]
    verdicts = judged_in_blocks(features, labels)
    assert verdicts.balanced_accuracy > 0.98
    np.testing.assert_allclose(verdicts.probabilities.sum(axis=1), 1.0)


def test_classes_that_are_noise_are_not_told_apart() -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra rig-examples)")
    labels = np.tile(np.repeat([0, 1], 5), 40)
    verdicts = judged_in_blocks(np.random.default_rng(2).standard_normal((400, 3)), labels)
    assert 0.4 < verdicts.balanced_accuracy < 0.6


def test_a_class_in_one_block_alone_is_refused() -> None:
    with pytest.raises(HydrostateError, match="class worn occurs in one block alone"):
        judged_in_blocks(np.zeros((100, 2)), np.repeat(["sound", "worn"], [95, 5]))


@pytest.mark.parametrize(("labels", "blocks"), [(9, 2), (10, 1), (10, 11)])
def test_labels_and_blocks_that_do_not_fit_are_refused(labels: int, blocks: int) -> None:
    with pytest.raises(HydrostateError, match="must be as many"):
        judged_in_blocks(np.zeros((10, 2)), np.arange(labels) % 2, blocks)


def test_scikit_learn_is_asked_for_by_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sklearn.discriminant_analysis", None)
    with pytest.raises(HydrostateError, match=r"hydrostate\[rig-examples\]"):
        judged_in_blocks(np.zeros((20, 2)), np.arange(20) % 2)


def test_data_that_are_not_there_or_do_not_fit_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"uci_hydraulic_1hz\.npz and profile\.csv are wanted"):
        read_rig_cycles(tmp_path)
    np.savez(tmp_path / "uci_hydraulic_1hz.npz", X=np.zeros((2, 3, 60)))
    (tmp_path / "profile.csv").write_text("pump_leak,valve_pct\n0,100\n")
    with pytest.raises(LogError, match="got 1 rows of pump_leak, valve_pct for 2 cycles"):
        read_rig_cycles(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("component", COMPONENTS)
def test_the_test_rigs_components_are_found_in_contiguous_blocks(rig: Path, component: str) -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra rig-examples)")
    cycles, labels = read_rig_cycles(rig)
    assert judged_in_blocks(cycle_features(cycles), labels[component].to_numpy()).balanced_accuracy >= 0.97
