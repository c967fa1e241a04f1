"""Two kinds in one log: both are drawn, the right answer follows from both, and single logs keep their bits."""

import re
from collections import Counter
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from experiments.open_benchmark.folders import write_set
from experiments.open_benchmark.kinds import KINDS, SPLITS, drawn_pairs, kind_of, make, seed_of
from experiments.open_benchmark.loaders import read_truth
from experiments.open_benchmark.logger import DIFFERENCE
from experiments.open_benchmark.pairs import collide
from plant.errors import HydrostateError


@pytest.mark.usefixtures("_short")
def test_the_log_of_a_pair_contains_both_faults() -> None:
    made = make("pressure_1_bar_off+worn_pump", "training", 2)
    true = (made.states[:, 4] - made.states[:, 5])[::10]
    assert made.setup.machine.efficiency == 0.8
    assert np.mean(made.log[DIFFERENCE] - true) == pytest.approx(1e5, rel=0.01)
    assert made.log.equals(make("pressure_1_bar_off+worn_pump", "training", 2).log)


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("pair", ["speed_in_rpm+big_actuator", "big_actuator+speed_in_rpm"])
def test_a_pair_with_another_actuator_keeps_the_fault_of_the_other_kind(pair: str) -> None:
    made = make(pair, "training", 15)
    assert made.setup.logger.sensors["motor_speed_rad_s"].gain == pytest.approx(60.0 / (2.0 * np.pi))
    assert made.setup.rig["piston_area"] == pytest.approx(3.0 * 1.52e-3)


@pytest.mark.parametrize(
    ("pair", "accept"),
    [
        ("pressure_lags_2_ms+rig_volume_wrong", ("condition",)),
        ("pressure_lags_2_ms+constant_load", ("condition", "unknown")),
        ("pressure_lags_2_ms+worn_pump", ("unknown",)),
        ("constant_load+worn_pump", ("unknown",)),
        ("pressure_1_bar_off+leakage_grows", ("minor_leakage", "major_leakage", "unknown")),
        ("intermittent_friction+leakage_grows", ("unknown",)),
    ],
)
def test_a_pair_accepts_the_verdicts_that_both_kinds_accept(pair: str, accept: tuple[str, ...]) -> None:
    assert kind_of(pair).accept == accept


def test_the_verdict_on_a_pair_must_name_both_causes() -> None:
    pattern = kind_of("pressure_lags_2_ms+worn_pump").named
    told = ("the pump is worn\nthe pressure is late", "the pressure is late\nthe pump is worn")
    assert all(re.search(pattern, text, re.IGNORECASE) for text in told)
    assert not re.search(pattern, "the pressure is late", re.IGNORECASE)
    assert kind_of("stiff_oil+no_velocity").named == ""


def test_a_pair_takes_the_drives_and_conditions_that_one_kind_prescribes() -> None:
    for pair in ("coarse_converters+spring_load", "spring_load+coarse_converters"):
        assert kind_of(pair).drives == KINDS["spring_load"].drives
    assert kind_of("coarse_converters+leakage_grows").conditions == ("normal",)


@pytest.mark.parametrize(
    "pair",
    [
        "pressure_lags_2_ms+pressure_lags_2_ms",
        "rig_volume_wrong+single_rod",
        "pressure_reversed+pressure_gain_3_percent_high",
        "closed_loop+constant_load",
        "makeup_check_stuck_shut+leakage_grows",
        "plain+worn_pump",
        "worn_pump+plane",
        "worn_pump+",
        "worn_pump+stiff_oil+no_velocity",
    ],
)
def test_kinds_that_collide_are_refused(pair: str) -> None:
    with pytest.raises(HydrostateError):
        make(pair, "training", 0)


def test_pairs_are_drawn_reproducibly_and_include_every_kind_except_plain() -> None:
    every = drawn_pairs("training", len(KINDS) ** 2)
    assert every[:9] == drawn_pairs("training", 9) != drawn_pairs("test", 9)
    assert len(set(every)) == len(every) > 1000
    assert set(Counter(name for pair in every for name in pair.split("+"))) == KINDS.keys() - {"plain"}
    assert not any(collide(*(KINDS[name] for name in pair.split("+"))) for pair in every)
    with pytest.raises(HydrostateError):
        drawn_pairs("tests", 9)


def test_no_pair_shares_a_seed_with_another_or_with_a_kind() -> None:
    names = (*KINDS, *drawn_pairs("test", len(KINDS) ** 2))
    assert len({tuple(seed_of(name, split, 0)) for name, split in product(names, SPLITS)}) == len(names) * len(SPLITS)


@pytest.mark.usefixtures("_short")
def test_a_set_of_logs_can_begin_at_any_index(tmp_path: Path) -> None:
    folder = write_set("pressure_lags_2_ms+single_rod", "validation", 1, tmp_path, first=5).parent
    (row,) = read_truth(folder).to_dict("records")
    assert folder.name == row["set"] == "pressure_lags_2_ms+single_rod"
    assert row["index"] == 5
    assert row["rig"]
    assert (folder / "rig.toml").is_file()
