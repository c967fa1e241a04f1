"""A load on the rod is found from the force balance, and the condition under it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.finding import Finding
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AgainstCode, ClassCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
ROD = {"area_difference": 0.15, "volume_difference": 0.15, "pilot_share": 1.0}


@cache
def log(condition: str, **changed: float) -> Record:
    rng = np.random.default_rng(5)
    p = replace(circuit_of(parameters_for(CONDITIONS[condition])), **changed)
    return simulate(CIRCUIT, make_drive("prbs", 6.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def load_of(found: Finding) -> float:
    return next(float(note.data["force_n"]) for note in found.notes if note.code is ClassCode.LOAD_ON_ROD)


def test_a_log_without_a_load_is_told_of_none() -> None:
    found = diagnose_log(log("minor_leakage"), Rig())
    assert found.condition == "minor_leakage"
    assert [note for note in found.notes if note.code is ClassCode.LOAD_ON_ROD] == []


@pytest.mark.parametrize("force", [1200.0, -800.0])
def test_a_load_is_found_with_the_condition_under_it(force: float) -> None:
    found = diagnose_log(log("minor_leakage", load_force=force), Rig())
    assert found.condition == "minor_leakage"
    assert load_of(found) == pytest.approx(force, abs=60.0)


def test_a_load_in_the_rig_file_needs_no_finding() -> None:
    found = diagnose_log(log("normal", load_force=1200.0), Rig(parameters=replace(HEALTHY, load_force=1200.0)))
    assert found.condition == "normal"
    assert [note for note in found.notes if note.code is ClassCode.LOAD_ON_ROD] == []


def test_a_single_rod_is_diagnosed_by_its_two_areas() -> None:
    found = diagnose_log(log("minor_leakage", **ROD), Rig(parameters=replace(HEALTHY, **ROD)))
    assert found.condition == "minor_leakage"
    modulus = found.quantities["bulk_modulus"].value
    assert modulus == pytest.approx(HEALTHY.bulk_modulus, rel=0.01)


@pytest.mark.slow
def test_a_single_rod_by_its_mean_area_is_unknown() -> None:
    blind = diagnose_log(log("minor_leakage", **ROD), Rig())
    assert blind.unknown
    assert AgainstCode.UNEXPLAINED in {note.code for note in blind.against} or not blind.gate.passed
