"""Kinds of logs: one name gives the same bits, no seed is in two splits, and each can be written and read back."""

from itertools import product
from math import gcd
from pathlib import Path

import numpy as np
import pytest

import hydrostate as hs
from experiments.open_benchmark.drives import DRIVES
from experiments.open_benchmark.folders import truth_of, write_set
from experiments.open_benchmark.kinds import KINDS, SPLITS, STRIDE, VERSION, kind_of, make, seed_of
from experiments.open_benchmark.loaders import read_arrays, read_logs, read_truth
from experiments.open_benchmark.logger import DIFFERENCE, SPEED, Sensor
from experiments.open_benchmark.run import RECORD
from faults.conditions import CONDITIONS
from plant.errors import HydrostateError

COLUMNS = [
    *(
        "file",
        "set",
        "note",
        "input",
        "sample_time_s",
        "leakage",
        "friction",
        "leak_coeff",
        "flow_bias",
        "a1",
        "a2",
        "a3",
    ),
    *("bulk_modulus_pa", "beta_lo", "beta_hi", "accept", "rig", "columns", "sev", "vmax", "dpmax", "xmin", "xmax"),
]
"""Columns of the truth of strange rigs that `score.py` reads."""


@pytest.mark.usefixtures("_short")
def test_the_same_kind_split_and_index_give_the_same_log_and_another_index_another() -> None:
    first, again, other = make("plain", "test", 3), make("plain", "test", 3), make("plain", "test", 4)
    assert first.log.equals(again.log)
    assert not first.log.equals(other.log)


@pytest.mark.parametrize(
    ("kind", "modulus", "position"),
    [
        ("plain", 262456034.33, 0.0150873958),
        ("entrained_air", 160625410.79, 0.0028890304),
        ("single_rod", 169516984.38, 0.0563541723),
    ],
)
def test_logs_are_the_same_within_a_version(kind: str, modulus: float, position: float) -> None:
    assert VERSION == "1.0", "a new version has new figures here"
    made = make(kind, "test", 1)
    assert made.setup.machine.bulk_modulus == pytest.approx(modulus, rel=1e-9)
    assert made.states[-1, 2] == pytest.approx(position, rel=1e-5)


def test_no_two_logs_share_a_seed() -> None:
    seeds = [tuple(seed_of(kind, split, index)) for kind, split, index in product(KINDS, SPLITS, range(5))]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize(
    ("kind", "split", "index"), [("plane", "test", 0), ("plain", "tests", 0), ("plain", "test", -1)]
)
def test_an_unknown_kind_or_split_and_a_negative_index_are_refused(kind: str, split: str, index: int) -> None:
    with pytest.raises(HydrostateError):
        make(kind, split, index)


def test_every_kind_uses_known_conditions_and_drives_and_reaches_each_condition() -> None:
    for kind in KINDS.values():
        assert gcd(STRIDE, len(kind.conditions)) == 1
        assert {*kind.accept, *kind.conditions} <= {*CONDITIONS, "condition", "unknown"}
        assert set(kind.drives) <= set(DRIVES)


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_written_and_read_back(kind: str, tmp_path: Path) -> None:
    write_set(kind, "validation", 1, tmp_path)
    truth = read_truth(tmp_path / kind)
    assert list(truth.columns)[: len(COLUMNS)] == COLUMNS
    (row,) = truth.to_dict("records")
    assert str(row["version"]) == VERSION
    assert row["beta_lo"] <= row["bulk_modulus_pa"] <= row["beta_hi"]
    assert 0.0 < row["vmax"] < 1.0
    ((_, log),) = read_logs(tmp_path / kind)
    assert {"time_s", SPEED} <= set(log.columns)
    assert np.isfinite(log.to_numpy()).all()
    assert log["time_s"].iloc[-1] == pytest.approx(2.0, rel=0.01)


@pytest.mark.usefixtures("_short")
def test_the_truth_says_whether_and_when_an_actuator_changes(tmp_path: Path) -> None:
    told = {}
    for kind in ("plain", "entrained_air", "leakage_sets_in", "oil_warms", "intermittent_friction"):
        (told[kind],) = read_truth(write_set(kind, "validation", 1, tmp_path).parent).to_dict("records")
    assert [kind for kind, row in told.items() if row["steady"]] == ["plain", "entrained_air"]
    assert [kind for kind, row in told.items() if row["since_s"] != ""] == ["leakage_sets_in"]
    assert 0.6 < told["leakage_sets_in"]["since_s"] < 1.4  # in the middle of a log of two seconds


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("kind", ["plain", "chamber_pressures", "single_rod"])
def test_a_written_log_can_be_read_with_its_rig_file(kind: str, tmp_path: Path) -> None:
    write_set(kind, "validation", 1, tmp_path)
    (row,) = read_truth(tmp_path / kind).to_dict("records")
    log = hs.read(tmp_path / kind / row["file"], rig=tmp_path / kind / row["rig"] if row["rig"] else None)
    assert len(log) == 2000


