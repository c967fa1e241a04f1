"""Baselines compared with this package: shares of right verdicts on plain logs, strange logs, and outside faults."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from experiments.open_benchmark.baselines import LEARNERS, Names
from experiments.open_benchmark.folders import write_set
from experiments.open_benchmark.kinds import KINDS, VERSION
from experiments.open_benchmark.loaders import read_arrays, read_truth, rows_of
from experiments.open_benchmark.score import score_set
from experiments.page.tables import Column
from experiments.running.progress import Track
from experiments.running.study import Study, StudyResult
from faults.diagnosis.rmse import score_mathematical
from faults.eha.bank import mathematical_bank
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.files import read_record

TEST_KINDS = (
    *("plain", "closed_loop", "stiff_oil", "rig_mass_wrong", "pressure_lags_2_ms", "pressure_gain_20_percent_high"),
    *("worn_pump", "makeup_check_leaks", "pressure_reversed"),
)
"""Kinds of logs on the page: first the kind used for training, last those outside the nine conditions."""

LEARNER_SERIES = (8.0, 4e-3)
"""Duration and sample time of the part of a log that the learners see [s]."""


@dataclass(frozen=True)
class BaselineSettings:
    """Size of the training and test sets.

    Parameters
    ----------
    training : int
        Plain logs for training; nine logs give one of each condition [count].
    test : int
        Logs of each kind to judge [count].
    """

    training: int = 360
    test: int = 18


def find(settings: BaselineSettings, track: Track) -> StudyResult:
    """Return the share of right verdicts, by method and kind."""
    with TemporaryDirectory() as place:
        home = Path(place)
        seen = write_set("plain", "training", settings.training, home / "training").parent
        judged = [
            write_set(kind, "test", settings.test, home).parent for kind in track(TEST_KINDS, description="making logs")
        ]
        verdicts = {**learner_verdicts([seen], judged), "smallest RMSE, as published": rmse_verdicts(judged)}
        shares: list[dict[str, Any]] = [
            {"method": name, **right_shares(judged, said)} for name, said in verdicts.items()
        ]
        ours: dict[str, Any] = {"method": "hydrostate diagnose"}
        for folder in track(judged, description="diagnosing"):
            rows = list(score_set(folder, settings.test, pressure=True))
            ours[folder.name] = 100.0 * float(np.mean([row["right"] for row in rows]))
    return StudyResult({"baselines": pd.DataFrame([*shares, ours])})


def learner_verdicts(seen: Sequence[Path], judged: Sequence[Path]) -> dict[str, Names]:
    """Return the verdicts of every installed learner on the logs of the sets, in their order."""
    X, y, _ = read_arrays(seen, *LEARNER_SERIES)
    other = _series(read_arrays(judged, *LEARNER_SERIES)[0])
    found: dict[str, Names] = {}
    for name, learn in LEARNERS.items():
        try:
            found[name] = learn(_series(X), y)(other)
        except HydrostateError:
            continue
    return found


def _series(X: Array) -> Array:
    """Return series by channel, with zeros for channels that are not logged; shape (logs, 4, samples), SI."""
    return np.nan_to_num(X.reshape(len(X), 4, -1))


def rmse_verdicts(judged: Iterable[Path]) -> Names:
    """Return the condition whose lumped model has the smallest error on each log, as in the paper's Table 5."""
    bank = mathematical_bank(EhaParameters())
    files = [folder / str(row["file"]) for folder in judged for row in rows_of(read_truth(folder))]
    return np.array([score_mathematical(read_record(file), bank).condition for file in files])


def right_shares(judged: Sequence[Path], said: Names) -> dict[str, float]:
    """Return the accuracy of a method that never says "unknown" [%], by set.

    Parameters
    ----------
    judged : sequence of Path
        Folders of the sets.
    said : ndarray, shape (logs,)
        Verdicts of the method, set by set.

    Returns
    -------
    dict[str, float]
        Accuracy [%].
    """
    shares, at = dict[str, float](), 0
    for folder in judged:
        accepted = [str(row["accept"]).split(";") for row in rows_of(read_truth(folder))]
        hits = [verdict in accept for verdict, accept in zip(said[at : at + len(accepted)], accepted, strict=True)]
        shares[folder.name], at = 100.0 * float(np.mean(hits)), at + len(accepted)
    return shares


BASELINES = Study(
    "open-benchmark",
    "open_benchmark/report.html",
    find,
    {},
    {"baselines": ("method", *(Column(kind, kind.replace("_", " "), "%", digits=3) for kind in TEST_KINDS))},
    {"version": VERSION, "kinds": {name: KINDS[name].strange for name in TEST_KINDS}},
)
"""Baselines on the open benchmark."""
