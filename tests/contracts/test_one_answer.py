"""Estimate and diagnose give the same bulk modulus, interval and gate for the same log."""

import warnings
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from estimation.eha.estimate import estimate_log
from estimation.finding import Outcome
from experiments.command.json_output import plain
from experiments.command.logs import read_log
from experiments.eha.entries import diagnosis_entries, estimate_entries
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.rig import Rig, read_rig
from plant.errors import LogWarning
from plant.log.columns import parse_columns
from tests.thinned import thinned

FEW = ("bench/run002.csv", "strange/makeup_check_stuck_shut/run002.csv", "strange/speed_sign_reversed/run001.csv")
"""A sound log, one of which only the class is doubted, and one from which nothing can be concluded."""

ENOUGH = 1500
"""Number of samples that gives the same conclusions for each of them [samples]."""


SETS = (
    "bench",
    *(
        f"strange/{name}"
        for name in (
            "big_actuator",
            "chamber_pressures",
            "clock_jitters",
            "closed_loop",
            "coarse_converters",
            "constant_load",
            "control",
            "leakage_grows",
            "logged_at_5_kHz",
            "makeup_check_stuck_shut",
            "no_velocity",
            "oil_warms",
            "position_zero_at_stop",
            "pressure_lags_2_ms",
            "rig_area_4_percent_high",
            "rig_mass_half_of_true",
            "rig_volume_25_percent_low",
            "single_rod",
            "soft_oil",
            "speed_sign_reversed",
            "stiff_oil",
            "worn_pump",
        )
    ),
)
"""Folders of logs that were made outside this project."""


def answers(log: Path, samples: int | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what the two verbs print for a log or its beginning, with the rig and columns that its set specifies."""
    truth = pd.read_csv(log.parent / "truth.csv", dtype=str, keep_default_na=False)
    row = truth[truth["file"] == log.name].iloc[0]
    rig = read_rig(log.parent / row["rig"]) if row.get("rig") else Rig()
    columns = parse_columns(row["columns"].split(",")) if row.get("columns") else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        record = read_log(log, rig.columns, columns).slice(0, samples)
    return plain(estimate_entries(estimate_log(record, rig))), plain(diagnosis_entries(diagnose_log(record, rig)))


def disagreement(log: Path, estimated: dict[str, Any], diagnosed: dict[str, Any]) -> str:
    """Return where the verbs differ on a log; empty if they agree."""
    said = [name for name in ("bulk_modulus_pa", "gate") if estimated[name] != diagnosed[name]]
    modulus = estimated["bulk_modulus_pa"]
    ends = {name: modulus[name] or [None, None] for name in ("ci95", "ci95_total")}
    shown = {"value": modulus["value"], "unit": "Pa", **ends}
    if diagnosed.get("severity", {}).get("bulk_modulus", shown) != shown:
        said.append("severity.bulk_modulus")
    refused = estimated["outcome"] in (Outcome.OK, Outcome.MISMATCH) and not estimated["gate"]["passed"]
    if refused and not diagnosed["unknown"]:
        said.append("the gate refuses the fit and a class is named")
    return f"{log}: {', '.join(said)}" if said else ""


@pytest.mark.parametrize("place", thinned(FEW, [FEW[0], FEW[2]]))
def test_estimate_and_diagnose_give_one_answer(place: str, shared: Path) -> None:
    estimated, diagnosed = answers(shared / place, ENOUGH)
    assert disagreement(shared / place, estimated, diagnosed) == ""
    assert place == FEW[2] or estimated["bulk_modulus_pa"]["value"] is not None
    assert estimated["gate"]["passed"] == (place != FEW[2])
    assert diagnosed["unknown"] == (place != FEW[0])


@pytest.mark.slow
@pytest.mark.parametrize("folder", SETS)
def test_estimate_and_diagnose_give_one_answer_on_every_set(folder: str, shared: Path) -> None:
    logs = sorted((shared / folder).glob("run*.csv"))
    assert len(logs) >= 3
    found = (disagreement(log, *answers(log)) for log in logs[::2])
    assert [said for said in found if said] == []


def test_every_strange_data_set_is_compared(shared: Path) -> None:
    folders = {f"strange/{path.name}" for path in (shared / "strange").iterdir() if path.is_dir()}
    assert folders <= set(SETS)