@pytest.mark.usefixtures("_short")
def test_logs_become_frames_and_arrays(tmp_path: Path) -> None:
    folders = [
        write_set(kind, "training", 2, tmp_path).parent for kind in ("plain", "chamber_pressures", "no_velocity")
    ]
    X, y, groups = read_arrays(folders, duration=1.5, sample_time=2e-3)
    assert X.shape == (6, 4 * 750)
    assert list(groups[::2]) == ["plain", "chamber_pressures", "no_velocity"]
    assert set(y) <= set(CONDITIONS)
    assert np.isnan(X[-1, 1500:2250]).all()
    assert np.isfinite(X[2]).all()
    truth, log = next(read_logs(folders[0]))
    assert truth["condition"] == y[0]
    assert len(log) == 2000
    with pytest.raises(HydrostateError, match=r"truth\.csv"):
        read_truth(tmp_path)


@pytest.mark.usefixtures("_short")
def test_a_plain_sensor_adds_noise_and_a_late_one_a_delay() -> None:
    plain = make("plain", "test", 0)
    states = plain.states[::10]
    assert np.std(plain.log[SPEED] - states[:, 0]) == pytest.approx(0.05, rel=0.1)
    late = make("pressure_5_ms_late", "test", 0)
    true = (late.states[:, 4] - late.states[:, 5])[::10]
    assert np.std(late.log[DIFFERENCE].to_numpy()[5:] - true[:-5]) == pytest.approx(5e3, rel=0.1)


def test_a_sensor_can_hold_drift_have_play_and_be_a_low_pass() -> None:
    time, rng = 1e-3 * np.arange(2000), np.random.default_rng(1)
    fine = RECORD * np.arange(20_000)

    def read(frequency: float, **changes: float) -> np.ndarray:
        return Sensor(**changes).read(time, fine, np.sin(2.0 * np.pi * frequency * fine), rng)

    true = np.sin(2.0 * np.pi * time)
    assert np.array_equal(read(1.0, hold=4), read(1.0)[np.arange(2000) // 4 * 4])
    assert read(1.0, drift=2.0) - true == pytest.approx(np.linspace(0.0, 2.0, 2000), abs=1e-9)
    behind = read(1.0, play=0.2)
    assert np.max(behind) == pytest.approx(0.9, abs=1e-3)
    assert np.max(np.abs(behind - true)) == pytest.approx(0.1, abs=1e-3)
    assert np.std(read(30.0, corner=30.0)[1000:]) == pytest.approx(0.5, rel=0.02)
    assert np.std(read(1.0, corner=30.0) - true) == pytest.approx(np.std(np.gradient(true, time)) * 7.5e-3, rel=0.02)


def test_an_unknown_kind_is_refused_with_the_nearest_known_name() -> None:
    with pytest.raises(HydrostateError, match=r"^kind 'plane' is unknown, did you mean 'plain'\?$"):
        kind_of("plane")
    with pytest.raises(HydrostateError, match=r"^kind 'q' is unknown, `hydrostate benchmark kinds` lists"):
        kind_of("q")


@pytest.mark.usefixtures("_short")
def test_the_true_value_of_a_growing_leakage_is_that_at_mid_log() -> None:
    grown = make("leakage_grows", "test", 0)
    healthy, row = grown.setup.machine.leakage, truth_of(grown, "test", 0)
    assert row["leak_coeff"] == pytest.approx(np.sqrt(healthy * 6.006e-11), rel=1e-6, abs=0.0)


@pytest.mark.parametrize(("index", "opened"), [(0, True), (1, False)])
def test_the_truth_names_the_relief_valve_only_if_it_opened(index: int, *, opened: bool) -> None:
    made = make("relief_set_low", "test", index)
    row = truth_of(made, "test", index)
    assert (row["dpmax"] > made.setup.machine.relief) == opened
    assert row["accept"] == ("unknown" if opened else f"unknown;{row['condition']}")
    assert row["named"] == ("relief" if opened else "")
