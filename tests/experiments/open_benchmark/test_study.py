"""The page of baselines: its methods, and the share of correct verdicts of each."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from experiments.open_benchmark import study
from experiments.open_benchmark.study import TEST_KINDS, BaselineSettings, find
from experiments.running.progress import without_progress
from plant.errors import HydrostateError


def test_every_method_has_a_row_with_its_share_of_right_verdicts_on_every_kind(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[tuple[str, str, int]] = []

    def written(kind: str, split: str, count: int, home: Path) -> Path:
        made.append((kind, split, count))
        return home / kind / "truth.csv"

    def judged(folder: Path, count: int, *, pressure: bool) -> list[dict[str, Any]]:
        assert (count, pressure) == (4, True)
        return [{"right": number < (3 if folder.name == "plain" else 1)} for number in range(4)]

    monkeypatch.setattr(study, "write_set", written)
    monkeypatch.setattr(study, "learner_verdicts", lambda *_: {"forest": np.array(["a"])})
    monkeypatch.setattr(study, "rmse_verdicts", lambda _: np.array(["b"]))
    monkeypatch.setattr(study, "right_shares", lambda folders, _: {folder.name: 40.0 for folder in folders})
    monkeypatch.setattr(study, "score_set", judged)
    table = find(BaselineSettings(training=9, test=4), without_progress).frames["baselines"]
    assert made == [("plain", "training", 9), *((kind, "test", 4) for kind in TEST_KINDS)]
    assert list(table["method"]) == ["forest", "smallest RMSE, as published", "hydrostate diagnose"]
    ours = table.iloc[-1]
    assert (ours["plain"], ours["worn_pump"]) == (75.0, 25.0)
    assert table.iloc[0]["worn_pump"] == 40.0


def test_a_learner_whose_package_is_not_installed_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> Any:
        raise HydrostateError("needs scikit-learn")

    def constant(series: np.ndarray, names: np.ndarray) -> Any:
        assert np.isfinite(series).all()  # channels that are not logged are zero
        return lambda other: np.repeat(names[:1], len(other))

    silent = np.full((2, 4 * 5), np.nan)
    arrays = SimpleNamespace(read=lambda *_: (silent, np.array(["normal", "minor_leakage"]), None))
    monkeypatch.setattr(study, "read_arrays", arrays.read)
    monkeypatch.setattr(study, "LEARNERS", {"forest": missing, "constant": constant})
    found = study.learner_verdicts([Path("seen")], [Path("judged")])
    assert {name: list(said) for name, said in found.items()} == {"constant": ["normal", "normal"]}
