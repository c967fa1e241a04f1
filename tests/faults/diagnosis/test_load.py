"""A load on the rod is found from the force balance, and the condition under it."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.finding import Finding
from estimation.notes import RigCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.load import first_guesses, under_load
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


@pytest.mark.parametrize("force", [-800.0, pytest.param(1200.0, marks=pytest.mark.slow)])
def test_a_load_is_found_with_the_condition_under_it(force: float) -> None:
    found = diagnose_log(log("minor_leakage", load_force=force), Rig())
    assert found.condition == "minor_leakage"
    assert load_of(found) == pytest.approx(force, abs=60.0)
    (note,) = [note for note in found.notes if note.code is ClassCode.LOAD_ON_ROD]
    assert note.data["pressure_pa"] * HEALTHY.piston_area == pytest.approx(note.data["force_n"])


def test_a_load_in_the_rig_file_needs_no_finding() -> None:
    found = diagnose_log(log("normal", load_force=1200.0), Rig(parameters=replace(HEALTHY, load_force=1200.0)))
    assert found.condition == "normal"
    assert [note for note in found.notes if note.code is ClassCode.LOAD_ON_ROD] == []


def test_a_single_rod_is_diagnosed_by_its_two_areas() -> None:
    found = diagnose_log(log("minor_leakage", **ROD), Rig(parameters=replace(HEALTHY, **ROD)))
    assert found.condition == "minor_leakage"
    modulus = found.quantities["bulk_modulus"].value
    assert modulus == pytest.approx(HEALTHY.bulk_modulus, rel=0.01)


ESTIMATE: Any = SimpleNamespace(explanation=None)


def loads(guesses: Iterator[EhaParameters]) -> list[float]:
    return [guess.load_force for guess in guesses]


def test_loads_that_hold_the_first_and_the_mean_pressure_are_tried_about_the_rigs_own() -> None:
    record = Record(1e-3, {"differential_pressure_pa": np.array([1e5, np.nan, 3e5])})
    area = HEALTHY.piston_area
    assert loads(first_guesses(record, HEALTHY, ESTIMATE)) == [0.0, pytest.approx(2e5 * area)]
    begun: Any = SimpleNamespace(explanation=SimpleNamespace(values={"start_pressure": (4e5, 1e3)}))
    assert loads(first_guesses(record, HEALTHY, begun)) == [
        0.0, pytest.approx(4e5 * area), pytest.approx(2e5 * area)
    ]  # fmt: skip
    told = replace(HEALTHY, load_force=500.0)
    assert loads(first_guesses(record, told, begun)) == [500.0, pytest.approx(2e5 * area)]


def circuit_under(
    true: float, tried: list[float], *, gain: float = 1.0, told: bool = True
) -> Callable[[EhaParameters], Any]:
    """Return a diagnosis that asks for a share of the load that is missing, and is content within 1 N."""

    def diagnosed(p: EhaParameters) -> Any:
        tried.append(p.load_force)
        missing = true - p.load_force
        bias = AgainstCode.PRESSURE_BIAS.note(bias_pa=gain * missing / p.piston_area)
        other = AgainstCode.UNEXPLAINED.note(percent=9.0, channel="pressure", limit=6.0)
        return SimpleNamespace(against=() if abs(missing) < 1.0 else (bias, other) if told else (other,))

    return diagnosed


def test_the_load_that_a_bias_asks_for_is_taken_until_nothing_asks() -> None:
    tried: list[float] = []
    found, loaded = under_load(circuit_under(800.0, tried), iter([HEALTHY]))
    assert found.against == ()
    assert loaded.load_force == pytest.approx(800.0)
    assert tried == [0.0, pytest.approx(800.0)]


def test_where_no_load_is_enough_the_rigs_own_stands() -> None:
    tried: list[float] = []
    guesses = [HEALTHY, replace(HEALTHY, load_force=100.0)]
    found, loaded = under_load(circuit_under(800.0, tried, gain=0.5), iter(guesses))
    assert loaded is HEALTHY
    assert found.against
    assert tried == pytest.approx([0.0, 400.0, 600.0, 100.0, 450.0, 625.0])


def test_where_no_bias_is_told_the_next_guess_is_tried() -> None:
    tried: list[float] = []
    found, loaded = under_load(
        circuit_under(800.0, tried, told=False), iter([HEALTHY, replace(HEALTHY, load_force=800.0)])
    )
    assert found.against == ()
    assert loaded.load_force == 800.0
    assert tried == [0.0, 800.0]


@pytest.mark.slow
def test_a_single_rod_of_which_the_rig_file_gives_the_mean_area_is_named_with_its_condition() -> None:
    found = diagnose_log(log("minor_leakage", **ROD), Rig())
    assert (found.condition, found.unknown) == ("minor_leakage", False)
    (note,) = [note for note in found.notes if note.code is RigCode.SINGLE_ROD]
    assert note.data["percent"] == pytest.approx(100.0 * 0.85 / 1.15, abs=2.0)
    assert found.quantities["bulk_modulus"].value == pytest.approx(HEALTHY.bulk_modulus, rel=0.005)
